"""What would turn a verdict."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from roughslip.verdicts.finding import ON_THRESHOLD, VERDICTS, Finding

BEYOND = 1e-12  # step with which an interval passes a threshold; the smallest numbers judged are lengths in metres


class Unit(NamedTuple):
    """Unit of a number, the factor to the one that a reader uses, and how that is written after a number."""

    name: str
    scale: float
    after: str


UNITLESS, SHARE = Unit("1", 1.0, ""), Unit("1", 100.0, " %")


def in_unit(unit: Unit, number: float) -> str:
    """A number in the unit that a reader uses."""
    return f"{unit.scale * number:.3g}{unit.after}"


def what_turns(unit: Unit, finding: Finding) -> str:
    """What would turn the verdict: another interval of our number, else of the second number of the rule."""
    if finding.contradicts:
        return "another number in the paper"
    text = _turning(unit, finding)
    if (
        not text
        and finding.other
        and (text := _turning(UNITLESS, replace(finding.other, other=finding, combine=finding.combine)))
    ):
        text = f"{finding.other.note}: {text}"
    return text or "other numbers of the rule, or several at once"


def _turning(unit: Unit, finding: Finding) -> str:
    """The nearest interval of one number for which the rule says something else; empty without one.

    Of a decided verdict it moves with its number, of an undecided one it narrows around it. A width is asked for and
    not samples: part of it may not fall with those of the scene.
    """
    ours, (low, high), now = finding.ours, finding.interval, finding.holds(finding.interval)
    limits = [limit for limit in finding.thresholds if np.isfinite(limit) and (now or low <= limit <= high)]
    ends = [(end, limit) for limit in limits for end in (low, high)]
    if now:
        for size, move, limit in sorted((abs(limit - end), limit - end, limit) for end, limit in ends):
            if any(finding.holds((low + move + step, high + move + step)) != now for step in (-BEYOND, BEYOND)):
                far = in_unit(unit, size).replace("%", "percentage points")
                return f"an interval {far} {'higher' if move > 0 else 'lower'}, which reaches {in_unit(unit, limit)}"
        return ""
    if finding.near_threshold is not None:
        return f"nothing, it lies within {ON_THRESHOLD:.0%} of the threshold {in_unit(unit, finding.near_threshold)}"
    for times in sorted((end - ours) / (limit - ours) * (1 + BEYOND) for end, limit in ends):
        if times > 1 and (then := finding.holds((ours + (low - ours) / times, ours + (high - ours) / times))):
            return f"an interval {times:.3g} times as narrow around the same number, then {VERDICTS[then]}"
    return ""
