"""A number judged by its rule, and rules as plain numbers: the ends between which a statement wants stored numbers.

Each family of statements holds its own rules. How many strips would decide a statement follows from them too: intervals
narrow by 1 / sqrt(n) around the numbers as they are.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import NamedTuple

import numpy as np

REPRODUCED, CONTRADICTED, UNDECIDED = "reproduced", "contradicted", "undecided"
CONTRADICTS, NOT_TESTED = "contradicts itself", "not tested"
VERDICTS = {1: REPRODUCED, -1: CONTRADICTED, 0: UNDECIDED}
ON_THRESHOLD = 0.02  # relative distance up to which an undecided number lies on its threshold

Arrays = Mapping[str, np.ndarray]
Interval = tuple[float, float]


@dataclass(frozen=True)
class Finding:
    """Our number on a statement with its 95 % interval.

    note : what the number is, and others that belong to it
    rule : verdict on an interval of this number, as that of `inside`
    thresholds : of the rule for this number, at which that changes; infinite without one
    other, combine : a second number of the rule, and the verdict from what the rules give for both
    contradicts : whether another number of the paper is at odds with the statement
    at : the same number judged with so many times the tolerance of its rule; None for a rule without one
    """

    ours: float
    interval: Interval
    note: str
    rule: Callable[[Interval], int]
    thresholds: tuple[float, ...] = ()
    other: Finding | None = None
    combine: Callable[[int, int], int] = min
    contradicts: bool = False
    at: Callable[[float], Finding] | None = None

    @property
    def verdict(self) -> str:
        """The verdict of the whole rule."""
        return CONTRADICTS if self.contradicts else VERDICTS[self.holds(self.interval)]

    def with_tolerance(self, factor: float) -> Finding | None:
        """The finding with so many times the tolerance in both numbers of the rule; None where neither has one."""
        if self.at is None and (self.other is None or self.other.at is None):
            return None
        own = self.at(factor) if self.at else self
        if own.other is None and self.other is not None:
            return replace(own, other=self.other.with_tolerance(factor) or self.other, combine=self.combine)
        return own

    def holds(self, interval: Interval) -> int:
        """What the whole rule says if our number had this interval."""
        return self.combine(self.rule(interval), self.other.rule(self.other.interval) if self.other else 1)

    @property
    def near_threshold(self) -> float | None:
        """The threshold that our number lies on, and its interval holds, if there is one."""
        low, high = self.interval
        for threshold in self.thresholds:
            if abs(threshold - self.ours) <= ON_THRESHOLD * abs(threshold) < np.inf and low <= threshold <= high:
                return threshold
        return None


def inside(interval: Interval, low: float = -np.inf, high: float = np.inf) -> int:
    """1 for an interval inside [low, high], -1 for one outside, 0 for one that reaches both sides and decides nothing.

    The least of several numbers is their conjunction, the largest their disjunction (Kleene's logic).
    """
    if low < interval[0] and interval[1] < high:
        return 1
    return -1 if interval[1] <= low or high <= interval[0] else 0


def number(arrays: Arrays, name: str, *index: int) -> tuple[float, Interval]:
    """A stored number with its interval."""
    value, low, high = (float(np.asarray(arrays[name + suffix])[index]) for suffix in ("", "_low", "_high"))
    return value, (low, high)


def judged_inside(
    stored: tuple[float, Interval],
    note: str = "",
    low: float = -np.inf,
    high: float = np.inf,
    centre: float | None = 0.0,
) -> Finding:
    """The rule that wants the interval of one stored number between low and high.

    centre : from which the tolerance of the rule is measured; None for limits that are no tolerance
    """
    at = None
    if centre is not None and any(np.isfinite(end) and end != centre for end in (low, high)):

        def at(factor: float) -> Finding:
            minimum, maximum = (centre + factor * (end - centre) for end in (low, high))
            return judged_inside(stored, note, minimum, maximum, centre)

    return Finding(*stored, note, partial(inside, low=low, high=high), (low, high), at=at)


MEDIAN, EVERY, TREND = "median", "every level", "trend"


class Bound(NamedTuple):
    """Ends between which a number lies.

    name : of the stored number
    at : the MEDIAN or EVERY level; TREND for a number of all levels, which a single one does not have
    low, high : the ends, None where open
    centre : from which the tolerance is measured
    share_of : number by level, of whose mean the ends are shares; empty for ends in the unit of the number
    """

    name: str
    at: str
    low: float | None = None
    high: float | None = None
    centre: float = 0.0
    share_of: str = ""


Bounds = Sequence[Bound]
"""Of one rule: one number, or two that both must lie between their ends."""


def median(friction: Arrays) -> int:
    """Number of the level at median penetration."""
    return int(np.flatnonzero(friction["percentile"] == 50.0)[0])


def at_median(friction: Arrays, name: str) -> tuple[float, Interval]:
    """A combined statistic at median penetration, with its interval."""
    return number(friction, f"combined_{name}", median(friction))


def judged(friction: Arrays, bounds: Bounds) -> Finding | None:
    """The rule of these bounds; None where its number does not exist, at one penetration alone."""
    place = bounds[0].at
    if place == TREND and len(friction["percentile"]) == 1:
        return None
    return _at_every_level(friction, bounds) if place == EVERY else judged_at(friction, bounds, median(friction))


def judged_at(friction: Arrays, bounds: Bounds, level: int) -> Finding:
    """The same at one level."""
    first, *others = (_judged_one(friction, bound, level) for bound in bounds)
    return replace(first, other=others[0]) if others else first


def _judged_one(friction: Arrays, bound: Bound, level: int) -> Finding:
    stored = number(friction, bound.name, *(() if bound.at == TREND else (level,)))
    unit = float(np.mean(friction[bound.share_of])) if bound.share_of else 1.0
    low = -np.inf if bound.low is None else unit * bound.low
    high = np.inf if bound.high is None else unit * bound.high
    return judged_inside(stored, low=low, high=high, centre=bound.centre)


def farthest(friction: Arrays, bounds: Bounds) -> int:
    """Number of the level whose first number has the largest upper end."""
    return int(np.argmax(friction[f"{bounds[0].name}_high"]))


def say_of_levels(friction: Arrays, bounds: Bounds, factor: float = 1.0) -> list[int]:
    """What the bounds say of each level, with so many times their tolerance."""
    levels = [judged_at(friction, bounds, level) for level in range(len(friction["percentile"]))]
    return [finding.holds(finding.interval) for finding in (level.with_tolerance(factor) or level for level in levels)]


def _at_every_level(friction: Arrays, bounds: Bounds, factor: float = 1.0) -> Finding:
    shown, says = farthest(friction, bounds), say_of_levels(friction, bounds, factor)
    others = min([*says[:shown], *says[shown + 1 :]], default=1)
    there = judged_at(friction, bounds, shown)
    at = partial(_at_every_level, friction, bounds)
    return replace(there.with_tolerance(factor) or there, combine=lambda *here: min(*here, others), at=at)


STEP = 1.1  # of one number of strips over the one before
STEPS = 72  # to a thousand times the strips


def with_more_samples(arrays: Arrays, factor: float) -> dict[str, np.ndarray]:
    """Results of so many times the samples, in first order: the same numbers, their intervals over sqrt(factor)."""
    foreseen = dict(arrays)
    for name in (name for name in arrays if f"{name}_low" in arrays):
        for close in (f"{name}_low", f"{name}_high"):
            foreseen[close] = arrays[name] + (arrays[close] - arrays[name]) / np.sqrt(factor)
    return foreseen


def _is_settled(finding: Finding | None) -> bool:
    """Whether a statement is decided, or lies on its threshold, or cannot be tested."""
    if finding is None or not np.isfinite([finding.ours, *finding.interval]).all():
        return True
    if finding.contradicts or finding.holds(finding.interval):
        return True
    return any(number.near_threshold is not None for number in (finding, finding.other) if number is not None)


def strips_that_decide(friction: Arrays, strips: int, rules: Mapping[str, Bounds]) -> dict[str, int]:
    """Strips that would decide each statement that is undecided off its threshold, its numbers as they are.

    Searched among 1, STEP, STEP^2, ... times the strips. Intervals of more strips lie within those of fewer, so that a
    decided statement stays so; one that STEP^STEPS times as many leave undecided has none.
    """
    at = cache(lambda power: with_more_samples(friction, STEP**power))

    def settles(rule: Bounds, power: int) -> bool:
        return _is_settled(judged(at(power), rule))

    needed = {}
    for name, rule in rules.items():
        if not settles(rule, 0):
            power = bisect_left(range(STEPS), True, lo=1, key=partial(settles, rule))
            if power < STEPS:
                needed[name] = math.ceil(strips * STEP**power)
    return needed
