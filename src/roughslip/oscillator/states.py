"""The two states of a mass on a belt, stick-slip and steady sliding, and runs that last until the state is known.

A slip phase longer than any slip of the stick-slip cycle is steady sliding. Stick-slip is a sequence of shorter slip
phases, at least one with backward motion. It begins with the departure of the first one and ends with the departure of
a long one, or with the last reattachment. All other time belongs to neither state. That is the time before the first
departure, which the spring takes mu N / (k v0) to reach, after the last reattachment, and in sticks between long slips.

The longest slip of a cycle follows from the loop of slip without scatter, from departure back to the largest velocity.
After LOOPS of them the mass has missed the belt at least twice.
"""

from __future__ import annotations

import math

import numpy as np

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.event_loop import DEPARTURE, REATTACHMENT
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.limits import departure_point, equilibrium, slip_loop
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.motion import FrictionPath, Motion, simulate
from roughslip.results import described, result
from roughslip.validation import gate

LOOPS = 3.0
EXTENSIONS = 50  # of a run that ends in stick; they grow, so that the last one is never reached
NATURAL_PERIODS, CYCLES, DECAYS, CORRELATIONS = 40.0, 10.0, 4.0, 1.0  # that a run lasts


@result
class States:
    """When a motion is in which state, in natural periods."""

    stick_slip: np.ndarray = described("beginning and end of each time in stick-slip", "1", "times ends")
    sliding: np.ndarray = described("beginning and end of each time in steady sliding", "1", "times ends")
    stick_slip_ended: np.ndarray = described("false where the run was over before the end of stick-slip", "1", "times")
    sliding_ended: np.ndarray = described("false where the run was over before the end of sliding", "1", "times")

    @gate
    def share(self, begin: float = 0.0, end: float = math.inf) -> float:
        """Share of stick-slip in the time between two natural periods that belongs to a state; NaN where none does."""
        stuck, slid = (
            float(np.sum(np.diff(np.clip(times, begin, end)), dtype=np.float64))
            for times in (self.stick_slip, self.sliding)
        )
        return stuck / (stuck + slid) if stuck + slid > 0.0 else math.nan

    @gate
    def is_stick_slip(self, periods: float) -> bool:
        """Whether a time [natural periods] lies in stick-slip; of random times of a state, the mean is `share`."""
        return bool(np.any((self.stick_slip[:, 0] <= periods) & (periods < self.stick_slip[:, 1])))


def slip_phases(motion: Motion) -> tuple[np.ndarray, bool]:
    """(slips, 2) [natural periods] beginning and end of each slip phase, and whether the run's end cut off the last."""
    departures = motion.time[motion.kind == DEPARTURE]
    reattachments = motion.time[motion.kind == REATTACHMENT]
    cut_off = departures.size > reattachments.size
    ends = np.append(reattachments, motion.duration) if cut_off else reattachments
    return np.stack([departures, ends], axis=1) / (2.0 * math.pi), cut_off


@gate
def states_of(motion: Motion, longest_slip: float) -> States:
    """The times in both states in a motion.

    longest_slip : [natural periods] of a cycle, as the function of that name gives it
    """
    slips, cut_off = slip_phases(motion)
    is_long = slips[:, 1] - slips[:, 0] > longest_slip
    backwards = np.append(motion.backwards[motion.kind == REATTACHMENT], [False] * cut_off)
    times, ended = [], []
    first = 0
    for i in [*np.flatnonzero(is_long), len(slips)]:
        short = slice(first, i - (i == len(slips) and cut_off and not is_long[-1]))
        if np.any(backwards[short]):
            over = i < len(slips)
            times.append((slips[first, 0], slips[i, 0] if over else slips[short][-1, 1]))
            ended.append(over)
        first = i + 1
    return States(
        stick_slip=np.reshape(times, (-1, 2)),
        sliding=slips[is_long],
        stick_slip_ended=np.array(ended, dtype=bool),
        sliding_ended=~(np.arange(len(slips)) == (len(slips) - 1 if cut_off else -1))[is_long],
    )


