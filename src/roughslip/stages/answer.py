"""Stage answer: whether the scene's oscillator stick-slips, where that ceases or begins, how it moves, what decides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from roughslip import store
from roughslip.chaos.sampling import wilson_interval
from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.friction.paths import Paths, path_sampler
from roughslip.oscillator.cycles import FEWEST_REALISATIONS, NO_SCATTER, reattachment_statistics
from roughslip.oscillator.durations import states_of_answer, theory_or_nan
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_law import FrictionLaw
from roughslip.oscillator.limits import cycle_period, slip_loop
from roughslip.oscillator.motion import Motion, MotionOptions, Trajectory, trajectory
from roughslip.oscillator.path import KeptPath
from roughslip.oscillator.states import States, run_until_known, time_scales
from roughslip.oscillator.survival import Spells, mean_lifetime, spells
from roughslip.probability.level_search import LevelSearch
from roughslip.report.answer import summary
from roughslip.scene.declarations import Stage
from roughslip.scene.fields import unless_auto
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import geometry, mass_on_belt, variation
from roughslip.stages.from_scene.mass_on_belt import FrictionNumbers
from roughslip.stages.from_scene.own_limits import limits_or_nan
from roughslip.stages.from_scene.variation import PARAMETERS, System
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job
from roughslip.verdicts.bracket import range_end

STAGE = Stage(
    name="answer",
    reads="seed oscillator",
    reads_if_given="answer.realisations answer.duration_periods ensemble.marginal friction.statistics friction.scatter",
    optional={"friction": "friction"},
    result="answer.json",
    target="answer",
    comes_with="deterministic stick_slip_map",
    memory_mb=620,
)

NODES = 4  # per correlation length, as in the map
VARIED = ("damping", "belt_velocity", "mass", "stiffness", "load")
REACH = 100.0  # factor of the scene's value, either way, up to which limits are searched
LEAST_DAMPING, MOST_DAMPING = 1e-3, 10.0  # where the search begins without damping; as far as it always goes
LEVELS = {"0.05": 0.05, "0.95": 0.95}
KEPT_NODES, KEPT_PATHS = 2**16, 200  # in memory, 100 MB; what is beyond is drawn again for each run
SAMPLES = 100  # a natural period, of the displacement: its extremes err by at most (pi / SAMPLES)^2 / 2
MOST_SAMPLES = 1e6  # of a run
CLEAR = 0.5  # width of the band of chance over the distance to the limit, up to which the mean curve alone decides
SIDES = {"below": False, "above": True}


LONGEST_RUN = 400.0  # natural periods that a run lasts by itself
STARTS = {"from_rest": False, "from_sliding": True}


@dataclass(frozen=True)
class Run:
    """A run of the scene's own oscillator: its motion, its first departure, its states, and whether it stick-slips at
    the time at which it is looked at."""

    motion: Motion
    first: float
    states: States
    cycles: bool


@dataclass(frozen=True)
class Runs:
    """Runs of a scene on the same friction paths, each looked at at a time of its own in the second half.

    count : n
    length_m : [m] correlation length of the friction
    """

    scene: Scene
    numbers: FrictionNumbers
    own: System
    paths: Paths
    options: MotionOptions
    count: int
    length_m: float
    kept: dict[int, KeptPath] = field(default_factory=dict)

    def path(self, number: int) -> KeptPath:
        """The friction path of a run."""
        if number not in self.kept:
            seed = [self.scene.seed, geometry.STREAM_ANSWER, number]
            self.kept[number] = KeptPath(self.paths.realisation(seed), KEPT_NODES if number < KEPT_PATHS else 0)
        return self.kept[number]

    def scales(self, belt: Oscillator, law: FrictionLaw) -> dict[str, float]:
        """Natural periods that a run has to last, by each of its time scales."""
        return time_scales(belt, law, self.length_m)

    def periods(self, belt: Oscillator, law: FrictionLaw) -> float:
        """Natural periods of a run after its first departure."""
        given = unless_auto(self.scene.answer.duration_periods)
        return min(max(self.scales(belt, law).values()), LONGEST_RUN) if given is None else float(given)

    def one(self, belt: Oscillator, law: FrictionLaw, number: int, periods: float, from_sliding: bool) -> Run:
        """A run up to its time in the second half; times are spread evenly, so that their mean is the share of it."""
        time = 0.5 * periods * (1.0 + (number + 0.5) / self.count)
        path, spacing = self.path(number), self.paths.spacing
        motion, first, states = run_until_known(belt, law, path, spacing, time, self.options, from_sliding)
        return Run(motion, first, states, states.is_stick_slip(first + time))

    def of_value(self, name: str, value: float, numbers: range) -> np.ndarray:
        """(runs,) whether the mass stick-slips, from rest on the belt, with one parameter at another value."""
        changed = variation.changed(self.scene, self.numbers, {name: value})
        periods = self.periods(changed.belt, changed.law)
        return np.array(
            [self.one(changed.belt, changed.law, one, periods, False).cycles for one in numbers], dtype=bool
        )

    def cycles_of(self, number: int, run: Run) -> np.ndarray:
        """The whole cycles of a run of the scene's own oscillator, as `whole_cycles` gives them."""
        belt, law, path = self.own.belt, self.own.law, self.path(number)
        if run.motion.cycles < 2:
            return np.empty((0, 2))
        periods = run.motion.duration / (2 * np.pi)
        options = replace(self.options, samples_per_period=min(SAMPLES, max(int(MOST_SAMPLES / periods), 1)))
        drawn = trajectory(belt, law, path, self.paths.spacing, periods, options)
        return whole_cycles(drawn, run.states)


