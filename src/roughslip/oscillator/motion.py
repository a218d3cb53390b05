"""Motion of the mass on its friction path: the events, and the counts of cycles."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.oscillator.equation import place
from roughslip.oscillator.event_loop import REATTACHMENT, Events, Stand, begin, begin_in_slip, go_on
from roughslip.oscillator.integrators import PAIRS, STAGES
from roughslip.oscillator.law import FrictionLaw
from roughslip.oscillator.path import PathFeed
from roughslip.oscillator.slip import NEGATIVE, NODES_OVER, PATH_OVER, STEPS_OVER, Numerics
from roughslip.oscillator.system import Oscillator, coefficients

FrictionPath = np.ndarray | Iterable[np.ndarray] | None
STEPS_PER_PERIOD = 20_000  # and four a node of the path: far above any need, so that a run ends
TOLERANCES = (1e-13, 1e-3)
NEGATIVE_FRICTION = ("clip", "refuse")


@dataclass(frozen=True)
class Motion:
    """What happened, event by event.

    kind : (events,) of run.py: DEPARTURE from stick, REATTACHMENT, or CROSSING from one sign of v_rel to the other
    time : (events,) [-] tau = omega t
    position : (events,) [m] X
    slipped_distance : (events,) [m] s
    backwards : (events,) true at a reattachment before which, since the departure, the mass moved against the belt
        (X' < 0): it ends a cycle; a reattachment without that ends a micro-slip
    duration : [-] tau at the end
    total_slip : [m] s at the end
    local_error : [m] sum of the error estimates of all steps, in X and X'
    steps : steps tried and taken, those that locate events among them
    evaluations : of X'' in these steps
    cuts : steps of slip and starts of stick at which friction would have been negative and was cut to zero
    """

    kind: np.ndarray
    time: np.ndarray
    position: np.ndarray
    slipped_distance: np.ndarray
    backwards: np.ndarray
    duration: float
    total_slip: float
    local_error: float
    steps: int
    evaluations: int = 0
    cuts: int = 0

    @property
    def cycles(self) -> int:
        """Number of reattachments that end a cycle."""
        return int(np.count_nonzero(self.backwards))

    @property
    def micro_slips(self) -> int:
        """Number of reattachments that end a micro-slip."""
        return int(np.count_nonzero(self.kind == REATTACHMENT)) - self.cycles

    @property
    def last_cycle(self) -> float:
        """Natural periods until the last cycle ends, 0 where there is none."""
        return float(np.max(self.time[self.backwards], initial=0.0) / (2.0 * math.pi))

    def reattachments(self, after_periods: float = 0.0) -> np.ndarray:
        """X [m] at the ends of the cycles later than so many natural periods."""
        return self.position[self.backwards & (self.time >= 2.0 * math.pi * after_periods)]


@dataclass(frozen=True)
class Trajectory:
    """A motion and its samples for drawing.

    motion : the events
    time : (samples,) [-] tau
    position : (samples,) [m] X
    velocity : (samples,) [m] X' = dX/dtau
    """

    motion: Motion
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray


def _check(
    periods: float, tolerance: float, start: tuple[float, float], negative_friction: str, integrator: str
) -> None:
    if not (math.isfinite(periods) and periods > 0.0):
        raise ParameterError(f"the duration must be finite and positive, not {periods} natural periods")
    if not TOLERANCES[0] <= tolerance <= TOLERANCES[1]:
        raise ParameterError(f"the tolerance must lie in {TOLERANCES[0]} to {TOLERANCES[1]}, not {tolerance}")
    if not all(map(math.isfinite, start)):
        raise ParameterError(f"the start must be finite, not {', '.join(f'{value} m' for value in start)}")
    for name, word, allowed in (
        ("negative friction", negative_friction, NEGATIVE_FRICTION),
        ("the integrator", integrator, tuple(PAIRS)),
    ):
        if word not in allowed:
            raise ParameterError(f"{name} must be one of {', '.join(allowed)}, not {word!r}")


def simulate(
    oscillator: Oscillator,
    law: FrictionLaw,
    path: FrictionPath,
    spacing_m: float,
    duration_periods: float,
    tolerance: float = 1e-9,
    start_position_m: float = 0.0,
    stochastic_static_limit: bool = True,
    interpolation: str = "cubic",
    friction_follows: str = "slip",
    negative_friction: str = "clip",
    integrator: str = "fehlberg45",
    start_velocity_m: float | None = None,
) -> Motion:
    """The motion from the start on: stick and departure exact, slip by an embedded Runge-Kutta pair.

    oscillator, law : the system and its mean friction mu_D
    path : (nodes,) [-] stochastic part mu_S at the coordinates 0, spacing, 2 spacing, ..., or an iterable of such rows
        one after another, which may be without end and of which a few are kept at a time; None for mu_S = 0
    spacing_m : [m] distance of the nodes, [s] where friction follows time (not used without a path)
    duration_periods : [-] time in natural periods 2 pi / omega
    tolerance : [-] local errors in X and in X' of the steps in a unit of tau, relative to N / c + max(|X|, |X'|); 1e-13
        to 1e-3
    start_position_m : [m] X at tau = 0
    start_velocity_m : [m] X' there; None for V, where the mass sticks if friction holds it
    stochastic_static_limit : the limit of stick is static + mu_S; if False static alone, raised to the friction at
        vanishing speed where that is larger, because stick cannot give way to a slip friction that holds
    interpolation : of mu_S between nodes: cubic is continuous with its slope (Catmull-Rom), linear is not
    friction_follows : what mu_S is a function of: slip, the slipped distance, with which it stands still in stick;
        belt, the travel v0 t of the belt; time. With the last two departure is the first passage on the path
    negative_friction : clip cuts friction below zero and counts it, refuse ends with an error
    integrator : fehlberg45, or dormand_prince853 for smooth motions and small tolerances

    Returns the events with the local error. Raises ParameterError for input out of range, when the mass runs off the
    end of the path and for negative friction that is refused, ConvergenceError at the step limit.

    Method: E. Fehlberg, NASA TR R-315 (1969), or DOP853 of Hairer, Nørsett & Wanner (1993); events by Newton's method
    on re-taken steps.
    """
    none = np.zeros(0)
    return _run(
        oscillator, law, path, spacing_m, duration_periods, tolerance, start_position_m, stochastic_static_limit,
        interpolation, friction_follows, negative_friction, integrator, 1.0, none, none, start_velocity_m,
    )  # fmt: skip


def _run(
    oscillator: Oscillator, law: FrictionLaw, path: FrictionPath, spacing: float, periods: float, tolerance: float,
    start_m: float, stochastic: bool, interpolation: str, follows: str, negative: str, integrator: str,
    interval: float, x_drawn: np.ndarray, u_drawn: np.ndarray, velocity_m: float | None = None,
) -> Motion:  # fmt: skip
    """The motion, with X and X' at the multiples of interval put into what is to be drawn."""
    _check(periods, tolerance, (start_m, 0.0 if velocity_m is None else velocity_m), negative, integrator)
    p = coefficients(oscillator, law, follows)
    feed = PathFeed(path, spacing, interpolation)
    numerics = Numerics(PAIRS[integrator], float(tolerance), negative == "refuse")
    if velocity_m is None or velocity_m == p.V:
        stand, events = begin(float(start_m), feed.path, bool(stochastic), p)
    else:
        stand, events = begin_in_slip(float(start_m), float(velocity_m), feed.path, p)
    status = NODES_OVER
    while status == NODES_OVER:
        step_limit = math.ceil(STEPS_PER_PERIOD * (1.0 + periods)) + 4 * feed.received
        status, stand, events = go_on(
            stand, events, 2.0 * math.pi * periods, feed.path, p, numerics, bool(stochastic), step_limit, interval,
            x_drawn, u_drawn,
        )  # fmt: skip
        if status == NODES_OVER:
            feed.advance(place(stand.y.tau, stand.y.s, p))
    _ended_well(status, stand, periods, f"{feed.length_m:.4g} {'s' if follows == 'time' else 'm'}", feed.length_m)
    return _motion(stand, events, periods, STAGES[numerics.pair])