@gate
def longest_slip(oscillator: Oscillator, law: FrictionLaw) -> float:
    """Natural periods that a slip of the stick-slip cycle does not exceed, for any scatter of friction.

    Raises as `slip_loop` does.
    """
    return LOOPS * max(slip_loop(oscillator, law).periods, 1.0)


@gate
def run_until_known(
    machine: Machine, path: FrictionPath, spacing_m: float, periods: float, from_sliding: bool = False
) -> tuple[Motion, float, States]:
    """A motion of so many natural periods after its first departure, and longer until the state at their end is known.

    path : must start again each time it is read
    from_sliding : whether the mass begins in steady sliding, not at rest on the belt with a relaxed spring

    Returns the motion, the natural period of the first departure, and the states. The run is extended where it ends in
    stick: by the time to the next departure and the longest slip of a cycle. Stick has a closed form, so a slow
    belt costs nothing. Raises as `simulate` and `slip_loop` do, ConvergenceError where the mass does not depart.
    """
    oscillator, law = machine.oscillator, machine.law
    longest = longest_slip(oscillator, law)
    start: float | tuple[float, float] = (equilibrium(oscillator, law), 0.0) if from_sliding else 0.0
    turn = 2.0 * math.pi

    def run(duration: float) -> Motion:
        return simulate(oscillator, law, path, spacing_m, duration, machine.options, start)

    def until_departure(position: float) -> float:
        """Natural periods of stick from X = position on, without scatter."""
        return max(departure_point(oscillator, law) - position, 0.0) / oscillator.V / turn

    duration = periods + longest + (0.0 if from_sliding else until_departure(0.0) + 1.0)
    for extension in range(EXTENSIONS):
        motion = run(duration)
        slips, cut_off = slip_phases(motion)
        if slips.size:
            end = (first := 0.0 if from_sliding else float(slips[0, 0])) + periods
            if np.any(slips[: len(slips) - cut_off, 1] > end) or (cut_off and np.diff(slips[-1])[0] > longest):
                return motion, first, states_of(motion, longest)
            stick = 0.0 if cut_off else until_departure(float(motion.position[-1])) - (duration - slips[-1, 1])
            duration = max(duration, end) + max(stick, 0.0) + 2.0**extension + longest
        else:
            duration *= 1.5
    lacking = f"whether the mass sticks or slides after {end:.3g}" if slips.size else "when the mass leaves the belt"
    raise ConvergenceError(
        f"{motion.duration / turn:.3g} natural periods do not show {lacking}: raise the belt velocity of "
        f"{oscillator.belt_velocity_m_per_s:.3g} m/s; scene key: oscillator.belt_velocity_m_per_s",
        residual=1.0,
        work=EXTENSIONS,
    )


def time_scales(machine: Machine) -> dict[str, float]:
    """Natural periods that a run has to last by each of its time scales, after its first departure.

    Raises ParameterError for a belt at rest, and as `slip_loop` does.
    """
    oscillator, law = machine.oscillator, machine.law
    if not oscillator.V > 0.0:
        raise ParameterError(
            "a belt at rest has no time scale of stick-slip: give it a velocity; scene key: "
            "oscillator.belt_velocity_m_per_s"
        )
    turn, loop = 2.0 * math.pi, slip_loop(oscillator, law)
    decay = math.inf if oscillator.damping_ratio == 0.0 else 1.0 / (turn * oscillator.damping_ratio)
    scales = {
        "natural periods": NATURAL_PERIODS,
        "decays of a free vibration": DECAYS * decay,
        "slips of the cycle": CYCLES * loop.periods,
        "correlation lengths of friction": CORRELATIONS
        * machine.scattering.correlation_length_m
        / (turn * oscillator.V),
    }
    if loop.cycle is not None:
        scales["cycles"] = CYCLES * loop.cycle.period / turn
    return scales