def quantity(value: float | None, interval: tuple[float | None, float | None] | None, unit: str) -> dict[str, Any]:
    """A number of answer.json; null stands for an end of the interval that reaches the end of the search."""
    return {"value": value, "interval": None if interval is None else list(interval), "unit": unit}


def probability(cycles: np.ndarray) -> dict[str, Any]:
    """Of stick-slip, from independent runs."""
    low, high = wilson_interval(int(np.count_nonzero(cycles)), cycles.size)
    return quantity(float(np.mean(cycles)), (float(low), float(high)), "1")


def whole_cycles(drawn: Trajectory, states: States) -> np.ndarray:
    """(cycles, 2) half the distance of the extremes of the displacement [m] and duration [tau] of each cycle.

    A cycle lasts from one reattachment after backward motion to the next, without steady sliding between.
    """
    ends = drawn.motion.time[drawn.motion.backwards]
    slid = 2 * np.pi * states.sliding[:, 0]
    rows = []
    for start, finish in pairwise(ends):
        if not np.any((start <= slid) & (slid < finish)):
            first, last = np.searchsorted(drawn.time, (start, finish))
            rows.append((0.5 * float(np.ptp(drawn.position[first:last])), finish - start))
    return np.reshape(rows, (-1, 2))


def cycle_statistics(cycles: Sequence[np.ndarray], omega: float, generator: np.random.Generator) -> dict[str, Any]:
    """Amplitude [m] and frequency [Hz] of the cycles of all runs: mean and standard deviation, by resampled runs.

    cycles : of each run, as `whole_cycles` gives them
    """
    run = np.repeat(np.arange(len(cycles)), [len(one) for one in cycles])
    amplitude, duration = np.concatenate(cycles).T
    found: dict[str, Any] = {}
    for name, values, unit in (("amplitude", amplitude, "m"), ("frequency", omega / duration, "Hz")):
        try:
            moments = reattachment_statistics(values, run, generator)
        except IllPosedError:  # too few runs with a cycle, or no scatter
            enough = np.unique(run).size >= FEWEST_REALISATIONS
            alike = enough and np.ptp(values) <= NO_SCATTER * abs(values[0])
            found[name] = quantity(float(values[0]) if alike else None, None, unit)
            found[f"{name}_scatter"] = quantity(0.0 if alike else None, None, unit)
            continue
        for key, (value, low, high) in ((name, moments.mean), (f"{name}_scatter", moments.std)):
            found[key] = quantity(float(value), (float(low), float(high)), unit)
    return found


