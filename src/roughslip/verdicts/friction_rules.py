"""The rules of the statements on friction, in numbers alone: they judge final statistics, and what a pilot foresees.

Strips are added where a rule leaves a statement undecided (`strips.py`). So no text stands here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from roughslip.verdicts.finding import Arrays, Finding, Interval, judged_inside, number
from roughslip.verdicts.thresholds import (
    BETA_KURTOSIS,
    BETA_SKEWNESS,
    PAPER_LENGTH,
    SAME_LENGTH,
    SKEWNESS_RANGE,
    VISIBLE,
)


def median(friction: Arrays) -> int:
    """Number of the level at median penetration."""
    return int(np.flatnonzero(friction["percentile"] == 50.0)[0])


def at_median(friction: Arrays, name: str) -> tuple[float, Interval]:
    """A combined statistic at median penetration, with its interval."""
    return number(friction, f"combined_{name}", median(friction))


def _decreases(friction: Arrays, key: str) -> Finding | None:
    if len(friction["percentile"]) == 1:
        return None
    change, line = (number(friction, f"trend_combined_{key}_{part}") for part in ("change", "line"))
    return replace(judged_inside(change, high=0.0), other=judged_inside(line, "change along a straight line", high=0.0))


def _exponential(friction: Arrays) -> Finding:
    return judged_inside(at_median(friction, "misfit_difference"), high=0.0)


def paper_length(friction: Arrays, name: str) -> Finding:
    """Whether a length at median penetration is the paper's."""
    low, high = PAPER_LENGTH * (1 - SAME_LENGTH), PAPER_LENGTH * (1 + SAME_LENGTH)
    return judged_inside(at_median(friction, name), low=low, high=high, centre=PAPER_LENGTH)


def length_at_any_depth(friction: Arrays, name: str) -> Finding | None:
    """Whether a length stays the same over penetration; None at one penetration."""
    lengths = friction[f"combined_{name}"]
    if len(lengths) == 1:
        return None
    allowed = SAME_LENGTH * float(np.mean(lengths))
    return judged_inside(number(friction, f"trend_combined_{name}_line"), low=-allowed, high=allowed)


def _right_skewed(friction: Arrays) -> Finding:
    return judged_inside(at_median(friction, "skewness"), low=0.0)


def _leptokurtic(friction: Arrays) -> Finding:
    return replace(judged_inside(at_median(friction, "kurtosis"), low=0.0), contradicts=BETA_KURTOSIS < 0)


def like_beta(friction: Arrays, level: int) -> Finding:
    """Whether windows at a level have the shape of the paper's Beta; by the distance alone the normal would pass."""
    distance = number(friction, "beta_distance_standardised", level)
    skewness = number(friction, "combined_skewness", level)
    of_skewness = judged_inside(skewness, "skewness", *SKEWNESS_RANGE, centre=BETA_SKEWNESS)
    return replace(judged_inside(distance, high=VISIBLE), other=of_skewness)


def _beta(friction: Arrays) -> Finding:
    return like_beta(friction, median(friction))


def farthest(friction: Arrays) -> int:
    """Number of the level whose distance from the Beta has the largest upper end."""
    return int(np.argmax(friction["beta_distance_standardised_high"]))


def follows_beta(friction: Arrays, factor: float = 1.0) -> list[int]:
    """What the rule for the Beta says of each level, with so many times its tolerance."""
    levels = [like_beta(friction, level).with_tolerance(factor) for level in range(len(friction["percentile"]))]
    return [one.holds(one.interval) for one in levels if one is not None]


def _beta_at_any_depth(friction: Arrays, factor: float = 1.0) -> Finding:
    shown, follows = farthest(friction), follows_beta(friction, factor)
    others = min([*follows[:shown], *follows[shown + 1 :]], default=1)
    there = like_beta(friction, shown).with_tolerance(factor)
    assert there is not None  # the rule for the Beta has a tolerance
    at = partial(_beta_at_any_depth, friction)
    return replace(there, joined=lambda *here: min(*here, others), at=at)


FrictionRule = Callable[[Arrays], Finding | None]
FRICTION_RULES: dict[str, FrictionRule] = {
    "fig3-mean-decreases": partial(_decreases, key="mean"),
    "fig3-std-decreases": partial(_decreases, key="std"),
    "fig3-cov-decreases": partial(_decreases, key="variation"),
    "mu-correlation-exponential": _exponential,
    "mu-correlation-250um": partial(paper_length, name="length_least_squares"),
    "mu-correlation-any-depth": partial(length_at_any_depth, name="length_least_squares"),
    "mu-right-skewed": _right_skewed,
    "mu-leptokurtic": _leptokurtic,
    "mu-beta-2.1-5": _beta,
    "mu-beta-any-depth": _beta_at_any_depth,
}
"""By statement its rule; None where it has no number, at one penetration alone."""
