"""The budget of an answer: how sure stick-slip and its limits are, and which uncertain input decides that.

Given the inputs x, stick-slip at a random time is a matter of chance, with a probability p(x). By the law of total
variance that of the outcome, 0 or 1, with P = E[p], is

    P (1 - P) = E[p (1 - p)] + Var p(x).

The first part is the scatter of friction, which no knowledge of the inputs takes away. The second one is split by
sources as in `probability.estimate`. The limits depend on the inputs alone, and all of their variance is split.

Limits are those of the cycle without scatter, searched anew at each draw. Scatter blurs that in damping, D*: to first
order by b = sigma s(L), as `grazing` has it. The shape of the grazing orbit is held as at the given values, so that

    b ~ sigma (F / V) s(L / V),      p = Phi((D* + c - D) / (w b)),

with c and w from the band of damping in which chance decides at the given values. Without a band c = 0 and w = 1. The
shift c is held: many loops that each may fail lower the band, and friction that quick slip meets sooner raises it.

With a memory of the contact there is no first order. Then s is held, and without a band p is 0 or 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy  # its parts when they are used

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.oscillator.attractors import vibration_limit
from roughslip.oscillator.grazing import grazing_response
from roughslip.oscillator.limits import SlipLoop, existence_limit, slip_loop
from roughslip.oscillator.machine import Machine, cycle_exists
from roughslip.oscillator.memory_law import MemoryLaw
from roughslip.probability.estimate import TAILS, Source, Split, variance_split
from roughslip.probability.search import first_change
from roughslip.validation import gate, positive

LIMITS = ("damping", "belt_velocity", "load")
LEVEL = float(scipy.special.ndtri(0.95))  # of the ends of a band
FIRST_REACH, REACH = 100.0, 10.0  # factors up to which a limit is searched: from the given value, and from its limit
SECANTS, STEP_ACCURACY = 12, 1e-8  # of a limit at a draw, three of which are usual; relative, of a step of slip
ACCURACY = 1e-3  # relative, of a limit at a draw: with its even error it adds less than (1e-3)^2 to the variance
POWERS = 4  # of two: of L / V at which the blur is computed, either way; power laws between
VIBRATION = "vibration"  # as a limit
LEAST_BLUR = 1e-9  # of the limit: without scatter the probability is 0 or 1


@dataclass(frozen=True)
class Uncertain:
    """A result of uncertain inputs.

    value : at the given values
    mean, standard_uncertainty, interval : over the inputs; the interval holds 95 %
    beyond : share of draws whose value lies beyond the search, and is taken as its end
    first, total : Sobol' indices by source, (value, low, high)
    """

    value: float
    mean: float
    standard_uncertainty: float
    interval: tuple[float, float]
    beyond: float
    first: Mapping[str, tuple[float, float, float]]
    total: Mapping[str, tuple[float, float, float]]


@dataclass(frozen=True)
class Budget:
    """What `uncertainty_budget` finds.

    probability : of stick-slip, given the inputs; its mean is that over all that is uncertain
    scatter : E[p (1 - p)] over the variance of the outcome; 0 where that has none
    outcome : the parts of the variance of the outcome that exact knowledge of each source would take away, as (value,
        low, high), with the error of the index
    limits : of the cycle without scatter, by names of `machine.PARAMETERS`; those that exist at the given values. And
        VIBRATION, the damping ratio up to which a mass that does not stick vibrates, where it does at the given values
    """

    probability: Uncertain
    scatter: float
    outcome: Mapping[str, tuple[float, float, float]]
    limits: Mapping[str, Uncertain]


@gate
def uncertainty_budget(
    machine: Callable[[Mapping[str, float]], Machine],
    sources: Sequence[Source],
    band: tuple[float, float] | None = None,
    limits: Sequence[str] = LIMITS,
    samples: int = 128,
    seed: Sequence[int] = (0,),
) -> Budget:
    """How sure stick-slip and its limits are, and what part each source of uncertainty has in that.

    machine : of values of all inputs by name
    band : damping ratios of 95 % and of 5 % stick-slip at the given values, as `answer` finds them
    limits : of damping, belt_velocity, mass, stiffness, load; damping is among them where it has one
    samples : a power of two; the machine is made (sources + 2) samples times

    Without a limit in damping at the given values, as of a law without a cycle, the probability is 0 or 1, as the cycle
    without scatter exists. Raises ParameterError with excitation.
    """
    if band is not None and not band[0] < band[1]:
        raise ParameterError(f"band must be damping ratios of 95 % and of 5 % stick-slip, rising, not {band}")
    given = machine({name: value for source in sources for name, value in source.values.items()})
    chance, searched, limit = None, dict[str, _Limit](), math.nan
    with suppress(IllPosedError, ConvergenceError):
        limit = existence_limit(given.oscillator, given.law)
        chance = _Chance(given, limit, band)
        searched["damping"] = _at_limit(given, "damping", limit, True)
    for name in (name for name in limits if name != "damping"):
        if (near := _nearest_limit(given, name)) is not None:
            searched[name] = near
    beyond, vibration = dict.fromkeys(searched, 0), vibration_limit(given, None if chance is None else limit)

    def probability(here: Machine, limit: float) -> float:
        return float(cycle_exists(here) is True) if chance is None else chance.probability(here, limit)

    def results(values: Mapping[str, float]) -> list[float]:
        here, found = machine(values), {}
        for name, near in searched.items():
            found[name], is_inside = _limit(here, near)
            beyond[name] += not is_inside
        limit = found.get("damping")
        if vibration is not None:  # at draws without a vibration it ends where sticking does
            found[VIBRATION] = vibration_limit(here, limit, ACCURACY) or limit or 0.0
        return [probability(here, math.nan if limit is None else limit), *found.values()]

    split = variance_split(results, sources, samples, seed)
    calls = max(samples * (len(sources) + 2), 1) if sources else 1
    at_given = {name: near.value for name, near in searched.items()}
    at_given |= {} if vibration is None else {VIBRATION: vibration}
    own = [probability(given, limit), *at_given.values()]
    shares = [0.0, *(beyond.get(name, 0) / calls for name in at_given)]
    names = [source.name for source in sources]
    found = [_uncertain(split, row, own[row], shares[row], names) for row in range(len(own))]
    p = split.drawn[0]
    variance = float(np.mean(p) * (1.0 - np.mean(p)))
    part = float(np.var(p)) / variance if variance > 0.0 else 0.0
    return Budget(
        probability=found[0],
        scatter=float(np.mean(p * (1.0 - p))) / variance if variance > 0.0 else 0.0,
        outcome={name: (part * np.clip(first, 0.0, 1.0)).tolist() for name, first in found[0].first.items()},
        limits=dict(zip(at_given, found[1:], strict=True)),
    )


class _Chance:
    """The probability of stick-slip at some inputs, from the limit in damping there."""

    def __init__(self, given: Machine, limit: float, band: tuple[float, float] | None) -> None:
        response = None if isinstance(given.law, MemoryLaw) else grazing_response(given)

        @cache
        def scatter(power: int) -> float:
            """Of the limit for mu_S of unit variance, whose correlation is 2^power times as long."""
            if response is None:
                return LEAST_BLUR
            return response.scatter(lambda lag: given.scattering.autocorrelation(lag / 2.0**power))

        self._given, self._scatter, own = given, scatter, scatter(0)
        self._width = max(positive("the deviation of mu_S", given.scattering.path_deviation) * own, LEAST_BLUR * limit)
        self._shift = 0.0
        if band is not None:
            self._shift = 0.5 * (band[0] + band[1]) - limit
            self._width = (band[1] - band[0]) / (2.0 * LEVEL)

    def probability(self, here: Machine, limit: float) -> float:
        """Of stick-slip. limit : of the cycle in damping"""
        distance = limit - here.oscillator.damping_ratio + self._shift
        return float(scipy.special.ndtr(distance / (self._factor(here) * self._width)))

    def _factor(self, here: Machine) -> float:
        """The blur over that of the given machine."""
        belt, own = here.oscillator, self._given.oscillator
        friction, given = here.scattering, self._given.scattering
        ratio = friction.correlation_length_m / given.correlation_length_m * own.V / belt.V
        place = min(max(math.log2(ratio), -POWERS), POWERS)
        low = min(math.floor(place), POWERS - 1)
        less, more = (self._scatter(power) / self._scatter(0) for power in (low, low + 1))
        of_length = less ** (low + 1 - place) * more ** (place - low)
        return friction.path_deviation / given.path_deviation * (belt.F / belt.V) / (own.F / own.V) * of_length


def _loop(machine: Machine, name: str, value: float) -> SlipLoop | None:
    """The first loop of slip with one parameter at another value; None where it is too stiff."""
    changed = machine.changed({name: value})
    try:
        return slip_loop(changed.oscillator, changed.law, STEP_ACCURACY)
    except ConvergenceError:
        return None


def _existence(machine: Machine, name: str) -> Callable[[float], bool | None]:
    """Whether the cycle exists, as a function of one parameter."""

    def exists(value: float) -> bool | None:
        loop = _loop(machine, name, value)
        return None if loop is None else loop.cycle is not None

    return exists


@dataclass(frozen=True)
class _Limit:
    """A limit of the cycle along a parameter of the given machine.

    value : its place; cycle_below : whether the cycle exists below it
    rate : of the excess of the peak of slip over the belt, by the logarithm of the parameter
    """

    name: str
    value: float
    cycle_below: bool
    rate: float


def _nearest_limit(given: Machine, name: str) -> _Limit | None:
    """The limit of the cycle nearest to the given value of a parameter, if there is one."""
    exists, own = _existence(given, name), given.value(name)
    here = exists(own) if own > 0.0 else None
    if here is None:
        return None
    ends = {up: first_change(exists, own, own * FIRST_REACH**way)[1] for up, way in ((True, 1), (False, -1))}
    found = [(value, here == up) for up, value in ends.items() if value is not None]
    nearest = min(found, key=lambda one: abs(math.log(one[0] / own)), default=None)
    return None if nearest is None else _at_limit(given, name, *nearest)


def _at_limit(given: Machine, name: str, value: float, cycle_below: bool) -> _Limit:
    """A limit with its rate."""
    loops = [_loop(given, name, value * math.exp(step)) for step in (-ACCURACY, ACCURACY)]
    less, more = (math.nan if loop is None else loop.excess for loop in loops)
    return _Limit(name, value, cycle_below, (more - less) / (2.0 * ACCURACY))


def _limit(machine: Machine, near: _Limit) -> tuple[float, bool]:
    """The limit of the cycle of another machine, from that of the given one on; and whether there is one in reach.

    By secants of the excess of the peak. The cycle has to exist on one side and not on the other, half of ACCURACY
    apart. Else steps outwards and bisection find the limit.
    """
    exists, place, rate, before = _existence(machine, near.name), math.log(near.value), near.rate, None
    for _ in range(SECANTS):
        loop = _loop(machine, near.name, math.exp(place))
        if loop is None or (before is not None and loop.excess == before[1]):
            break
        if before is not None:
            rate = (loop.excess - before[1]) / (place - before[0])
        step = -loop.excess / rate if rate else math.nan
        if not abs(place + step - math.log(near.value)) < math.log(REACH):
            break
        if abs(step) < 0.5 * ACCURACY:
            beyond = place + step + math.copysign(0.5 * ACCURACY, step)
            if exists(math.exp(beyond)) == (loop.cycle is None):
                return math.exp(place + step), True
            break
        before, place = (place, loop.excess), place + step
    here = exists(near.value)
    if here is None:
        return near.value, False
    reach = near.value * REACH if here == near.cycle_below else near.value / REACH
    last, first = first_change(exists, near.value, reach, ACCURACY)
    return (last, False) if first is None else (0.5 * (first + last), True)


def _uncertain(split: Split, row: int, value: float, beyond: float, names: Sequence[str]) -> Uncertain:
    drawn = split.drawn[row]
    low, high = (float(end) for end in np.quantile(drawn, TAILS))
    first, total = (
        {name: (float(one[0]), float(one[1]), float(one[2])) for name, one in zip(names, part[row], strict=True)}
        for part in (split.first, split.total)
    )
    return Uncertain(value, float(np.mean(drawn)), float(np.std(drawn)), (low, high), beyond, first, total)
