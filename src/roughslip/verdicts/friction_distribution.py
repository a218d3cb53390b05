"""The distribution of the friction coefficient: right skewed, leptokurtic, Beta(2.1, 5). Text, readings, rules."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from roughslip.friction.marginal import SAME_SKEWNESS, SET_WINDOWS, nearest_level
from roughslip.probability import beta_moments
from roughslip.verdicts.centre_pressure import shown
from roughslip.verdicts.finding import (
    EVERY,
    MEDIAN,
    Arrays,
    Bound,
    Finding,
    Interval,
    at_median,
    farthest,
    inside,
    judged,
    judged_at,
    judged_inside,
    median,
    number,
    say_of_levels,
)
from roughslip.verdicts.friction_correlation import ONE_LEVEL, window
from roughslip.verdicts.reading import VISIBLE, Reading, Statement

PAPER_BETA = (2.1, 5.0)
_, _, BETA_SKEWNESS, BETA_KURTOSIS = beta_moments(*PAPER_BETA)
SKEWNESS_RANGE = BETA_SKEWNESS * (1 - SAME_SKEWNESS), BETA_SKEWNESS * (1 + SAME_SKEWNESS)
SAME_SHAPE = 0.2  # relative difference of the shapes of two Beta distributions that would be reported as one
SHAPE = "section 4: the distribution “is found to be right skewed and leptokurtic”"
SCALED = "section 4: “when scaled to the interval (0,1) the friction coefficient follows a Beta(2.1,5)-distribution”"
ANY_DEPTH = "section 4: “independent of the penetration”"
FIGURE_2 = "Figure 2 states the median penetration, and no other is stated"
LIKE_BETA = (
    f"the interval of the Kolmogorov distance, both standardised, lies below {VISIBLE} and that of the skewness lies "
    f"from {SKEWNESS_RANGE[0]:.2f} to {SKEWNESS_RANGE[1]:.2f}, around the {BETA_SKEWNESS:.2f} of Beta(2.1, 5)"
)
IN_SETS = (
    "contradicted where a shape of the paper lies outside the 5 to 95 % of the shapes of such sets, reproduced where "
    f"also both medians lie within {SAME_SHAPE:.0%} of the paper's, else undecided"
)


def _like_beta(at: str) -> tuple[Bound, Bound]:
    """By the distance alone the normal would pass."""
    of_skewness = Bound("combined_skewness", at, *SKEWNESS_RANGE, centre=BETA_SKEWNESS)
    return Bound("beta_distance_standardised", at, high=VISIBLE), of_skewness


BOUNDS = {
    "mu-right-skewed": (Bound("combined_skewness", MEDIAN, low=0.0),),
    "mu-beta-2.1-5": _like_beta(MEDIAN),
    "mu-beta-any-depth": _like_beta(EVERY),
}
"""Of the natural readings for which strips are added; for a fourth moment they would be too many."""


def _skewness(friction: Arrays) -> Finding:
    skewness = friction["combined_skewness"]
    note = f"skewness at median penetration; over all levels {skewness.min():.2f} to {skewness.max():.2f}"
    return replace(judged_at(friction, BOUNDS["mu-right-skewed"], median(friction)), note=note)


def _at_every_level(friction: Arrays, name: str, title: str) -> Finding | str:
    """The level whose lower end is least, judged with all others."""
    value, low, high = (friction[f"combined_{name}{end}"] for end in ("", "_low", "_high"))
    if len(value) == 1:
        return ONE_LEVEL
    worst = int(np.argmin(low))
    others = min(inside((low[row], high[row]), low=0.0) for row in range(len(low)) if row != worst)
    note = f"{title} at percentile {friction['percentile'][worst]:g}, of the least lower end"

    def rule(interval: Interval) -> int:
        return min(inside(interval, low=0.0), others)

    return Finding(float(value[worst]), (float(low[worst]), float(high[worst])), note, rule, (0.0,))


def _kurtosis(friction: Arrays, by_the_beta: bool) -> Finding:
    finding = judged_inside(at_median(friction, "kurtosis"), low=0.0)
    note = f"excess kurtosis at median penetration; Beta(2.1, 5) has {BETA_KURTOSIS:.3f}"
    return replace(finding, note=note, contradicts=by_the_beta and BETA_KURTOSIS < 0)


def _beta(friction: Arrays) -> Finding:
    middle, skewness = median(friction), at_median(friction, "skewness")
    fitted = ", ".join(f"{friction[f'beta_{shape}'][middle]:.3g}" for shape in "ab")
    at_bound = friction["beta_at_bound"][middle]
    undetermined = " (at the end of the range of shapes: they are not determined)" if at_bound else ""
    note = (
        f"Kolmogorov distance; skewness {shown(skewness)}; fitted Beta({fitted}){undetermined}; "
        f"{_window_of_the_beta(friction, skewness[0])}"
    )
    return _with_notes(judged_at(friction, BOUNDS["mu-beta-2.1-5"], middle), note)


def _with_notes(finding: Finding, note: str) -> Finding:
    assert finding.other is not None  # the rule of the Beta has two numbers
    return replace(finding, note=note, other=replace(finding.other, note="skewness"))


def _window_of_the_beta(friction: Arrays, skewness: float) -> str:
    """Which window would have the skewness of the paper's Beta: that of a mean falls with the root of its window."""
    if not skewness > 0:
        return "no window would have the skewness of Beta(2.1, 5)"
    length = 1e6 * window(friction) * (skewness / BETA_SKEWNESS) ** 2
    return f"a window of {length:.0f} µm would have the skewness of Beta(2.1, 5), {BETA_SKEWNESS:.2f}"


