"""Figure 3: mean, standard deviation and coefficient of variation of friction fall with penetration."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from roughslip.verdicts.finding import (
    TREND,
    Arrays,
    Bound,
    Bounds,
    Finding,
    Interval,
    inside,
    judged,
    judged_inside,
)
from roughslip.verdicts.reading import Reading, Statement

ONE_LEVEL = "the scene has one penetration only"
FALL = "section 4: mean, standard deviation and coefficient of variation “decrease with increasing penetration depth”"
BOUNDS: dict[str, Bounds] = {
    f"fig3-{name}-decreases": [Bound(f"trend_combined_{key}_{part}", TREND, high=0.0) for part in ("change", "line")]
    for name, key in (("mean", "mean"), ("std", "std"), ("cov", "variation"))
}


def _over_all_levels(friction: Arrays, name: str, key: str, title: str) -> Finding | str:
    finding, values = judged(friction, BOUNDS[name]), friction[f"combined_{key}"]
    if finding is None or finding.other is None:
        return ONE_LEVEL
    note = f"change of the {title} from the first to the last level, from {values[0]:.3g} to {values[-1]:.3g}"
    return replace(finding, note=note, other=replace(finding.other, note="change along a straight line"))


def _every_step(friction: Arrays, key: str, title: str) -> Finding | str:
    """The errors of neighbouring levels are taken as independent; they rise and fall together, so this is wide."""
    value, low, high = (friction[f"combined_{key}{end}"] for end in ("", "_low", "_high"))
    if len(value) == 1:
        return ONE_LEVEL
    steps = np.diff(value)
    below = np.hypot(value[1:] - low[1:], high[:-1] - value[:-1])
    above = np.hypot(high[1:] - value[1:], value[:-1] - low[:-1])
    ends = list(zip((steps - below).tolist(), (steps + above).tolist(), strict=True))
    worst = int(np.argmax(steps + above))
    others = min((inside(interval, high=0.0) for row, interval in enumerate(ends) if row != worst), default=1)
    percentile = friction["percentile"]
    note = (
        f"largest change of the {title} in a step, from percentile {percentile[worst]:g} to {percentile[worst + 1]:g}"
    )

    def rule(interval: Interval) -> int:
        return min(inside(interval, high=0.0), others)

    return Finding(float(steps[worst]), ends[worst], note, rule, (0.0,))


def _by_sums(friction: Arrays) -> Finding | str:
    """The last less the first level; their errors are taken as independent, so this is wide."""
    value, low, high = (friction[f"ratio_of_sums{end}"] for end in ("", "_low", "_high"))
    if len(value) == 1:
        return ONE_LEVEL
    change = float(value[-1] - value[0])
    below = float(np.hypot(value[-1] - low[-1], high[0] - value[0]))
    above = float(np.hypot(high[-1] - value[-1], value[0] - low[0]))
    note = (
        f"change of all areas over all forces from the first to the last level, from {value[0]:.3g} to {value[-1]:.3g}"
    )
    return judged_inside((change, (change - below, change + above)), note, high=0.0)


SUMS = Reading(
    "sums",
    "sum of the areas over sum of the forces of all windows, so that each window weighs as its force",
    "section 4: “A_c and the normal force N are obtained by averaging the pressure field”; the weights are not stated",
    "the interval of the last less the first level lies below zero",
    _by_sums,
)


def _statement(name: str, key: str, title: str) -> Statement:
    return Statement(
        name,
        f"The {title} decreases with penetration",
        "decreases",
        (
            Reading(
                "over-all-levels",
                "change from the first to the last penetration, and along a straight line through all",
                FALL,
                "the intervals of the change along a straight line over penetration and of the last less the first "
                "level both lie below zero",
                partial(_over_all_levels, name=name, key=key, title=title),
                natural="the sentence is of the whole range of penetrations",
            ),
            Reading(
                "every-step",
                "change from each penetration to the next",
                f"{FALL}, at every one",
                "the interval of every change from a level to the next lies below zero",
                partial(_every_step, key=key, title=title),
            ),
            *((SUMS,) if key == "mean" else ()),
        ),
    )


STATEMENTS = (
    _statement("fig3-mean-decreases", "mean", "mean friction coefficient"),
    _statement("fig3-std-decreases", "std", "standard deviation"),
    _statement("fig3-cov-decreases", "variation", "coefficient of variation"),
)