def _ended_well(status: int, stand: Stand, periods: float, path: str, length: float) -> None:
    """Raise the error of a run that did not come to its end; `path` is the length of the path with its unit."""
    reached = stand.y.tau / (2.0 * math.pi)
    if status == PATH_OVER:
        need = 1.1 * length * periods / reached if reached > 0.0 else math.inf
        raise ParameterError(
            f"the friction path of {path} ends after {reached:.4g} of {periods:.4g} natural periods; give a longer "
            f"one, about {need:.3g} {path[-1]}"
        )
    if status == NEGATIVE:
        raise ParameterError(
            f"friction turns negative after {reached:.4g} of {periods:.4g} natural periods: make it scatter less, or "
            f"let it be cut to zero (negative friction: clip)"
        )
    if status == STEPS_OVER:
        raise ConvergenceError(
            f"the motion reached {reached:.4g} of {periods:.4g} natural periods within the step limit; try a larger "
            f"tolerance or a coarser path; local errors in m",
            residual=stand.error,
            work=stand.steps,
        )


def _motion(stand: Stand, events: Events, periods: float, stages: int) -> Motion:
    rows = events.rows[: events.filled]
    return Motion(
        kind=events.kinds[: events.filled],
        time=rows[:, 0].copy(),
        position=rows[:, 1].copy(),
        slipped_distance=rows[:, 2].copy(),
        backwards=rows[:, 3] > 0.0,
        duration=2.0 * math.pi * periods,
        total_slip=stand.y.s,
        local_error=stand.error,
        steps=stand.steps,
        evaluations=stages * stand.steps,
        cuts=stand.cuts,
    )


