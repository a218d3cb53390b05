"""Motion of the mass on its friction path: the events, and the counts of cycles."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.oscillator.law import StribeckLaw
from roughslip.oscillator.path import PathFeed
from roughslip.oscillator.run import REATTACHMENT, begin, begin_in_slip, go_on
from roughslip.oscillator.slip import NODES_OVER, PATH_OVER, STEPS_OVER
from roughslip.oscillator.system import Oscillator, coefficients

FrictionPath = np.ndarray | Iterable[np.ndarray] | None
STEPS_PER_PERIOD = 20_000  # and four a node of the path: far above any need, so that a run ends
TOLERANCES = (1e-13, 1e-3)


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
    steps : steps tried
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

    @property
    def cycles(self) -> int:
        """Number of reattachments that end a cycle."""
        return int(np.count_nonzero(self.backwards))

    @property
    def micro_slips(self) -> int:
        """Number of reattachments that end a micro-slip."""
        return int(np.count_nonzero(self.kind == REATTACHMENT)) - self.cycles

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


def _check(periods: float, tolerance: float, *start_m: float) -> None:
    if not (math.isfinite(periods) and periods > 0.0):
        raise ParameterError(f"the duration must be finite and positive, not {periods} natural periods")
    if not TOLERANCES[0] <= tolerance <= TOLERANCES[1]:
        raise ParameterError(f"the tolerance must lie in {TOLERANCES[0]} to {TOLERANCES[1]}, not {tolerance}")
    if not all(map(math.isfinite, start_m)):
        raise ParameterError(f"the start must be finite, not {', '.join(f'{value} m' for value in start_m)}")


def _simulate(
    oscillator: Oscillator, law: StribeckLaw, path: FrictionPath, spacing_m: float, periods: float, tolerance: float,
    start_m: float, stochastic: bool, interpolation: str, interval: float, x_drawn: np.ndarray, u_drawn: np.ndarray,
    velocity_m: float | None = None,
) -> Motion:  # fmt: skip
    _check(periods, tolerance, start_m, 0.0 if velocity_m is None else velocity_m)
    feed = PathFeed(path, spacing_m, interpolation)
    p = coefficients(oscillator, law)
    if velocity_m is None or velocity_m == p.V:
        stand, events = begin(float(start_m), feed.path, bool(stochastic), p)
    else:
        stand, events = begin_in_slip(float(start_m), float(velocity_m), feed.path, p)
    status = NODES_OVER
    while status == NODES_OVER:
        step_limit = math.ceil(STEPS_PER_PERIOD * (1.0 + periods)) + 4 * feed.received
        status, stand, events = go_on(
            stand, events, 2.0 * math.pi * periods, feed.path, p, float(tolerance), bool(stochastic), step_limit,
            interval, x_drawn, u_drawn,
        )  # fmt: skip
        if status == NODES_OVER:
            feed.advance(stand.y.s)
    s = stand.y.s
    reached = stand.y.tau / (2.0 * math.pi)
    if status == PATH_OVER:
        need = s * periods / reached if reached > 0.0 else math.inf
        raise ParameterError(
            f"the friction path of {feed.length_m:.4g} m ends after {reached:.4g} of {periods:.4g} "
            f"natural periods; give a longer one, about {1.1 * need:.3g} m"
        )
    if status == STEPS_OVER:
        raise ConvergenceError(
            f"the motion reached {reached:.4g} of {periods:.4g} natural periods within the step limit; try a larger "
            f"tolerance or a coarser path; local errors in m",
            residual=stand.error,
            work=stand.steps,
        )
    rows = events.rows[: events.filled]
    return Motion(
        kind=events.kinds[: events.filled],
        time=rows[:, 0].copy(),
        position=rows[:, 1].copy(),
        slipped_distance=rows[:, 2].copy(),
        backwards=rows[:, 3] > 0.0,
        duration=2.0 * math.pi * periods,
        total_slip=s,
        local_error=stand.error,
        steps=stand.steps,
    )


def simulate(
    oscillator: Oscillator,
    law: StribeckLaw,
    path: FrictionPath,
    spacing_m: float,
    duration_periods: float,
    tolerance: float = 1e-9,
    start_position_m: float = 0.0,
    stochastic_static_limit: bool = True,
    interpolation: str = "cubic",
    start_velocity_m: float | None = None,
) -> Motion:
    """The motion from the start on: stick and departure exact, slip by Runge-Kutta-Fehlberg 4(5).

    oscillator, law : the system and its mean friction mu_D
    path : (nodes,) [-] stochastic part mu_S at the slipped distances 0, spacing, 2 spacing, ..., or an iterable of such
        rows one after another, which may be without end and of which a few are kept at a time; None for mu_S = 0
    spacing_m : [m] distance of the nodes (not used without a path)
    duration_periods : [-] time in natural periods 2 pi / omega
    tolerance : [-] local error of a step in X and in X', relative to N / c + max(|X|, |X'|); 1e-13 to 1e-3
    start_position_m : [m] X at tau = 0
    start_velocity_m : [m] X' there; None for V, where the mass sticks if friction holds it
    stochastic_static_limit : the limit of stick is static + mu_S(s); if False static alone, raised to static + mu_S(s)
        where that is larger, because stick cannot give way to a slip friction that holds
    interpolation : of mu_S between nodes: cubic is continuous with its slope (Catmull-Rom), linear is not

    mu_S stands still in stick, as s does. Friction below zero is cut.

    Returns the events with the local error. Raises ParameterError for input out of range and when the mass runs off
    the end of the path, ConvergenceError at the step limit.

    Method: E. Fehlberg, NASA TR R-315 (1969); events by Newton's method on re-taken steps.
    """
    none = np.zeros(0)
    return _simulate(
        oscillator, law, path, spacing_m, duration_periods, tolerance, start_position_m, stochastic_static_limit,
        interpolation, 1.0, none, none, start_velocity_m,
    )  # fmt: skip


def trajectory(
    oscillator: Oscillator,
    law: StribeckLaw,
    path: FrictionPath,
    spacing_m: float,
    duration_periods: float,
    tolerance: float = 1e-9,
    start_position_m: float = 0.0,
    stochastic_static_limit: bool = True,
    interpolation: str = "cubic",
    samples_per_period: int = 400,
) -> Trajectory:
    """The same motion as `simulate`, with X and X' at equal times from tau = 0 up to the duration, which is left out.

    Stick lines are exact, slip is cubic between the integrator's steps. Arguments and errors as in `simulate`.
    """
    if samples_per_period < 1:
        raise ParameterError(f"a trajectory needs at least one sample a period, not {samples_per_period}")
    _check(duration_periods, tolerance, start_position_m)
    interval = 2.0 * math.pi / samples_per_period
    samples = max(math.ceil(duration_periods * samples_per_period - 1e-9), 1)
    x_drawn, u_drawn = np.full(samples, np.nan), np.full(samples, np.nan)
    x_drawn[0], u_drawn[0] = start_position_m, oscillator.V
    motion = _simulate(
        oscillator, law, path, spacing_m, duration_periods, tolerance, start_position_m, stochastic_static_limit,
        interpolation, interval, x_drawn, u_drawn,
    )  # fmt: skip
    return Trajectory(motion, interval * np.arange(samples), x_drawn, u_drawn)


@dataclass(frozen=True)
class Counts:
    """Cycles and micro-slips of one friction path at several damping ratios.

    damping_ratios : (dampings,) [-]
    cycles, micro_slips : (dampings,)
    """

    damping_ratios: np.ndarray
    cycles: np.ndarray
    micro_slips: np.ndarray


def ensemble_counts(
    oscillator: Oscillator,
    law: StribeckLaw,
    path: FrictionPath,
    spacing_m: float,
    duration_periods: float,
    damping_ratios: Sequence[float] | np.ndarray,
    tolerance: float = 1e-9,
    start_position_m: float = 0.0,
    stochastic_static_limit: bool = True,
    interpolation: str = "cubic",
) -> Counts:
    """Counts of one realisation of the friction at each damping ratio in place of the oscillator's own.

    damping_ratios : (dampings,) [-] each >= 0; the other arguments and the errors as in `simulate`, but an iterable
        path must begin anew for each
    """
    ratios = np.atleast_1d(np.asarray(damping_ratios, dtype=np.float64))
    motions = [
        simulate(
            replace(oscillator, damping_ratio=float(ratio)), law, path, spacing_m, duration_periods, tolerance,
            start_position_m, stochastic_static_limit, interpolation,
        )
        for ratio in ratios
    ]  # fmt: skip
    return Counts(ratios, np.array([m.cycles for m in motions]), np.array([m.micro_slips for m in motions]))
