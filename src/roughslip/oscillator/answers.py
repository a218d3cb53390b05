"""Whether a machine stick-slips under scattering friction, where that ceases or begins, and what decides.

The probability is the share of independent runs from rest that are in stick-slip at random times of their second half.
Along each parameter the same friction paths are run again, and levels of the probability are searched
(`probability.search`). A run that does not stick may vibrate (`vibration`), and where it would end without scatter is
that of `attractors`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import chain, product
from typing import Any

import numpy as np

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.oscillator.answer_parts import Answer, Change, Crossing, Limits, Needed, Quantity
from roughslip.oscillator.answer_runs import Run, Runs
from roughslip.oscillator.attractors import State, attractors_of, state_from_rest, vibration_limit
from roughslip.oscillator.cycles import FEWEST_REALISATIONS, NO_SCATTER, reattachment_statistics
from roughslip.oscillator.limits import damping_of_slope, departure_point, limits_or_nan, slip_loop
from roughslip.oscillator.machine import OF_OSCILLATOR, PARAMETERS, Machine, cycle_exists
from roughslip.oscillator.memory_law import MemoryLaw
from roughslip.oscillator.rates import durations_by_theory
from roughslip.oscillator.slip_orbit import critical_stiffness
from roughslip.oscillator.states import durations, is_within, settling_ages, time_scales
from roughslip.oscillator.vibration import unsteady_at, vibrating_runs
from roughslip.probability.estimate import wilson_interval
from roughslip.probability.search import LevelSearch, first_change
from roughslip.validation import gate

REACH = 100.0  # factor of the own value, either way, up to which limits are searched
LEAST_DAMPING, MOST_DAMPING = 1e-3, 10.0  # where the search begins without damping; as far as it always goes
LEVELS = {"0.05": 0.05, "0.95": 0.95}
UNSTEADY = {"unsteady_0.05": 0.05}  # stick-slip or vibration
LEAST_KNOWN = 0.1  # of the belt's velocity, down to which a law has to be measured
LIKELY = 0.5  # share of the runs from which on a state is to be ended
EQUAL = 0.02  # of two changes, by the logarithms of their factors, which are then the same: as near as limits are found
CLEAR = 0.5  # width of the band of chance over the distance to the limit, up to which the mean curve alone decides
SIDES = {"below": False, "above": True}
STARTS = {"from_rest": False, "from_sliding": True}


@gate
def answer(
    machine: Machine,
    realisations: int = 100,
    duration_periods: float | None = None,
    parameters: Sequence[str] = OF_OSCILLATOR,
    seed: Sequence[int] = (0,),
    progress: Callable[[int, int], None] = lambda done, of: None,
    can_change: Mapping[str, tuple[float, float]] | None = None,
) -> Answer:
    """Whether a machine stick-slips, at which values of its parameters that begins or ends, how it moves, what decides.

    machine : with friction that scatters
    realisations : runs from either start, at least 72, which bound a probability of 5 %
    duration_periods : natural periods of a run; None for what its time scales take, up to 400
    seed : numbers; each run adds its own
    parameters : to search, of damping, belt_velocity, mass, stiffness, load; with a memory also those of OF_MEMORY
    progress : takes how many parts are done, of how many: the runs at the scene's values, then each parameter
    can_change : range of each parameter that can change, for the smallest change; None where all can

    Raises as `check_has_answer` and `simulate`.
    """
    check_has_answer(machine)
    runs, count = Runs(machine, realisations, duration_periods, seed), realisations
    periods, oscillator = runs.periods(machine), machine.oscillator
    started = {
        name: [runs.one(machine, number, periods, from_sliding) for number in range(count)]
        for name, from_sliding in STARTS.items()
    }
    of, vibrations = vibrating_runs(runs, started, STARTS)
    seen = {name: states_seen(among) for name, among in of.items()}
    at_start = seen["from_rest"][State.STICK_SLIP]
    drawn = [runs.cycles_of(number, run) for number, run in enumerate(of["from_rest"])]
    omega = oscillator.natural_frequency_rad_per_s
    cycle = cycle_statistics(drawn, omega, np.random.default_rng([*seed]))
    ends, ages = endings(machine), settling_ages(machine)
    memory = memory_of(machine) if isinstance(machine.law, MemoryLaw) else None
    may_vibrate = any(one["state"] is State.VIBRATION for one in ends.values())
    limits, trials = {}, 2 * count
    progress(1, 1 + len(parameters))
    for done, name in enumerate(parameters, start=2):
        limits[name], more = limits_of(name, runs, seen["from_rest"])
        trials += more
        progress(done, 1 + len(parameters))
    share, vibration = float(np.mean(at_start)), float(np.mean(seen["from_rest"][State.VIBRATION]))
    return Answer(
        runs=count,
        periods=Quantity(periods, None, "1"),
        probability=probability(at_start),
        probability_from_sliding=probability(seen["from_sliding"][State.STICK_SLIP]),
        shares={name: {state: probability(among) for state, among in seen[name].items()} for name in STARTS},
        without_scatter=ends,
        **compared_starts(runs, periods, seen),
        durations=durations([run.states for run in chain(*of.values())], np.random.default_rng([*seed, 1]), ages),
        durations_by_theory=None if may_vibrate or memory is not None else durations_by_theory(machine),
        **cycle,
        vibration=cycle_statistics(vibrations, omega, np.random.default_rng([*seed, 2])),
        limits=limits,
        smallest_changes=smallest_changes(limits, share, vibration, can_change),
        decides=deciding(machine, share, limits.get("damping")),
        memory=memory,
        outside_measured_speeds=leaves_known_speeds(machine),
        motion=runs.curves(of["from_rest"]),
        trials=trials,
    )


def check_has_answer(machine: Machine) -> None:
    """Raise IllPosedError where the question has no answer."""
    belt = machine.oscillator
    if belt.excitation_force_n > 0.0:
        raise IllPosedError(
            "the mass is excited, and stick-slip and steady sliding are distinguished only on the free oscillator"
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


def states_seen(runs: Sequence[Run]) -> dict[State, np.ndarray]:
    """(runs,) whether each run is in a state when it is looked at."""
    sticks = np.array([run.cycles for run in runs], dtype=bool)
    vibrates = ~sticks & np.array([is_within(run.states.vibration, run.looked_at) for run in runs], dtype=bool)
    return {State.STICK_SLIP: sticks, State.VIBRATION: vibrates, State.SLIDING: ~sticks & ~vibrates}


def endings(machine: Machine) -> dict[str, dict[str, Any]]:
    """State, amplitude [m] and frequency [Hz] where the motion without scatter ends, by start."""
    try:
        found = attractors_of(machine.oscillator, machine.law)
    except ConvergenceError:
        found = None
    omega, rows = machine.oscillator.natural_frequency_rad_per_s, {}
    for name, from_sliding in STARTS.items():
        one = found and (found.from_sliding if from_sliding else found.from_rest)
        amplitude, frequency = (one.amplitude, omega / one.period) if one and one.amplitude else (None, None)
        rows[name] = {
            "state": one and one.state,
            "amplitude": Quantity(amplitude, None, "m"),
            "frequency": Quantity(frequency, None, "Hz"),
        }
    return rows


def cycle_statistics(cycles: Sequence[np.ndarray], omega: float, generator: np.random.Generator) -> dict[str, Any]:
    """Amplitude [m] and frequency [Hz] of the cycles of all runs: mean and standard deviation, by resampled runs.

    cycles : of each run, as `whole_cycles` gives them
    """
    run = np.repeat(np.arange(len(cycles)), [len(one) for one in cycles])
    amplitude, duration = np.concatenate([np.empty((0, 2)), *cycles]).T
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


def limits_of(name: str, runs: Runs, seen: Mapping[State, np.ndarray]) -> tuple[Limits, int]:
    """Where probabilities cross their levels along one parameter, either way, and the runs that took.

    seen : (runs,) whether each is in a state at the own values; where a vibration is likely, its end is searched too
    """
    parameter = PARAMETERS[name]
    own, unit = float(runs.own.value(name)), parameter.unit
    start = own or LEAST_DAMPING
    ends = {"below": start / REACH, "above": REACH * start}
    if name == "damping":
        ends["above"] = max(ends["above"], MOST_DAMPING)
    cycle_ends, steady_ends = (
        {side: changed_without_scatter(runs, name, end, decided) for side, end in ends.items()}
        for decided in (cycle_exists, slides)
    )
    sides: dict[str, dict[str, Quantity | None]] = {side: dict.fromkeys(LEVELS | UNSTEADY) for side in SIDES}
    searches: list[tuple[Any, ...]] = [(LEVELS, runs.of_value, seen[State.STICK_SLIP], cycle_ends)]
    if np.mean(seen[State.VIBRATION]) > LIKELY:
        searches.append((UNSTEADY, partial(unsteady_at, runs), ~seen[State.SLIDING], steady_ends))
    searched, trials = None, 0
    for levels, occurs, at_start, without in searches:
        hints = [value for value in without.values() if value is not None]
        search = LevelSearch(partial(occurs, name), start, ends["below"], ends["above"], at_start, hints)
        for (side, upwards), (label, level) in product(SIDES.items(), levels.items()):
            crossing = search.crossing(level, upwards)
            if crossing is not None:
                word = "falls below" if search.count(start) > level * search.paths else "rises above"
                outside = leaves_known_speeds(runs.own.changed({name: crossing.value}))
                sides[side][label] = Crossing(crossing.value, (crossing.low, crossing.high), unit, word, outside)
        searched, trials = searched or search.searched, trials + search.trials
    for side in SIDES:
        sides[side]["without_scatter"] = Quantity(cycle_ends[side], None, unit)
        sides[side]["steady_without_scatter"] = Quantity(steady_ends[side], None, unit)
    return Limits(own, None, unit, parameter.title, **sides, searched=Quantity(None, searched, unit)), trials


def changed_without_scatter(
    runs: Runs, name: str, reach: float, decided: Callable[[Machine], bool | None]
) -> float | None:
    """The value of a parameter at which what is decided without scatter changes, if the search to `reach` holds one."""

    def at(value: float) -> bool | None:
        try:
            return decided(runs.own.changed({name: value}))
        except ParameterError:  # a law of a memory so strong that it has no friction
            return None

    start = float(runs.own.value(name)) or LEAST_DAMPING
    return None if at(start) is None else first_change(at, start, reach)[1]


def slides(machine: Machine) -> bool | None:
    """Whether the mass slides steadily without scatter, from rest; None where slip is too stiff to decide."""
    state = state_from_rest(machine)
    return None if state is None else state is State.SLIDING


def smallest_changes(
    limits: Mapping[str, Limits],
    stick_slip: float,
    vibration: float,
    can_change: Mapping[str, tuple[float, float]] | None = None,
) -> tuple[Change, ...]:
    """The change of one parameter, least by its factor, that ends the state that is likely, or begins stick-slip.

    stick_slip, vibration : [-] shares of the runs from rest
    can_change : range of each parameter that can change; None where all can

    Those of the same factor come together. Without `can_change` the load, which is what most machines are for, counts
    with others of the same factor only, or alone.
    """
    state, aim, label = State.STICK_SLIP, "begin", "0.95"
    if stick_slip > LIKELY:
        aim, label = "end", "0.05"
    elif vibration > LIKELY:
        state, aim, label = State.VIBRATION, "end", "unsteady_0.05"
    changes = []
    for (name, of_parameter), side in product(limits.items(), SIDES):
        limit, own = getattr(of_parameter, side)[label], of_parameter.value
        if limit is None or limit.value is None or not own:
            continue
        low, high = (0.0, math.inf) if can_change is None else can_change.get(name, (math.inf, 0.0))
        if low <= limit.value <= high:
            interval = None if limit.interval is None else tuple(end and end / own - 1.0 for end in limit.interval)
            change = Change(limit.value / own - 1.0, interval, "1", name, side, aim, state)
            changes.append((abs(math.log(limit.value / own)), change))
    first = [pair for pair in changes if can_change is not None or pair[1].parameter != "load"] or changes
    least = min((far for far, _ in first), default=0.0)
    return tuple(change for far, change in changes if abs(far - least) <= EQUAL)


def deciding(machine: Machine, share: float, damping: Limits | None) -> dict[str, Any]:
    """Whether the mean curve of friction or its scatter decides, and the limits without scatter.

    Scatter decides where the probability lies within the levels or denies the cycle without scatter. Else the mean
    curve decides, together with scatter where the band between the levels, in damping, is wide against the distance
    of the oscillator from the existence limit.

    Straight lines between the points of a table would give Hopf dampings in the interval hopf_by_lines. From rest, a
    mass that does not stick vibrates up to the damping vibration_limit. band_over_distance is the width of the band
    between the levels over the distance to the existence limit.
    """
    belt, law = machine.oscillator, machine.law
    (hopf, existence), ratio, exists, width = limits_or_nan(belt, law), belt.damping_ratio, cycle_exists(machine), None
    limit = None if np.isnan(existence) else existence
    for side in SIDES if damping else ():
        five, ninety_five = (getattr(damping, side)[label] for label in LEVELS)
        if limit is not None and five is not None and ninety_five is not None and limit != ratio:
            width = abs(five.value - ninety_five.value) / abs(limit - ratio)
    by, is_certain = "scatter", share >= LEVELS["0.95"] if exists else share <= LEVELS["0.05"]
    if exists is not None and is_certain:
        by = "both" if width is not None and width > CLEAR else "mean curve"
    speed = belt.belt_velocity_m_per_s
    lines = [damping_of_slope(belt, slope) for slope in law.slopes_by_lines(speed)]
    return {
        "by": by,
        "cycle_exists_without_scatter": exists,
        "friction_slope": Quantity(float(law.slope(speed)), None, "s m-1"),
        "existence_limit": Quantity(limit, None, "1"),
        "hopf_damping": Quantity(hopf, None, "1"),
        "hopf_by_lines": Quantity(None, (min(lines), max(lines)) if lines else None, "1"),
        "vibration_limit": Quantity(vibration_limit(machine, limit), None, "1"),
        "band_over_distance": Quantity(width, None, "1"),
    }


def memory_of(machine: Machine) -> dict[str, Quantity]:
    """Memory length, critical stiffness, and friction at the departure of the cycle, or at the first one from rest."""
    belt, law = machine.oscillator, machine.memory
    stiffness, _ = critical_stiffness(belt, law)
    cycle, place = slip_loop(belt, law).cycle, departure_point(belt, law)
    place, stick = (place, place / belt.V) if cycle is None else (cycle.departure, cycle.period - cycle.slip_duration)
    return {
        "length": Quantity(law.memory_length_m, None, "m"),
        "critical_stiffness": Quantity(stiffness if math.isfinite(stiffness) else None, None, "N m-1"),
        "break_away": Quantity((place + 2.0 * belt.damping_ratio * belt.V) / belt.F, None, "1"),
        "stick": Quantity(stick / belt.natural_frequency_rad_per_s, None, "s"),
    }


def compared_starts(runs: Runs, periods: float, seen: Mapping[str, Mapping[State, np.ndarray]]) -> dict[str, Any]:
    """Whether runs from rest and from sliding differ, and which run would decide.

    Both starts have the same friction paths. Of the runs in which they differ, as many should be in a state from one
    start as from the other, where the start is forgotten.
    """
    differ = False
    for state, rest in seen["from_rest"].items():
        sliding = seen["from_sliding"][state]
        more, less = np.count_nonzero(rest & ~sliding), np.count_nonzero(sliding & ~rest)
        differ = differ or bool(abs(more - less) > 2.0 * np.sqrt(more + less))
    scale, needed = max(time_scales(runs.own).items(), key=lambda pair: pair[1])
    return {
        "starts_differ": differ,
        "decided": not differ or periods >= needed * (1.0 - 1e-9),
        "needs": Needed(needed if np.isfinite(needed) else None, None, "1", scale),
    }
