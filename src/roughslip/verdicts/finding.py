"""A number judged by its rule."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

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
