"""States of a mass on a belt, stick-slip and slip without sticking, and runs that last until the state is known.

A slip phase longer than any slip of the stick-slip cycle is sliding, steady or a vibration (`vibration`). Stick-slip is
a sequence of shorter slip phases, at least one with backward motion. It begins with the departure of the first one and
ends with the departure of a long one, or with the last reattachment. All other time belongs to neither state. That is
the time before the first departure, which the spring takes mu N / (k v0) to reach, after the last reattachment, and in
sticks between long slips.

The longest slip of a cycle follows from the loop of slip without scatter, from departure back to the largest velocity.
After LOOPS of them the mass has missed the belt at least twice.

Stick-slip ends in steady sliding, at the rate `death`. Sliding ends in stick, and stick-slip begins there or the mass
slides again; stick-slip is born at the rate `birth` in the time of sliding. So in the long run

    share of stick-slip = birth / (birth + death)

of the time in either state, whichever state the runs begin in. Sliding that has just begun may end far sooner than old
sliding, and the end of a run cuts states off: see `ages`. `rates` has the theory.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.oscillator.ages import Ages, Draws, mean_of_ages
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.event_loop import DEPARTURE, REATTACHMENT
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.limits import departure_point, growth_of_sliding, slip_loop
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.motion import FrictionPath, Motion, followed
from roughslip.oscillator.path import PathFeed
from roughslip.oscillator.slip_orbit import equilibrium
from roughslip.probability.estimate import TAILS
from roughslip.results import described, result
from roughslip.validation import gate

LOOPS = 3.0
ROUNDED = 1.0 + 1e-9  # factor of a time that has to be passed
EXTENSIONS = 50  # of a run that ends in stick; they grow, so that the last one is never reached
NATURAL_PERIODS, CYCLES, DECAYS, GROWTHS, CORRELATIONS = 40.0, 10.0, 4.0, 20.0, 1.0  # that a run lasts
ONE_RATE, SETTLED = (0.0, 0.0), (NATURAL_PERIODS, NATURAL_PERIODS)  # ages from which the rate of ends is constant
_never = partial(np.empty, (0, 2))


@result
class States:
    """When a motion is in which state, in natural periods."""

    stick_slip: np.ndarray = described("beginning and end of each time in stick-slip", "1", "times ends")
    sliding: np.ndarray = described("beginning and end of each slip without sticking", "1", "times ends")
    stick_slip_ended: np.ndarray = described("false where the run was over before the end of stick-slip", "1", "times")
    sliding_ended: np.ndarray = described("false where the run was over before the end of sliding", "1", "times")
    vibration: np.ndarray = described("beginning and end of each vibration", "1", "times ends", default_factory=_never)

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
        return is_within(self.stick_slip, periods)


def is_within(times: np.ndarray, periods: float) -> bool:
    """Whether a time lies in one of the times : (times, 2) from beginning to end."""
    return bool(np.any((times[:, 0] <= periods) & (periods < times[:, 1])))


def _parts_of_slip(run: States) -> tuple[np.ndarray, np.ndarray]:
    """The spells of steady sliding and of vibration."""
    rows: tuple[list[tuple[float, float, bool, bool]], ...] = ([], [])
    for (begin, end), ended in zip(run.sliding, run.sliding_ended, strict=True):
        inside = run.vibration[(begin <= run.vibration[:, 0]) & (run.vibration[:, 0] < end)]
        for place, (first, last) in enumerate(pairwise([begin, *inside.ravel(), end])):
            if last > first:
                rows[place % 2].append((first, last - first, ended if last == end else True, False))
    return np.reshape(rows[0], (-1, 4)), np.reshape(rows[1], (-1, 4))


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

    Returns the motion, the natural period of the first departure, and the states. The run ends as soon as no later
    motion changes the state at their end: with a cycle after it, or a slip longer than any of a cycle. Where it ends in
    stick, it is extended by the time to the next departure and the longest slip of a cycle. Stick has a closed form, so
    a slow belt costs nothing. Raises as `simulate` and `slip_loop` do, ConvergenceError where the mass does not depart.
    """
    oscillator, law = machine.oscillator, machine.law
    longest = longest_slip(oscillator, law)
    start: float | tuple[float, float] = (equilibrium(oscillator, law), 0.0) if from_sliding else 0.0
    turn, until = 2.0 * math.pi, (periods * ROUNDED, longest * ROUNDED)

    def until_departure(position: float) -> float:
        """Natural periods of stick from X = position on, without scatter."""
        return max(departure_point(oscillator, law) - position, 0.0) / oscillator.V / turn

    duration = periods + longest + (0.0 if from_sliding else until_departure(0.0) + 1.0)
    for extension in range(EXTENSIONS):
        feed = PathFeed(path, spacing_m)
        motion = followed(oscillator, law, feed, duration, machine.options, start, until=until)
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
        f"{oscillator.belt_velocity_m_per_s:.3g} m/s",
        scene_keys="oscillator.belt_velocity_m_per_s",
        residual=1.0,
        work=EXTENSIONS,
    )


