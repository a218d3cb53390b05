"""Motion of the mass on its friction path: the events, and the counts of cycles."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.oscillator.equation import SCATTERS, Oscillator, coefficients
from roughslip.oscillator.event_loop import REATTACHMENT, RunState, continue_run, start
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.memory_law import MemoryLaw
from roughslip.oscillator.memory_motion import continue_with_memory, start_with_memory
from roughslip.oscillator.path import PathFeed
from roughslip.oscillator.slip import SHORTEST_SLIP, Horizon, Samples, Status
from roughslip.results import described, result
from roughslip.validation import gate, not_negative, positive

FrictionPath = np.ndarray | Iterable[np.ndarray] | None
STEPS_PER_PERIOD = 20_000  # and four a node of the path: far above any need, a limit that ends every run
MOST_STEPS = 1e18  # a machine integer
TOLERANCES = (1e-13, 1e-3)
COARSER = "try a larger tolerance, friction that changes over more speeds or slip, or a coarser path; local errors in m"


@result
class Motion:
    """The events of a motion."""

    kind: np.ndarray = described(
        "DEPARTURE from stick, REATTACHMENT, or CROSSING between the signs of v_rel, as in event_loop.py", "1", "events"
    )
    time: np.ndarray = described("time tau = omega t", "1", "events")
    position: np.ndarray = described("position X", "m", "events")
    slipped_distance: np.ndarray = described("slipped distance s", "m", "events")
    backwards: np.ndarray = described(
        "true at a reattachment before which, since the departure, the mass moved against the belt (X' "
        "< 0): it ends a cycle; a reattachment without that ends a micro-slip",
        "1",
        "events",
    )
    duration: float = described("time tau at the end")
    local_error: float = described("sum of the error estimates of all steps, in X and X'", "m")
    steps: int = described("number of steps, with the rejected ones and those that locate events")
    cuts: int = described(
        "steps of slip and starts of stick at which friction would have been negative and was cut to zero", default=0
    )

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

    @gate
    def reattachments(self, after_periods: float = 0.0) -> np.ndarray:
        """X [m] at the ends of the cycles later than so many natural periods."""
        return self.position[self.backwards & (self.time >= 2.0 * math.pi * after_periods)]


@result
class Trajectory:
    """A motion and its samples for drawing."""

    motion: Motion = described("the events")
    time: np.ndarray = described("time tau = omega t", "1", "time")
    position: np.ndarray = described("position X", "m", "time")
    velocity: np.ndarray = described("velocity X' = dX/dtau", "m", "time")


@gate
@dataclass(frozen=True)
class MotionOptions:
    """How a motion treats friction, and how it is integrated.

    tolerance : [-] local errors in X and in X' of the steps in a unit of tau, relative to N / c + max(|X|, |X'|); 1e-13
        to 1e-3
    samples_per_period : of a trajectory, at least 1 in a natural period
    scatter : additive, mu = mu_D + mu_S; or multiplicative, mu = mu_D (1 + mu_S), and so is the limit of stick

    Raises ParameterError for a number out of range or an unknown word.
    """

    tolerance: float = 1e-9
    samples_per_period: int = 400
    scatter: str = "additive"

    def __post_init__(self) -> None:
        if not TOLERANCES[0] <= self.tolerance <= TOLERANCES[1]:
            raise ParameterError(f"the tolerance must lie in {TOLERANCES[0]} to {TOLERANCES[1]}, not {self.tolerance}")
        if self.samples_per_period < 1:
            raise ParameterError(f"a trajectory needs at least one sample a period, not {self.samples_per_period}")
        if self.scatter not in SCATTERS:
            raise ParameterError(f"scatter must be one of {', '.join(SCATTERS)}, not {self.scatter!r}")


DEFAULTS = MotionOptions()
NO_SAMPLES = Samples(1.0, np.zeros(0), np.zeros(0))


@gate
def simulate(
    oscillator: Oscillator, law: FrictionLaw, path: FrictionPath = None, spacing_m: float = math.nan,
    duration_periods: float = 100.0, options: MotionOptions = DEFAULTS, start_m: float | tuple[float, float] = 0.0,
    age_s: float | None = None,
) -> Motion:  # fmt: skip
    """The motion from the start on: stick and departure exact, slip by an embedded Runge-Kutta pair.

    oscillator, law : the system and its mean friction mu_D
    path : (nodes,) [-] stochastic part mu_S at multiples of spacing of the slipped distance, from 0 on; or an iterable
        of such rows, which may have no end, such as `itertools.repeat(row)`. None for mu_S = 0
    spacing_m : [m] distance of the nodes; needed for a path
    duration_periods : [-] time in natural periods 2 pi / omega
    start_m : [m] X at tau = 0 of a mass that moves with the belt, where it sticks if friction holds it; or X and X',
        the velocity over omega
    age_s : [s] of the contacts at tau = 0, with a memory; None for fresh ones on the belt, else of steady sliding

    Returns the events with the local error. Raises ParameterError for input out of range and for a path that is too
    short, ConvergenceError at the step limit.

    Method: E. Fehlberg, NASA TR R-315 (1969); events by Newton's method on repeated steps.
    """
    return followed(oscillator, law, PathFeed(path, spacing_m), duration_periods, options, start_m, age_s)


def followed(
    oscillator: Oscillator, law: FrictionLaw, feed: PathFeed, duration_periods: float, options: MotionOptions,
    start_m: float | tuple[float, float], age_s: float | None = None, samples: Samples = NO_SAMPLES,
    until: tuple[float, float] = (math.inf, math.inf),
) -> Motion:  # fmt: skip
    """The motion of `simulate`. samples : that receive X and X'; until : last two of `Horizon` [natural periods]"""
    positive("duration_periods", duration_periods, "natural periods")
    p = coefficients(oscillator, law, options.scatter)
    x, u = start_m if isinstance(start_m, tuple) else (start_m, p.V)
    if not (math.isfinite(x) and math.isfinite(u)):
        raise ParameterError(f"start_m must be finite, not {x} m, {u} m")
    x, u, age = float(x), float(u), math.nan if age_s is None else not_negative("age_s", age_s)
    if isinstance(law, MemoryLaw):
        if p.excited:
            raise ParameterError("a law with memory takes no excitation", "oscillator.excitation_force_n")
        (run, events), goes_on = start_with_memory(x, u, age, feed.path, p), continue_with_memory
    elif age_s is not None:
        raise ParameterError("age_s is for a law with memory: contacts have no age without one")
    else:
        (run, events), goes_on = start(x, u, feed.path, p), continue_run
    status = Status.NODES_OVER
    end, after, longest = (2.0 * math.pi * periods for periods in (duration_periods, *until))
    while status == Status.NODES_OVER:
        step_limit = int(min(STEPS_PER_PERIOD * (1.0 + duration_periods), MOST_STEPS)) + 4 * feed.received
        horizon = Horizon(end, step_limit, after, longest)
        status, run, events = goes_on(run, events, feed.path, p, float(options.tolerance), horizon, samples)
        if status == Status.NODES_OVER:
            feed.advance(run.y.s)
    _check_end(status, run, duration_periods, feed.length_m)
    rows = events.rows[: events.filled]
    return Motion(
        kind=events.kinds[: events.filled],
        time=rows[:, 0].copy(),
        position=rows[:, 1].copy(),
        slipped_distance=rows[:, 2].copy(),
        backwards=rows[:, 3] > 0.0,
        duration=run.y.tau if end - run.y.tau > SHORTEST_SLIP else end,
        local_error=run.error,
        steps=run.steps,
        cuts=run.cuts,
    )


