"""What would turn a verdict, and the range of a number over which an answer stays the same.

The range is found by a search outwards in steps, then by bisection.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from roughslip.errors import ParameterError, real
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


REACH = 10.0
STEPS = 24  # to REACH: 10 % apart
ACCURACY = 1e-6  # relative, of an end

Answer = Callable[[float], Hashable | None]


@dataclass(frozen=True)
class End:
    """One end of a range.

    last_same : the farthest value up to which the answer is known to be the same
    first_different : the nearest one beyond whose answer is known to be another; None where there is none within reach
    """

    last_same: float
    first_different: float | None


def range_end(answer: Answer, start: float, reach: float, accuracy: float = ACCURACY) -> End:
    """The end of the range around `start` towards `reach`, both positive.

    answer : of a value; None where it is unknown
    accuracy : relative, of both numbers of the end

    Between two steps an answer is taken to change once at most. Raises ParameterError where the answer at the start
    is unknown, or where start and reach are not finite and positive.
    """
    if not all(math.isfinite(value) and value > 0.0 for value in (real("start", start), real("reach", reach))):
        raise ParameterError(f"a range is searched between finite positive numbers, not from {start} to {reach}")
    own = answer(start)
    if own is None:
        raise ParameterError(f"the answer at the start value {start:g} is unknown, so no range begins there")
    values = [start, *(float(value) for value in np.geomspace(start, reach, STEPS + 1)[1:])]
    last_same, left = start, True
    for before, value in pairwise(values):
        here = answer(value)
        if left and here != own:
            last_same, _ = _bisected(lambda trial: answer(trial) == own, before, value, accuracy)
            left = False
        if here not in (None, own):
            return End(last_same, _bisected(lambda trial: answer(trial) in (None, own), before, value, accuracy)[1])
    return End(values[-1] if left else last_same, None)


def _bisected(holds: Callable[[float], bool], inside: float, outside: float, accuracy: float) -> tuple[float, float]:
    """Two numbers next to each other, of which the first holds and the second does not, as `inside` and `outside`."""
    while abs(outside / inside - 1.0) > accuracy:
        middle = math.sqrt(inside * outside)
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return inside, outside