def limits_of(name: str, runs: Runs, at_start: np.ndarray) -> tuple[dict[str, Any], int]:
    """Where the probability of stick-slip crosses the levels along one parameter, either way, and the runs it took."""
    parameter, own = PARAMETERS[name], PARAMETERS[name].value(runs.own)
    start = own if own > 0.0 else LEAST_DAMPING
    ends = {"below": start / REACH, "above": REACH * start}
    if name == "damping":
        ends["above"] = max(ends["above"], MOST_DAMPING)
    search = LevelSearch(partial(runs.of_value, name), start, ends["below"], ends["above"], at_start)
    found: dict[str, Any] = {"title": parameter.title, **quantity(own, None, parameter.unit)}
    for side, upwards in SIDES.items():
        found[side] = {}
        for label, level in LEVELS.items():
            crossing = search.crossing(level, upwards)
            if crossing is None:
                found[side][label] = None
                continue
            high = search.count(start) > level * search.paths
            number = quantity(crossing.value, (crossing.low, crossing.high), parameter.unit)
            there = variation.changed(runs.scene, runs.numbers, {name: crossing.value})
            found[side][label] = {
                **number,
                "change": "falls below" if high else "rises above",
                "outside_measured_speeds": variation.leaves_known_speeds(there),
            }
        found[side]["without_scatter"] = quantity(without_scatter(runs, name, start, ends[side]), None, parameter.unit)
    return found | {"searched": quantity(None, search.searched, parameter.unit)}, search.trials


def without_scatter(runs: Runs, name: str, start: float, reach: float) -> float | None:
    """The value at which the stick-slip cycle without scatter ceases or begins to exist, if the search holds one."""

    def exists(value: float) -> bool | None:
        changed = variation.changed(runs.scene, runs.numbers, {name: value})
        period = cycle_period(changed.belt, changed.law)
        return None if period is None else period < np.inf

    return None if exists(start) is None else range_end(exists, start, reach).first_different


def smallest_change(limits: Mapping[str, Any], is_likely: bool) -> dict[str, Any] | None:
    """The parameter with the relatively nearest limit that ends stick-slip where it is likely, else begins it."""
    label = "0.05" if is_likely else "0.95"
    found = []
    for name, one in limits.items():
        for side in SIDES:
            if one[side][label] is not None and one["value"] > 0.0:
                change = one[side][label]["value"] / one["value"] - 1.0
                ends = [None if x is None else x / one["value"] - 1.0 for x in one[side][label]["interval"]]
                found.append((abs(change), name, side, change, ends))
    if not found:
        return None
    _, name, side, change, ends = min(found)
    aim = "end" if is_likely else "begin"
    return {"parameter": name, "side": side, "aim": aim, **quantity(change, (ends[0], ends[1]), "1")}


def deciding(own: System, share: float, damping: Mapping[str, Any]) -> dict[str, Any]:
    """Whether the mean curve of friction or its scatter decides.

    Scatter decides where the probability lies within the levels or denies the cycle without scatter. Else the mean
    curve decides, together with scatter where the band between the levels, in damping, is wide against the distance
    of the scene from the existence limit.
    """
    (hopf, existence), ratio = limits_or_nan(own.belt, own.law), own.belt.damping_ratio
    limit = None if np.isnan(existence) else existence
    period = cycle_period(own.belt, own.law)
    exists = None if period is None else period < np.inf
    width = None
    for side in SIDES:
        five, ninety_five = (damping[side][label] for label in LEVELS)
        if limit is not None and five is not None and ninety_five is not None and limit != ratio:
            width = abs(five["value"] - ninety_five["value"]) / abs(limit - ratio)
    is_certain = share >= LEVELS["0.95"] if exists else share <= LEVELS["0.05"]
    by = "scatter" if exists is None or not is_certain else "mean curve"
    if by == "mean curve" and width is not None and width > CLEAR:
        by = "both"
    return {
        "by": by,
        "cycle_exists_without_scatter": exists,
        "existence_limit": quantity(limit, None, "1"),
        "hopf_damping": quantity(hopf, None, "1"),
        "band_over_distance": quantity(width, None, "1"),
    }


def lifetime(parts: Sequence[Spells]) -> dict[str, Any]:
    """Mean lifetime of a state in natural periods, with its lower bound, from the spells of all runs."""
    all_spells = Spells(np.concatenate([one.duration for one in parts]), np.concatenate([one.ended for one in parts]))
    try:
        ends = [None if np.isinf(one) else float(one) for one in mean_lifetime(all_spells)]
    except IllPosedError:  # no run showed it
        return quantity(None, None, "1")
    return quantity(ends[0], (ends[1], ends[2]), "1")


