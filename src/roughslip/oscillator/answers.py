"""Whether a machine stick-slips under scattering friction, where that ceases or begins, and what decides.

The probability is the share of independent runs from rest that are in stick-slip at random times of their second half.
Along each parameter the same friction paths are run again, and levels of the probability are searched
(`probability.search`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.oscillator.answer_runs import Curve, Runs
from roughslip.oscillator.cycles import FEWEST_REALISATIONS, NO_SCATTER, reattachment_statistics
from roughslip.oscillator.limits import limits_or_nan, slip_loop
from roughslip.oscillator.machine import OF_OSCILLATOR, PARAMETERS, Machine, cycle_exists
from roughslip.oscillator.states import Durations, durations, time_scales
from roughslip.oscillator.trough_chain import durations_by_theory
from roughslip.probability.estimate import wilson_interval
from roughslip.probability.search import LevelSearch, first_change
from roughslip.validation import gate

REACH = 100.0  # factor of the own value, either way, up to which limits are searched
LEAST_DAMPING, MOST_DAMPING = 1e-3, 10.0  # where the search begins without damping; as far as it always goes
LEVELS = {"0.05": 0.05, "0.95": 0.95}
LEAST_KNOWN = 0.1  # of the belt's velocity, down to which a law has to be measured
CLEAR = 0.5  # width of the band of chance over the distance to the limit, up to which the mean curve alone decides
SIDES = {"below": False, "above": True}
STARTS = {"from_rest": False, "from_sliding": True}


@dataclass(frozen=True)
class Quantity:
    """A number with its unit in SI.

    value : None where the runs do not show it
    interval : of 95 %, or None; None for an end that reaches the end of the search
    """

    value: float | None
    interval: tuple[float | None, float | None] | None
    unit: str


@dataclass(frozen=True)
class Crossing(Quantity):
    """Where the probability crosses a level.

    change : outwards, `falls below` or `rises above`
    outside_measured_speeds : whether sliding there leaves the speeds at which the friction law was measured
    """

    change: str
    outside_measured_speeds: bool


@dataclass(frozen=True)
class Limits(Quantity):
    """Limits of stick-slip along one parameter; its own value is `value`.

    below, above : crossings by level, and `without_scatter`, where the cycle without scatter ceases or begins
    searched : the ends of the search, as its interval
    """

    title: str
    below: Mapping[str, Quantity | None]
    above: Mapping[str, Quantity | None]
    searched: Quantity


@dataclass(frozen=True)
class Change(Quantity):
    """A relative change of a parameter to its limit, below or above (side), that will end or begin stick-slip (aim)."""

    parameter: str
    side: str
    aim: str


@dataclass(frozen=True)
class Needed(Quantity):
    """Natural periods that a run has to last, and the time scale that asks for them."""

    scale: str


@dataclass(frozen=True)
class Decision:
    """What decides: `mean curve`, `scatter` or `both`.

    cycle_exists_without_scatter : None where that is unknown
    existence_limit, hopf_damping : [-] without scatter
    band_over_distance : [-] width of the band between the levels, in damping, over the distance to the existence limit
    """

    by: str
    cycle_exists_without_scatter: bool | None
    existence_limit: Quantity
    hopf_damping: Quantity
    band_over_distance: Quantity


@dataclass(frozen=True)
class Answer:
    """What `answer` finds.

    runs, periods : how many there are from either start, and their natural periods after the first departure
    probability, probability_from_sliding : of stick-slip, of runs from rest and from steady sliding
    starts_differ : whether these differ by more than chance
    decided : false where they do because the runs are shorter than they need to be
    needs : natural periods that a run needs
    durations : of the states, with their rates and the share of time, from all runs
    durations_by_theory : the same by `trough_chain`
    amplitude, frequency : [m], [Hz] of the cycles; the amplitude is half of peak to peak. `_scatter` is their standard
        deviation
    limits : by names of `machine.PARAMETERS`
    smallest_change : relative, that ends stick-slip where it is likely, or begins it; None where no limit is found
    decides : mean curve or scatter
    outside_measured_speeds : whether sliding leaves the speeds at which the friction law was measured
    motion : a few periods to draw, with_scatter and without_scatter
    trials : runs in all
    """

    runs: int
    periods: Quantity
    probability: Quantity
    probability_from_sliding: Quantity
    starts_differ: bool
    decided: bool
    needs: Needed
    durations: Durations
    durations_by_theory: Durations
    amplitude: Quantity
    amplitude_scatter: Quantity
    frequency: Quantity
    frequency_scatter: Quantity
    limits: Mapping[str, Limits]
    smallest_change: Change | None
    decides: Decision
    outside_measured_speeds: bool
    motion: Mapping[str, Curve]
    trials: int


@gate
def answer(
    machine: Machine,
    realisations: int = 100,
    duration_periods: float | None = None,
    parameters: Sequence[str] = OF_OSCILLATOR,
    seed: Sequence[int] = (0,),
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> Answer:
    """Whether a machine stick-slips, at which values of its parameters that begins or ends, how it moves, what decides.

    machine : with friction that scatters
    realisations : runs from either start, at least 72, which bound a probability of 5 %
    duration_periods : natural periods of a run; None for what its time scales take, up to 400
    seed : numbers; each run adds its own
    parameters : to search, of damping, belt_velocity, mass, stiffness, load
    progress : is told how many parts are done, of how many: the runs at the scene's values, then each parameter

    Raises as `check_has_answer` and `simulate`.
    """
    check_has_answer(machine)
    runs, count = Runs(machine, realisations, duration_periods, seed), realisations
    periods, oscillator = runs.periods(machine), machine.oscillator
    of = {
        name: [runs.one(machine, number, periods, from_sliding) for number in range(count)]
        for name, from_sliding in STARTS.items()
    }
    cycles = {name: np.array([run.cycles for run in started], dtype=bool) for name, started in of.items()}
    at_start = cycles["from_rest"]
    drawn = [runs.cycles_of(number, run) for number, run in enumerate(of["from_rest"])]
    cycle = cycle_statistics(drawn, oscillator.natural_frequency_rad_per_s, np.random.default_rng([*seed]))
    limits, trials = {}, 2 * count
    progress(1, 1 + len(parameters))
    for done, name in enumerate(parameters, start=2):
        limits[name], more = limits_of(name, runs, at_start)
        trials += more
        progress(done, 1 + len(parameters))
    share = float(np.mean(at_start))
    return Answer(
        runs=count,
        periods=Quantity(periods, None, "1"),
        probability=probability(at_start),
        probability_from_sliding=probability(cycles["from_sliding"]),
        **memory_of_the_start(runs, periods, cycles),
        durations=durations([run.states for each in of.values() for run in each], np.random.default_rng([*seed, 1])),
        durations_by_theory=durations_by_theory(machine),
        **cycle,
        limits=limits,
        smallest_change=smallest_change(limits, share > 0.5),
        decides=deciding(machine, share, limits.get("damping")),
        outside_measured_speeds=leaves_known_speeds(machine),
        motion=runs.curves(of["from_rest"]),
        trials=trials,
    )


def check_has_answer(machine: Machine) -> None:
    """Raise IllPosedError where the question has no answer."""
    belt = machine.oscillator
    if belt.excitation_force_n > 0.0:
        raise IllPosedError(
            "the mass is excited, and stick-slip and steady sliding are told apart only on the free oscillator"
        )
    if belt.belt_velocity_m_per_s == 0.0:
        raise IllPosedError("the belt is at rest")
    try:
        slip_loop(belt, machine.law)
    except ConvergenceError as error:
        raise IllPosedError(str(error)) from error


def leaves_known_speeds(machine: Machine) -> bool:
    """Whether sliding, steady or in the stick-slip cycle, is faster or slower than the friction law was measured.

    Each slip begins and ends at rest, so a law that is open at the belt's LEAST_KNOWN share is open where that decides.
    """
    belt, law = machine.oscillator, machine.law
    if law.slowest_known > LEAST_KNOWN * belt.belt_velocity_m_per_s:
        return True
    return not math.isinf(law.fastest_known) and slip_loop(belt, law).fastest > law.fastest_known


def probability(cycles: np.ndarray) -> Quantity:
    """Of stick-slip, from independent runs. cycles : (runs,) whether each stick-slips"""
    low, high = wilson_interval(int(np.count_nonzero(cycles)), cycles.size)
    return Quantity(float(np.mean(cycles)), (float(low), float(high)), "1")


def cycle_statistics(cycles: Sequence[np.ndarray], omega: float, generator: np.random.Generator) -> dict[str, Any]:
    """Amplitude [m] and frequency [Hz] of the cycles of all runs: mean and standard deviation, by resampled runs.

    cycles : of each run, as `whole_cycles` gives them
    """
    run = np.repeat(np.arange(len(cycles)), [len(one) for one in cycles])
    amplitude, duration = np.concatenate(cycles).T
    quantities: dict[str, Any] = {}
    for name, values, unit in (("amplitude", amplitude, "m"), ("frequency", omega / duration, "Hz")):
        try:
            moments = reattachment_statistics(values, run, generator)
        except IllPosedError:  # too few runs with a cycle, or no scatter
            enough = np.unique(run).size >= FEWEST_REALISATIONS
            alike = enough and np.ptp(values) <= NO_SCATTER * abs(values[0])
            quantities[name] = Quantity(float(values[0]) if alike else None, None, unit)
            quantities[f"{name}_scatter"] = Quantity(0.0 if alike else None, None, unit)
            continue
        for key, (value, low, high) in ((name, moments.mean), (f"{name}_scatter", moments.std)):
            quantities[key] = Quantity(float(value), (float(low), float(high)), unit)
    return quantities


def limits_of(name: str, runs: Runs, at_start: np.ndarray) -> tuple[Limits, int]:
    """Where the probability of stick-slip crosses the levels along one parameter, either way, and the runs it took."""
    parameter = PARAMETERS[name]
    own, unit = float(runs.own.value(name)), parameter.unit
    start = own if own > 0.0 else LEAST_DAMPING
    ends = {"below": start / REACH, "above": REACH * start}
    if name == "damping":
        ends["above"] = max(ends["above"], MOST_DAMPING)
    cycle_ends = {side: without_scatter(runs, name, start, end) for side, end in ends.items()}
    hints = [value for value in cycle_ends.values() if value is not None]
    search = LevelSearch(partial(runs.of_value, name), start, ends["below"], ends["above"], at_start, hints)
    sides: dict[str, dict[str, Quantity | None]] = {side: {} for side in SIDES}
    for side, upwards in SIDES.items():
        for label, level in LEVELS.items():
            crossing = search.crossing(level, upwards)
            if crossing is None:
                sides[side][label] = None
                continue
            word = "falls below" if search.count(start) > level * search.paths else "rises above"
            outside = leaves_known_speeds(runs.own.changed({name: crossing.value}))
            sides[side][label] = Crossing(crossing.value, (crossing.low, crossing.high), unit, word, outside)
        sides[side]["without_scatter"] = Quantity(cycle_ends[side], None, unit)
    return Limits(
        own, None, unit, parameter.title, **sides, searched=Quantity(None, search.searched, unit)
    ), search.trials


def without_scatter(runs: Runs, name: str, start: float, reach: float) -> float | None:
    """The value at which the stick-slip cycle without scatter ceases or begins to exist, if the search holds one."""

    def exists(value: float) -> bool | None:
        return cycle_exists(runs.own.changed({name: value}))

    return None if exists(start) is None else first_change(exists, start, reach)[1]


def smallest_change(limits: Mapping[str, Limits], is_likely: bool) -> Change | None:
    """The parameter with the relatively nearest limit that ends stick-slip where it is likely, else begins it."""
    aim, changes = "end" if is_likely else "begin", []
    for name, of_parameter in limits.items():
        for side in SIDES:
            limit = getattr(of_parameter, side)["0.05" if is_likely else "0.95"]
            if limit is not None and of_parameter.value:
                low, high = (None if end is None else end / of_parameter.value - 1.0 for end in limit.interval)
                change = limit.value / of_parameter.value - 1.0
                changes.append((abs(change), name, Change(change, (low, high), "1", name, side, aim)))
    return min(changes, key=lambda entry: entry[:2])[2] if changes else None


def deciding(machine: Machine, share: float, damping: Limits | None) -> Decision:
    """Whether the mean curve of friction or its scatter decides.

    Scatter decides where the probability lies within the levels or denies the cycle without scatter. Else the mean
    curve decides, together with scatter where the band between the levels, in damping, is wide against the distance
    of the oscillator from the existence limit.
    """
    belt = machine.oscillator
    (hopf, existence), ratio = limits_or_nan(belt, machine.law), belt.damping_ratio
    limit = None if np.isnan(existence) else existence
    exists = cycle_exists(machine)
    width = None
    for side in SIDES if damping else ():
        five, ninety_five = (getattr(damping, side)[label] for label in LEVELS)
        if limit is not None and five is not None and ninety_five is not None and limit != ratio:
            width = abs(five.value - ninety_five.value) / abs(limit - ratio)
    is_certain = share >= LEVELS["0.95"] if exists else share <= LEVELS["0.05"]
    by = "scatter" if exists is None or not is_certain else "mean curve"
    if by == "mean curve" and width is not None and width > CLEAR:
        by = "both"
    return Decision(by, exists, *(Quantity(value, None, "1") for value in (limit, hopf, width)))


def memory_of_the_start(runs: Runs, periods: float, cycles: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """Whether runs from rest and from sliding differ, and which run would decide.

    Both starts have the same friction paths. Of the runs in which they differ, as many should stick-slip from one start
    as from the other, where the start is forgotten.
    """
    rest, sliding = cycles["from_rest"], cycles["from_sliding"]
    more, less = np.count_nonzero(rest & ~sliding), np.count_nonzero(sliding & ~rest)
    differ = bool(abs(more - less) > 2.0 * np.sqrt(more + less))
    scale, needed = max(time_scales(runs.own).items(), key=lambda pair: pair[1])
    return {
        "starts_differ": differ,
        "decided": not differ or periods >= needed * (1.0 - 1e-9),
        "needs": Needed(needed if np.isfinite(needed) else None, None, "1", scale),
    }