def _check_end(status: Status, run: RunState, periods: float, length: float) -> None:
    """Raise the error of a run that did not come to its end. length : of the path [m]"""
    reached = run.y.tau / (2.0 * math.pi)
    if status == Status.PATH_OVER:
        need = f", about {1.1 * length * periods / reached:.3g} m" if reached > 0.0 else ""
        raise ParameterError(
            f"the friction path of {length:.4g} m ends after {reached:.4g} of {periods:.4g} natural periods: give a "
            f"longer one{need}, or a shorter motion",
            scene_keys="ensemble.duration_periods",
        )
    if status in (Status.STEPS_OVER, Status.STEP_LOST):
        reason = "within the step limit" if status == Status.STEPS_OVER else "and needs a step too short to change time"
        raise ConvergenceError(
            f"the motion reached {reached:.4g} of {periods:.4g} natural periods {reason}; {COARSER}",
            residual=run.error,
            work=run.steps,
            scene_keys="ensemble.nodes_per_correlation_length",
        )


@gate
def trajectory(
    oscillator: Oscillator, law: FrictionLaw, path: FrictionPath = None, spacing_m: float = math.nan,
    duration_periods: float = 100.0, options: MotionOptions = DEFAULTS, start_m: float | tuple[float, float] = 0.0,
    age_s: float | None = None,
) -> Trajectory:  # fmt: skip
    """The same motion as `simulate`, with X and X' at equal times from tau = 0 up to the duration, which is left out.

    Stick lines are exact, and samples of slip are as accurate as the steps. Arguments and errors as in `simulate`.
    """
    finite = math.isfinite(duration_periods) and duration_periods > 0.0  # else an error of the motion
    size = max(math.ceil(duration_periods * options.samples_per_period - 1e-9), 1) if finite else 1
    samples = Samples(2.0 * math.pi / options.samples_per_period, np.full(size, np.nan), np.full(size, np.nan))
    samples.x[0], samples.u[0] = start_m if isinstance(start_m, tuple) else (start_m, oscillator.V)
    motion = followed(oscillator, law, PathFeed(path, spacing_m), duration_periods, options, start_m, age_s, samples)
    return Trajectory(motion, samples.interval * np.arange(size), samples.x, samples.u)