def memory_of_the_start(
    runs: Runs, periods: float, cycles: Mapping[str, np.ndarray], of: Mapping[str, list[Run]]
) -> dict[str, Any]:
    """Whether runs from rest and from sliding differ, how long both states live, and which run would decide.

    Both starts have the same friction paths. Of the runs in which they differ, as many should stick-slip from one start
    as from the other, where the start is forgotten.
    """
    rest, sliding = cycles["from_rest"], cycles["from_sliding"]
    more, less = np.count_nonzero(rest & ~sliding), np.count_nonzero(sliding & ~rest)
    differ = bool(abs(more - less) > 2.0 * np.sqrt(more + less))
    scale, needed = max(runs.scales(runs.own.belt, runs.own.law).items(), key=lambda one: one[1])
    return {
        "starts_differ": differ,
        "decided": not differ or periods >= needed * (1.0 - 1e-9),
        "needs": {"scale": scale, **quantity(needed if np.isfinite(needed) else None, None, "1")},
        "stick_slip_lifetime": lifetime([spells(one.states)[0] for one in of["from_rest"]]),
        "sliding_lifetime": lifetime([spells(one.states)[1] for one in of["from_sliding"]]),
    }


def not_given(own: System) -> str | None:
    """Why the question has no answer in this scene."""
    if own.belt.excitation_force_n > 0.0:
        return "the mass is excited, and stick-slip and steady sliding are told apart only on the free oscillator"
    if own.belt.belt_velocity_m_per_s == 0.0:
        return "the belt is at rest"
    try:
        slip_loop(own.belt, own.law)
    except ConvergenceError as error:
        return str(error)
    return None


def work(job: Job) -> None:
    """Write answer.json."""
    scene = job.scene
    numbers = mass_on_belt.friction_numbers(scene, job.arguments.friction)
    own = variation.system(scene, numbers)
    reason = not_given(own)
    if reason is not None:
        store.write_json(
            job.arguments.output,
            {"given": False, "reason": reason, "summary": [f"Stick-slip: no answer, because {reason}."]},
        )
        return
    count = scene.answer.realisations
    process = variation.process(scene, own, job.arguments.friction)
    paths = path_sampler(process, process.correlation_length_m / NODES)
    length = process.correlation_length_m
    runs = Runs(scene, numbers, own, paths, mass_on_belt.motion_options(scene), count, length)
    with job.usage.core():
        periods = runs.periods(own.belt, own.law)
        of = {
            name: [runs.one(own.belt, own.law, number, periods, from_sliding) for number in range(count)]
            for name, from_sliding in STARTS.items()
        }
        cycles = {name: np.array([one.cycles for one in found], dtype=bool) for name, found in of.items()}
        at_start = cycles["from_rest"]
        generator = np.random.default_rng([scene.seed, geometry.STREAM_ANSWER])
        drawn = [runs.cycles_of(number, run) for number, run in enumerate(of["from_rest"])]
        cycle = cycle_statistics(drawn, own.belt.natural_frequency_rad_per_s, generator)
        limits, trials = {}, 2 * count
        for done, name in enumerate(VARIED, start=1):
            limits[name], more = limits_of(name, runs, at_start)
            trials += more
            job.usage.progress(done, len(VARIED))
    windows = mass_on_belt.independent_windows(scene, job.arguments.friction, own.windows)
    deviation = numbers.standard_deviation / windows**0.5 / mass_on_belt.unit_of_scatter(scene, numbers)
    share = float(np.mean(at_start))
    job.usage.count(runs=trials)
    job.usage.skip({skip_reasons.KEPT: trials - count})
    found = {
        "given": True,
        "runs": count,
        "periods": quantity(periods, None, "1"),
        "probability": probability(at_start),
        "probability_from_sliding": probability(cycles["from_sliding"]),
        **memory_of_the_start(runs, periods, cycles, of),
        **cycle,
        "limits": limits,
        "smallest_change": smallest_change(limits, share > 0.5),
        "decides": deciding(own, share, limits["damping"]),
        "friction_mean": quantity(numbers.mean, None, "1"),
        "friction_deviation": quantity(numbers.standard_deviation, None, "1"),
        "outside_measured_speeds": variation.leaves_known_speeds(own),
        "windows": quantity(own.windows, None, "1"),
        "states": states_of_answer(
            [one.states for each in of.values() for one in each],
            theory_or_nan(own.belt, own.law, deviation, length, process.autocorrelation, runs.options),
            own.belt.natural_frequency_rad_per_s,
            [scene.seed, geometry.STREAM_ANSWER, count],
        ),
    }
    store.write_json(job.arguments.output, found | {"summary": summary(found)})