def time_scales(machine: Machine) -> dict[str, float]:
    """Natural periods that a run has to last by each of its time scales, after its first departure.

    About unstable sliding X' grows as `growth_of_sliding` says, up to exp(GROWTHS). Raises ParameterError for a belt at
    rest, and as `slip_loop` does.
    """
    oscillator, law = machine.oscillator, machine.law
    if not oscillator.V > 0.0:
        raise ParameterError(
            "a belt at rest has no time scale of stick-slip: give it a velocity",
            scene_keys="oscillator.belt_velocity_m_per_s",
        )
    turn, loop = 2.0 * math.pi, slip_loop(oscillator, law)
    length = machine.scattering.correlation_length_m / (turn * oscillator.V)
    decay = math.inf if oscillator.damping_ratio == 0.0 else 1.0 / (turn * oscillator.damping_ratio)
    scales = {
        "natural periods": NATURAL_PERIODS,
        "decays of a free vibration": DECAYS * decay,
        "slips of the cycle": CYCLES * loop.periods,
        "correlation lengths of friction": CORRELATIONS * length,
    }
    if loop.cycle is not None:
        scales["cycles"] = CYCLES * loop.cycle.period / turn
    growth = turn * growth_of_sliding(oscillator, law)
    if growth > 0.0:
        scales["growth from steady sliding"] = GROWTHS / growth
    return scales


def settling_ages(machine: Machine) -> Ages:
    """Natural periods after which sliding has settled and ends at one rate: after stick-slip, and of runs in sliding.

    Slip is sliding after the longest slip of a cycle. Until it has settled its vibration decays, or grows, by
    exp(DECAYS), and friction passes its correlation length. Runs in sliding begin where the mean friction pushes; the
    longer friction is correlated, the more they vibrate.
    """
    oscillator, turn = machine.oscillator, 2.0 * math.pi
    longest, rate = longest_slip(oscillator, machine.law), turn * abs(growth_of_sliding(oscillator, machine.law))
    length = machine.scattering.correlation_length_m / (turn * oscillator.V)
    settled = longest + max(DECAYS / rate if rate > 0.0 else math.inf, CORRELATIONS * length)
    return settled, min(settled, longest + DECAYS * length)


@dataclass(frozen=True)
class Durations:
    """How long the states last and how often they end, each (value, low, high); by theory without interval.

    stick_slip, sliding, vibration : (3,) [natural periods] mean duration, that of sliding without vibration; infinite
        where none ends
    birth : (3,) [1 / natural period] rate at which stick-slip begins in the time of slip without sticking
    share : (3,) [-] of the time in any state that is stick-slip, in the long run
    """

    stick_slip: np.ndarray
    sliding: np.ndarray
    birth: np.ndarray
    share: np.ndarray
    vibration: np.ndarray = field(default_factory=lambda: np.full(3, math.nan))

    @property
    def death(self) -> np.ndarray:
        """Rate (value, low, high) [1 / natural period] at which stick-slip ends."""
        return 1.0 / self.stick_slip[[0, 2, 1]]


