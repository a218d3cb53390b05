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

of the time in either state, whichever state the runs begin in. The friction path loses its correlation within a cycle,
and all cycles begin at the departure point. So durations of stick-slip are close to exponential; the end of a run
censors them. Sliding that has just begun may end far sooner than old sliding. Means suppose one rate of its ends, so
runs shorter than old sliding find too short a mean. `rates` has the theory.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.special import chdtri

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.event_loop import DEPARTURE, REATTACHMENT
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.limits import departure_point, growth_of_sliding, slip_loop
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.motion import FrictionPath, Motion, followed
from roughslip.oscillator.path import PathFeed
from roughslip.oscillator.slip_orbit import equilibrium
from roughslip.probability.estimate import TAILS, interval_margin
from roughslip.results import described, result
from roughslip.validation import gate

LOOPS = 3.0
ROUNDED = 1.0 + 1e-9  # factor of a time that has to be passed
EXTENSIONS = 50  # of a run that ends in stick; they grow, so that the last one is never reached
NATURAL_PERIODS, CYCLES, DECAYS, GROWTHS, CORRELATIONS = 40.0, 10.0, 4.0, 20.0, 1.0  # that a run lasts
STATES = ("stick_slip", "sliding")
REPLICATES, FEWEST_ENDS = 400, 8


@result
class States:
    """When a motion is in which state, in natural periods."""

    stick_slip: np.ndarray = described("beginning and end of each time in stick-slip", "1", "times ends")
    sliding: np.ndarray = described("beginning and end of each slip without sticking", "1", "times ends")
    stick_slip_ended: np.ndarray = described("false where the run was over before the end of stick-slip", "1", "times")
    sliding_ended: np.ndarray = described("false where the run was over before the end of sliding", "1", "times")
    vibration: np.ndarray = described(
        "beginning and end of each time of sliding that vibrates",
        "1",
        "times ends",
        default_factory=lambda: np.empty((0, 2)),
    )

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
    """(times, 2) durations in steady sliding and in vibration, and whether each ended before the run was over."""
    rows: tuple[list[tuple[float, bool]], ...] = ([], [])
    for (begin, end), ended in zip(run.sliding, run.sliding_ended, strict=True):
        inside = run.vibration[(begin <= run.vibration[:, 0]) & (run.vibration[:, 0] < end)]
        for place, (first, last) in enumerate(pairwise([begin, *inside.ravel(), end])):
            if last > first:
                rows[place % 2].append((last - first, ended if last == end else True))
    return np.reshape(rows[0], (-1, 2)), np.reshape(rows[1], (-1, 2))


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
    turn = 2.0 * math.pi

    def run(duration: float) -> Motion:
        feed, until = PathFeed(path, spacing_m), (periods * ROUNDED, longest * ROUNDED)
        return followed(oscillator, law, feed, duration, machine.options, start, until=until)

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
    growth = turn * growth_of_sliding(oscillator, law)
    if growth > 0.0:
        scales["growth from steady sliding"] = GROWTHS / growth
    return scales


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
def durations(runs: Sequence[States], generator: np.random.Generator) -> Durations:
    """Durations and rates of the states in long runs, with 95 % intervals.

    A mean is the whole time in a state over the number of times that it ended, or that stick-slip was born in it.
    Whole durations are resampled; with fewer than FEWEST_ENDS ends the interval is that of exponential ones
    (`exponential_mean`). The mean of a state that no run shows is NaN.
    """
    stuck, slid = (np.concatenate([np.diff(getattr(run, state))[:, 0] for run in runs]) for state in STATES)
    stuck_ended = np.concatenate([run.stick_slip_ended for run in runs])
    steady, vibrating = (np.concatenate(part).T for part in zip(*map(_parts_of_slip, runs), strict=True))
    births = np.concatenate([_births(run) for run in runs])
    stick_slip, sliding = _mean(stuck, stuck_ended, generator), _mean(steady[0], steady[1], generator)
    until_birth, vibration = _mean(slid, births, generator), _mean(vibrating[0], vibrating[1], generator)
    birth = 1.0 / until_birth[[0, 2, 1]]
    return Durations(stick_slip, sliding, birth, stationary_share(1.0 / stick_slip[[0, 2, 1]], birth), vibration)


def _births(run: States) -> np.ndarray:
    """(times in sliding,) whether the next state after each one is stick-slip."""
    following = np.append(run.sliding[1:, 0], math.inf)
    begun = run.stick_slip[:, 0]
    return np.searchsorted(begun, run.sliding[:, 1]) < np.searchsorted(begun, following)


def _mean(duration: np.ndarray, ended: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """(value, low, high) of the time over its ends."""
    count = duration.size
    if not duration.sum() > 0.0:
        return np.full(3, math.nan)
    if np.count_nonzero(ended) < FEWEST_ENDS:
        return exponential_mean(float(duration.sum()), int(np.count_nonzero(ended)))
    counts = np.vstack([np.ones(count), generator.multinomial(count, np.full(count, 1.0 / count), REPLICATES)])
    time, ends = counts @ duration, counts @ ended
    low, high = np.quantile(time[1:] / np.maximum(ends[1:], 1), TAILS)
    middle, margin = time[0] / ends[0], float(interval_margin(count))
    return np.array([middle, middle * (low / middle) ** margin, middle * (high / middle) ** margin])


def exponential_mean(total: float, ended: int) -> np.ndarray:
    """(value, low, high) of the mean of exponential durations, with its 95 % interval.

    total, ended : their sum, and how many of them ended before the run was over

    The likelihood of censored durations is largest at total time over ends (B. Epstein & M. Sobel, J. Am. Stat. Assoc.
    48 (1953) 486); twice the total time over the mean is chi-square with two degrees of freedom more than twice the
    ends below, as many above (D. R. Cox, Biometrika 40 (1953) 354). Without an end the mean has a lower bound alone,
    and value and upper end are infinite.
    """
    low = 2.0 * total / float(chdtri(2 * ended + 2, TAILS[0]))
    if ended == 0:
        return np.array([math.inf, low, math.inf])
    return np.array([total / ended, low, 2.0 * total / float(chdtri(2 * ended, TAILS[1]))])


def stationary_share(death: np.ndarray, birth: np.ndarray) -> np.ndarray:
    """(value, low, high) [-] of birth / (birth + death), NaN where both are 0 or one that counts is unknown.

    death, birth : (3,) [-] value, low and high of independent rates

    On the scale of log(birth / death) the half-widths of both intervals add as squares (G. Y. Zou & A. Donner, Stat.
    Med. 27 (2008) 1693). Without a death or without a birth the ends are those of the worst rates.
    """
    if birth[0] > 0.0 and death[0] > 0.0:
        odds = math.log(birth[0] / death[0])
        low, high = (
            math.hypot(math.log(birth[i] / birth[0]), math.log(death[j] / death[0])) for i, j in ((1, 2), (2, 1))
        )
        return 1.0 / (1.0 + np.exp(-np.array([odds, odds - low, odds + high])))
    pairs = zip(birth, death[[0, 2, 1]], strict=True)
    return np.array([_part(births, deaths) for births, deaths in pairs])


def _part(birth: float, death: float) -> float:
    """birth / (birth + death); NaN where both are 0."""
    if (birth == 0.0) != (death == 0.0):
        return float(death == 0.0)
    return birth / (birth + death) if birth + death > 0.0 else math.nan


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