def _at_another_level(friction: Arrays) -> Finding | str:
    if len(friction["percentile"]) == 1:
        return ONE_LEVEL
    others = friction["percentile"] != 50.0
    level = nearest_level(friction["beta_distance_standardised"], friction["combined_skewness"], others)
    tried = len(friction["percentile"]) - 1
    skewness, kurtosis = (shown(number(friction, f"combined_{name}", level)) for name in ("skewness", "kurtosis"))
    note = (
        f"Kolmogorov distance at percentile {friction['percentile'][level]:g}, the nearest of {tried}; skewness "
        f"{skewness}, excess kurtosis {kurtosis}"
    )
    return _with_notes(judged_at(friction, BOUNDS["mu-beta-2.1-5"], level), note)


def _in_sets(friction: Arrays, every_level: bool) -> Finding | str:
    levels = range(len(friction["percentile"])) if every_level else [median(friction)]
    if every_level and len(levels) == 1:
        return ONE_LEVEL
    says = {level: _shapes_say(friction, level) for level in levels}
    level = min(levels, key=lambda row: says[row])
    shapes = ", ".join(f"{friction[f'set_beta_{shape}'][level]:.2f}" for shape in "ab")
    ends = number(friction, "set_beta_b", level)
    note = (
        f"second shape with the 5 to 95 % of sets of {SET_WINDOWS} windows at percentile "
        f"{friction['percentile'][level]:g}; median shapes Beta({shapes}). The number of windows in a set makes the "
        "shapes: more windows reach farther, and the shapes grow"
    )
    return Finding(*ends, note, lambda _: says[level])


def _shapes_say(friction: Arrays, level: int) -> int:
    within, near = True, True
    for shape, paper in zip("ab", PAPER_BETA, strict=True):
        value, (low, high) = number(friction, f"set_beta_{shape}", level)
        within &= low <= paper <= high
        near &= abs(value - paper) <= SAME_SHAPE * paper
    return (1 if near else 0) if within else -1


