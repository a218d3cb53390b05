"""Rules as plain numbers: the ends between which a statement wants stored numbers.

Each family of statements holds its own. They judge final statistics and what a pilot foresees. The stage that asks
for strips is given them in its key file, so it does not depend on any text.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from roughslip.verdicts.finding import Arrays, Finding, Interval, judged_inside, number

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
