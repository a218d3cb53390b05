"""What would turn a verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from roughslip.verdicts.finding import ON_THRESHOLD, VERDICTS, Finding
from roughslip.verdicts.statements import UNITLESS, UNITS

BEYOND = 1e-12  # step with which an interval passes a threshold; the smallest numbers judged are lengths in metres


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
    if found.near_threshold is not None:
        return f"nothing, it lies within {ON_THRESHOLD:.0%} of the threshold {in_unit(name, found.near_threshold)}"
    for times in sorted((end - ours) / (limit - ours) * (1 + BEYOND) for end, limit in ends):
        if times > 1 and (then := found.holds((ours + (low - ours) / times, ours + (high - ours) / times))):
            return f"an interval {times:.3g} times as narrow around the same number, then {VERDICTS[then]}"
    return ""