@gate
def durations(runs: Sequence[States], generator: np.random.Generator, settled: Ages = SETTLED) -> Durations:
    """Durations and rates of the states in long runs, with 95 % intervals.

    settled : natural periods after which sliding ends at one rate, as `settling_ages` gives them

    Stick-slip and vibration end at one rate. The mean of a state that no run shows is NaN; that of one that outlives
    the runs has a lower bound alone, value and upper end being infinite. Method: `ages`.
    """
    stuck = np.concatenate([_spells(run.stick_slip, run.stick_slip_ended) for run in runs])
    slid = np.concatenate([_spells(run.sliding, run.sliding_ended, _births(run)) for run in runs])
    steady, vibrating = (np.concatenate(part) for part in zip(*map(_parts_of_slip, runs), strict=True))
    of = ((stuck, ONE_RATE), (steady, settled), (slid, settled), (vibrating, ONE_RATE))
    (stick_slip, _), (sliding, _), (_, birth), (vibration, _) = (mean_of_ages(*pair, generator) for pair in of)
    share = stationary_share(stick_slip, birth)
    return Durations(_limits(*stick_slip), _limits(*sliding), _limits(*birth), share, _limits(*vibration))


def _spells(times: np.ndarray, ended: np.ndarray, born: np.ndarray | float = 0.0) -> np.ndarray:
    """(times, 4) beginning, duration, whether it ended in the run, and whether by a birth."""
    return np.stack([times[:, 0], np.diff(times)[:, 0], ended, np.broadcast_to(born, ended.shape)], axis=1)


def _limits(value: float, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(3,) value, low and high, as wide as the value where few spells leave it outside."""
    ends = (np.quantile(draws, tail, method="inverted_cdf") for draws, tail in zip((low, high), TAILS, strict=True))
    low_end, high_end = map(float, ends)
    return np.array([value, min(low_end, value), max(high_end, value)])


def _births(run: States) -> np.ndarray:
    """(times in sliding,) whether the next state after each one is stick-slip."""
    following, begun = np.append(run.sliding[1:, 0], math.inf), run.stick_slip[:, 0]
    return np.searchsorted(begun, run.sliding[:, 1]) < np.searchsorted(begun, following)


def stationary_share(stick_slip: Draws, birth: Draws) -> np.ndarray:
    """(value, low, high) [-] of birth / (birth + death), NaN where both are 0 or one that counts is unknown."""
    (mean, shortest, longest), (rate, rarest, most) = stick_slip, birth
    odds, is_ever = float(rate) * float(mean), math.isinf(mean)
    value = odds / (1.0 + odds) if is_ever == (rate == 0.0) else float(is_ever)
    return _limits(value, rarest / (rarest + 1.0 / shortest), most / (most + 1.0 / longest))


def states_of_answer(measured: Durations, theory: Durations | None, omega: float) -> dict[str, Any]:
    """Time in each state and rates, for answer.json: [value, low, high], null where unknown, by runs and by theory.

    omega : [rad/s] natural frequency, which makes seconds of natural periods
    """
    period = 2.0 * math.pi / omega

    def rows(found: Durations) -> dict[str, list[float | None]]:
        parts = {
            "share_of_time": found.share,
            "mean_stick_slip_s": period * found.stick_slip,
            "mean_sliding_s": period * found.sliding,
            "mean_vibration_s": period * found.vibration,
            "death_per_s": found.death / period,
            "birth_per_s": found.birth / period,
        }
        return {name: [float(x) if math.isfinite(x) else None for x in values] for name, values in parts.items()}

    by_theory = None if theory is None else {name: value for name, (value, _, _) in rows(theory).items()}
    return rows(measured) | {"by_theory": by_theory}
