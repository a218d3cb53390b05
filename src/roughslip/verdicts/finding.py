"""A number judged by its rule: the verdict, and what would turn it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from roughslip.verdicts.statements import UNITLESS, UNITS

REPRODUCED, CONTRADICTED, UNDECIDED = "reproduced", "contradicted", "undecided"
CONTRADICTS, NOT_TESTED = "contradicts itself", "not tested"
VERDICTS = {1: REPRODUCED, -1: CONTRADICTED, 0: UNDECIDED}
ON_THRESHOLD = 0.02  # relative distance up to which an undecided number lies on its threshold
BEYOND = 1e-12  # step with which an interval passes a threshold; the smallest numbers judged are lengths in metres

Interval = tuple[float, float]


@dataclass(frozen=True)
class Finding:
    """Our number on a statement with its 95 % interval.

    note : what the number is, and others that belong to it
    says : what the rule says of an interval of this number, as `inside` does
    thresholds : of the rule for this number, at which that changes; infinite without one
    other, joined : a second number of the rule, and the verdict from what the rule says of both
    contradicts : whether another number of the paper is at odds with the statement
    """

    ours: float
    interval: Interval
    note: str
    says: Callable[[Interval], int]
    thresholds: tuple[float, ...] = ()
    other: Finding | None = None
    joined: Callable[[int, int], int] = min
    contradicts: bool = False

    def holds(self, interval: Interval) -> int:
        """What the whole rule says if our number had this interval."""
        return self.joined(self.says(interval), self.other.says(self.other.interval) if self.other else 1)


def inside(interval: Interval, low: float = -np.inf, high: float = np.inf) -> int:
    """1 for an interval inside [low, high], -1 for one outside, 0 for one that reaches both sides and decides nothing.

    The least of several numbers is their conjunction, the largest their disjunction (Kleene's logic).
    """
    if low < interval[0] and interval[1] < high:
        return 1
    return -1 if interval[1] <= low or high <= interval[0] else 0


def in_unit(name: str, number: float) -> str:
    """A number of a statement in the unit that a reader uses."""
    _, scale, unit = UNITS.get(name, UNITLESS)
    return f"{scale * number:.3g}{unit}"


def what_turns(name: str, found: Finding) -> str:
    """What would turn the verdict: another interval of our number, else of the second number of the rule."""
    if found.contradicts:
        return "another number in the paper"
    text = _turning(name, found)
    if not text and found.other and (text := _turning("", replace(found.other, other=found, joined=found.joined))):
        text = f"{found.other.note}: {text}"
    return text or "other numbers of the rule, or several at once"


def _turning(name: str, found: Finding) -> str:
    """The nearest interval of one number for which the rule says something else; empty without one.

    Of a decided verdict it moves with its number, of an undecided one it narrows around it. A width is asked for and
    not samples: part of it may not fall with those of the scene.
    """
    ours, (low, high), now = found.ours, found.interval, found.holds(found.interval)
    limits = [limit for limit in found.thresholds if np.isfinite(limit) and (now or low <= limit <= high)]
    ends = [(end, limit) for limit in limits for end in (low, high)]
    if now:
        for size, move, limit in sorted((abs(limit - end), limit - end, limit) for end, limit in ends):
            if any(found.holds((low + move + step, high + move + step)) != now for step in (-BEYOND, BEYOND)):
                far = in_unit(name, size).replace("%", "percentage points")
                return f"an interval {far} {'higher' if move > 0 else 'lower'}, which reaches {in_unit(name, limit)}"
        return ""
    for limit in limits:
        if abs(limit - ours) <= ON_THRESHOLD * abs(limit):
            return f"nothing, it lies within {ON_THRESHOLD:.0%} of the threshold {in_unit(name, limit)}"
    for times in sorted((end - ours) / (limit - ours) * (1 + BEYOND) for end, limit in ends):
        if times > 1 and (then := found.holds((ours + (low - ours) / times, ours + (high - ours) / times))):
            return f"an interval {times:.3g} times as narrow around the same number, then {VERDICTS[then]}"
    return ""
