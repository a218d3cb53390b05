"""What an answer consists of: numbers with units and intervals, limits, changes, what decides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from roughslip.oscillator.answer_runs import Curve
from roughslip.oscillator.states import Durations


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

    below, above : crossings by level, `unsteady_0.05` where a vibration is likely; `without_scatter`, where the
        cycle without scatter ceases or begins; and `steady_without_scatter`, where steady sliding does
    searched : the ends of the search, as its interval
    """

    title: str
    below: Mapping[str, Quantity | None]
    above: Mapping[str, Quantity | None]
    searched: Quantity


@dataclass(frozen=True)
class Change(Quantity):
    """A relative change of a parameter to its limit, below or above (side), that will end or begin (aim) a state."""

    parameter: str
    side: str
    aim: str
    state: str


@dataclass(frozen=True)
class Needed(Quantity):
    """Natural periods that a run has to last, and the time scale that asks for them."""

    scale: str


@dataclass(frozen=True)
class Answer:
    """What `answer` finds.

    runs, periods : how many there are from either start, and their natural periods after the first departure
    probability, probability_from_sliding : of stick-slip, of runs from rest and from steady sliding
    shares : of runs in stick-slip, in vibration without sticking and in steady sliding, by start
    without_scatter : state, amplitude and frequency where the motion without scatter ends, by start; None where slip
        is too stiff to follow
    starts_differ : whether shares differ by more than chance
    decided : false where they do because the runs are shorter than they need to be
    needs : natural periods that a run needs
    durations : of the states, with their rates and the share of time, from all runs
    durations_by_theory : the same by `rates`; None where the mass may vibrate without sticking, or with a memory
    amplitude, frequency : [m], [Hz] of the cycles; the amplitude is half of peak to peak. `_scatter` is their standard
        deviation
    vibration : the same four of the vibration without sticking
    limits : by names of `machine.PARAMETERS`
    smallest_changes : of one parameter, least by their factor, that end stick-slip or vibration, whichever is likely,
        or begin stick-slip; several of the same factor, or none
    decides : mean curve or scatter, as `deciding` has it
    memory : its length, critical stiffness, and friction at the departure after the usual stick; None without one
    outside_measured_speeds : whether sliding leaves the speeds at which the friction law was measured
    motion : a few periods to draw, with_scatter and without_scatter
    trials : runs in all
    """

    runs: int
    periods: Quantity
    probability: Quantity
    probability_from_sliding: Quantity
    shares: Mapping[str, Mapping[str, Quantity]]
    without_scatter: Mapping[str, Mapping[str, Any]]
    starts_differ: bool
    decided: bool
    needs: Needed
    durations: Durations
    durations_by_theory: Durations | None
    amplitude: Quantity
    amplitude_scatter: Quantity
    frequency: Quantity
    frequency_scatter: Quantity
    vibration: Mapping[str, Quantity]
    limits: Mapping[str, Limits]
    smallest_changes: tuple[Change, ...]
    decides: Mapping[str, Any]
    memory: Mapping[str, Quantity] | None
    outside_measured_speeds: bool
    motion: Mapping[str, Curve]
    trials: int