def _beta_at_any_depth(friction: Arrays) -> Finding | str:
    bounds = BOUNDS["mu-beta-any-depth"]
    finding = judged(friction, bounds)
    if finding is None:
        return ONE_LEVEL
    follows, skewness = say_of_levels(friction, bounds), friction["combined_skewness"]
    percentile = friction["percentile"][farthest(friction, bounds)]
    note = (
        f"Kolmogorov distance at percentile {percentile:g}, of the largest upper end; "
        f"{follows.count(1)} of {len(follows)} levels follow it; skewness {skewness.min():.2f} to {skewness.max():.2f}"
    )
    return _with_notes(finding, note)


STATEMENTS = (
    Statement(
        "mu-right-skewed",
        "The friction coefficient is right skewed",
        "skewness > 0",
        (
            Reading(
                "at-the-median",
                "skewness of the windows at median penetration",
                SHAPE,
                "the interval of the skewness at median penetration lies above zero",
                _skewness,
                natural=FIGURE_2,
            ),
            Reading(
                "at-every-level",
                "skewness of the windows at every penetration",
                f"{SHAPE}, after the figure for all depths",
                "the interval of the skewness at every level lies above zero",
                partial(_at_every_level, name="skewness", title="skewness"),
            ),
        ),
    ),
    Statement(
        "mu-leptokurtic",
        "The friction coefficient is leptokurtic",
        "excess kurtosis > 0",
        (
            Reading(
                "own-kurtosis",
                "excess kurtosis of the windows at median penetration",
                SHAPE,
                "the interval of the excess kurtosis at median penetration lies above zero",
                partial(_kurtosis, by_the_beta=False),
                natural="the sentence is of the friction coefficient itself; a fitted Beta says nothing exact of a "
                "fourth moment",
            ),
            Reading(
                "at-every-level",
                "excess kurtosis of the windows at every penetration",
                f"{SHAPE}, after the figure for all depths",
                "the interval of the excess kurtosis at every level lies above zero",
                partial(_at_every_level, name="kurtosis", title="excess kurtosis"),
            ),
            Reading(
                "by-the-beta",
                "excess kurtosis of the windows, if it is also that of the Beta they are said to follow",
                f"{SHAPE}; {SCALED}",
                "the statement contradicts itself if the paper's own Beta(2.1, 5) has negative excess kurtosis; else "
                "the interval of the excess kurtosis at median penetration lies above zero",
                partial(_kurtosis, by_the_beta=True),
            ),
        ),
    ),
    Statement(
        "mu-beta-2.1-5",
        "Scaled to (0, 1) the friction coefficient follows Beta(2.1, 5)",
        "Beta(2.1, 5)",
        (
            Reading(
                "at-the-median",
                "shape of the distribution at median penetration; the ends of the scaling are free",
                SCALED,
                f"at median penetration {LIKE_BETA}",
                _beta,
                natural=FIGURE_2,
            ),
            Reading(
                "at-another-penetration",
                "the same at the penetration other than the median that lies nearest",
                f"{SCALED}; the text names no penetration here",
                f"at one of the other levels {LIKE_BETA}",
                _at_another_level,
            ),
            Reading(
                "scaled-by-sets",
                f"scaled by the extremes of sets of {SET_WINDOWS} windows, at median penetration",
                f"{SCALED}; a study of its time has some hundred windows",
                IN_SETS,
                partial(_in_sets, every_level=False),
            ),
        ),
    ),
    Statement(
        "mu-beta-any-depth",
        "It follows Beta(2.1, 5) at every penetration",
        "independent",
        (
            Reading(
                "at-every-level",
                "shape of the distribution at every penetration; the ends of the scaling are free",
                ANY_DEPTH,
                f"at every level {LIKE_BETA}",
                _beta_at_any_depth,
                natural="the sentence gives one distribution for all penetrations",
            ),
            Reading(
                "scaled-by-sets",
                f"scaled by the extremes of sets of {SET_WINDOWS} windows, at every penetration",
                f"{ANY_DEPTH}; a study of its time has some hundred windows",
                f"at every level: {IN_SETS}",
                partial(_in_sets, every_level=True),
            ),
        ),
    ),
)