def trajectory(
    oscillator: Oscillator,
    law: FrictionLaw,
    path: FrictionPath,
    spacing_m: float,
    duration_periods: float,
    tolerance: float = 1e-9,
    start_position_m: float = 0.0,
    stochastic_static_limit: bool = True,
    interpolation: str = "cubic",
    friction_follows: str = "slip",
    negative_friction: str = "clip",
    integrator: str = "fehlberg45",
    samples_per_period: int = 400,
) -> Trajectory:
    """The same motion as `simulate`, with X and X' at equal times from tau = 0 up to the duration, which is left out.

    Stick lines are exact, slip is quintic between the integrator's steps. Arguments and errors as in `simulate`.
    """
    if samples_per_period < 1:
        raise ParameterError(f"a trajectory needs at least one sample a period, not {samples_per_period}")
    _check(duration_periods, tolerance, (start_position_m, 0.0), negative_friction, integrator)
    interval = 2.0 * math.pi / samples_per_period
    samples = max(math.ceil(duration_periods * samples_per_period - 1e-9), 1)
    x_drawn, u_drawn = np.full(samples, np.nan), np.full(samples, np.nan)
    x_drawn[0], u_drawn[0] = start_position_m, oscillator.V
    motion = _run(
        oscillator, law, path, spacing_m, duration_periods, tolerance, start_position_m, stochastic_static_limit,
        interpolation, friction_follows, negative_friction, integrator, interval, x_drawn, u_drawn,
    )  # fmt: skip
    return Trajectory(motion, interval * np.arange(samples), x_drawn, u_drawn)


@dataclass(frozen=True)
class Counts:
    """What one friction path gives at several damping ratios, and what that took.

    damping_ratios : (dampings,) [-]
    cycles, micro_slips : (dampings,)
    last_cycle : (dampings,) [-] natural periods until the last cycle ends, 0 where there is none
    cuts : (dampings,) of negative friction, as in Motion
    steps, evaluations : in all, as in Motion
    periods : natural periods followed in all
    """

    damping_ratios: np.ndarray
    cycles: np.ndarray
    micro_slips: np.ndarray
    last_cycle: np.ndarray
    cuts: np.ndarray
    steps: int
    evaluations: int
    periods: float


def ensemble_counts(
    oscillator: Oscillator,
    law: FrictionLaw,
    path: FrictionPath,
    spacing_m: float,
    duration_periods: float,
    damping_ratios: Sequence[float] | np.ndarray,
    tolerance: float = 1e-9,
    **options: Any,
) -> Counts:
    """Counts of one realisation of the friction at each damping ratio in place of the oscillator's own.

    damping_ratios : (dampings,) [-] each >= 0; the other arguments and the errors as in `simulate`, but an iterable
        path must begin anew for each
    """
    ratios = np.atleast_1d(np.asarray(damping_ratios, dtype=np.float64))
    motions = [
        simulate(
            replace(oscillator, damping_ratio=float(ratio)), law, path, spacing_m, duration_periods, tolerance,
            **options,
        )
        for ratio in ratios
    ]  # fmt: skip
    return Counts(
        damping_ratios=ratios,
        cycles=np.array([motion.cycles for motion in motions]),
        micro_slips=np.array([motion.micro_slips for motion in motions]),
        last_cycle=np.array([motion.last_cycle for motion in motions]),
        cuts=np.array([motion.cuts for motion in motions]),
        steps=sum(motion.steps for motion in motions),
        evaluations=sum(motion.evaluations for motion in motions),
        periods=duration_periods * ratios.size,
    )
