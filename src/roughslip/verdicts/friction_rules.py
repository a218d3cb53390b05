"""Rules on friction over penetration, its distribution, and its correlation along the path."""

from collections.abc import Callable

import numpy as np

from roughslip.friction.marginal import PAPER_BETA, SET_WINDOWS
from roughslip.probability import beta_moments
from roughslip.verdicts.reading import (
    LIKE_BETA,
    Arrays,
    Found,
    Judge,
    Place,
    Rule,
    Stored,
    inside,
    lies,
    number,
    row_of,
    rule,
    within,
)

PAPER_LENGTH = 250e-6  # m
SURE = 0.95  # share of single fields that show the same
SAME_LENGTH = 0.2  # relative difference of correlation lengths that would not be reported as a dependence
_, _, BETA_SKEWNESS, BETA_KURTOSIS = beta_moments(*PAPER_BETA)
STUDY_WINDOWS = 100  # of the sets of SET_WINDOWS, what a study of its time has
SAME_SHAPE = 0.2  # relative difference of the shapes of two Beta distributions that would be reported as one
MEDIAN: Place = ("percentile", 50.0)
ONE_LEVEL = "the scene has one penetration only"
NEAR_BETA = (
    f"the interval of the Kolmogorov distance, both standardised, lies below {LIKE_BETA:.4f}, half of that of the "
    "normal distribution from Beta(2.1, 5)"
)
IN_SETS = (
    "contradicted where a shape of the paper lies outside the 5 to 95 % of the shapes of such sets, reproduced where "
    f"also both medians lie within {SAME_SHAPE:.0%} of the paper's, else undecided"
)


def over_levels(text: str) -> Callable[[Judge], Rule]:
    """The rule, where the scene has several penetrations."""
    return lambda judge: Rule(text, lambda friction: ONE_LEVEL if len(friction["percentile"]) == 1 else judge(friction))


OfLevels = Callable[[Arrays, list[int]], Found]
"""What is found at some levels: the one that agrees least, by number."""


def at_the_median(text: str, judge: OfLevels) -> Rule:
    """The rule at median penetration."""
    return Rule(text, lambda friction: judge(friction, [row_of(friction, MEDIAN)]))


def at_every_level(text: str, judge: OfLevels) -> Rule:
    """The rule at every penetration."""
    return over_levels(text)(lambda friction: judge(friction, list(range(len(friction["percentile"])))))


def difference(friction: Arrays, name: str, first: int, last: int) -> Stored:
    """The last less the first level; their errors are taken as independent, so this is wide."""
    value, low, high = (friction[name + end] for end in ("", "_low", "_high"))
    change = float(value[last] - value[first])
    below = float(np.hypot(value[last] - low[last], high[first] - value[first]))
    above = float(np.hypot(high[last] - value[last], value[first] - low[first]))
    return change, (change - below, change + above)


@over_levels("areas over forces of all windows: the interval of the last less the first level lies below zero")
def sums_fall(friction: Arrays) -> Found:
    """Mean friction by sums, where windows weigh as their force."""
    value = friction["ratio_of_sums"]
    note = f"change of all areas over all forces, first to last level, from {value[0]:.3g} to {value[-1]:.3g}"
    return lies(difference(friction, "ratio_of_sums", 0, -1), note, high=0.0)


def falls(key: str, title: str) -> Rule:
    """A statistic falls from the first to the last level, and along a straight line through all."""

    @over_levels(
        "the intervals of the change along a straight line over penetration and of the last less the first level both "
        "lie below zero"
    )
    def judge(friction: Arrays) -> Found:
        values = friction[f"combined_{key}"]
        note = f"change of the {title} from the first to the last level, from {values[0]:.3g} to {values[-1]:.3g}"
        change, line = (number(friction, f"trend_combined_{key}_{part}") for part in ("change", "line"))
        return Found(*change, min(inside(change[1], high=0.0), inside(line[1], high=0.0)), note)

    return judge


def falls_at_every_step(key: str, title: str) -> Rule:
    """The same from each level to the next."""

    @over_levels("the interval of every change from a level to the next lies below zero")
    def judge(friction: Arrays) -> Found:
        levels = friction["percentile"]
        steps = [difference(friction, f"combined_{key}", level, level + 1) for level in range(len(levels) - 1)]
        worst = int(np.argmax([high for _, (_, high) in steps]))
        note = f"largest change of the {title} in a step, from percentile {levels[worst]:g} to {levels[worst + 1]:g}"
        return Found(*steps[worst], min(inside(step, high=0.0) for _, step in steps), note)

    return judge


def of_misfits(friction: Arrays) -> str:
    """How far the autocorrelation is from the exponential and from the triangle of the window."""
    row = row_of(friction, MEDIAN)
    exponential, triangle = (friction[f"misfit_{name}"][row] for name in ("exponential", "triangle"))
    return f"rms distance {exponential:.3f} from the exponential, {triangle:.3f} from the triangle of the window"


ONE_FIELD = (
    "strips are single fields, each about its own mean, with lags to half of the distance of its first and last "
    "window, at median penetration: "
)


@rule(
    f"{ONE_FIELD}the interval of the share of fields to which their exponential is nearer than the triangle of the "
    f"window lies above {SURE}. It is contradicted below {1 - SURE:.2f}"
)
def exponential_in_one_field(friction: Arrays) -> Found:
    """Which of both curves one field shows."""
    share = number(friction, "exponential_share")
    note = "share of the fields to which the exponential is nearer than the triangle of the window"
    return Found(*share, max(inside(share[1], low=SURE), min(inside(share[1], low=1 - SURE), 0)), note)


@rule(
    f"{ONE_FIELD}250 µm lies within the 2.5 to 97.5 % of the lengths by least squares, and neither its half nor its "
    "double does. Outside it is contradicted; where half or double would pass too, it is undecided"
)
def length_of_one_field(friction: Arrays) -> Found:
    """The paper's length as one estimate among those of single fields."""
    value, (low, high) = number(friction, "length_one_field")
    passes = [trial for trial in (0.5, 1.0, 2.0) if low <= trial * PAPER_LENGTH <= high]
    others = " and ".join(f"{1e6 * trial * PAPER_LENGTH:.0f} µm" for trial in passes if trial != 1.0)
    note = f"metres, median and 2.5 to 97.5 % of single fields{f'; {others} would pass too' if others else ''}"
    return Found(value, (low, high), -1 if 1.0 not in passes else int(not others), note)


NEARER_THAN_THE_WINDOW = within(
    "all strips together, at median penetration: the mean square distance to the fitted exponential is less than that "
    "to the triangle of the window itself, as the interval of their difference lies below zero",
    "combined_misfit_difference",
    of_misfits,
    MEDIAN,
    high=0.0,
)


def length(name: str, how: str) -> Rule:
    """A correlation length against that of the paper. how : it is found"""
    low, high = PAPER_LENGTH * (1 - SAME_LENGTH), PAPER_LENGTH * (1 + SAME_LENGTH)

    @rule(f"{how}: at median penetration the interval of the length lies within {SAME_LENGTH:.0%} of 250 µm")
    def judge(friction: Arrays) -> Found:
        own = float(friction["triangle_length"][row_of(friction, ("length_name", name))])
        stored, lengths = number(friction, f"combined_length_{name}", MEDIAN), 1e6 * friction[f"combined_length_{name}"]
        note = (
            f"metres, {how}; {lengths.min():.0f} to {lengths.max():.0f} µm over all levels. The triangle of the window "
            f"alone gives {1e6 * own:.0f} µm"
        )
        return lies(stored, note, low, high)

    return judge


@over_levels(
    "the interval of the change from the first to the last level, along a straight line through all, lies within "
    f"{SAME_LENGTH:.0%} of the mean length"
)
def length_at_any_depth(friction: Arrays) -> Found:
    """The change of the length along a straight line through all levels."""
    lengths = friction["combined_length_least_squares"]
    allowed = SAME_LENGTH * float(np.mean(lengths))
    note = (
        f"metres, change along a straight line through all levels; {1e6 * allowed:.0f} µm are allowed; the levels have "
        f"{1e6 * lengths.min():.0f} to {1e6 * lengths.max():.0f} µm"
    )
    return lies(number(friction, "trend_combined_length_least_squares_line"), note, -allowed, allowed)


def positive(name: str, title: str, paper: float) -> OfLevels:
    """A moment lies above zero at some levels; shown is the level whose lower end is least. paper : of its Beta"""

    def judge(friction: Arrays, levels: list[int]) -> Found:
        moments = [number(friction, f"combined_{name}", level) for level in levels]
        least = min(range(len(levels)), key=lambda row: moments[row][1][0])
        values = friction[f"combined_{name}"]
        note = (
            f"{title} at percentile {friction['percentile'][levels[least]]:g}; over all levels {values.min():.2f} to "
            f"{values.max():.2f}; the paper's own Beta(2.1, 5) has {paper:.3f}"
        )
        return Found(*moments[least], min(inside(ends, low=0.0) for _, ends in moments), note)

    return judge


def like_beta(friction: Arrays, levels: list[int]) -> Found:
    """The distance at some levels; shown is the one with the largest upper end of its interval."""
    distances = [number(friction, "beta_distance_standardised", level) for level in levels]
    says = [inside(ends, high=LIKE_BETA) for _, ends in distances]
    row = max(range(len(levels)), key=lambda row: distances[row][1][1])
    fitted = ", ".join(f"{friction[f'beta_{shape}'][levels[row]]:.3g}" for shape in "ab")
    note = (
        f"Kolmogorov distance at percentile {friction['percentile'][levels[row]]:g}, where the fit is Beta({fitted}); "
        f"{says.count(1)} of {len(says)} levels follow it"
    )
    return Found(*distances[row], min(says), note)


def shapes_of_sets(friction: Arrays, levels: list[int]) -> Found:
    """Shapes after scaling by the extremes of small sets; shown is the level that agrees least."""

    def says(level: int) -> int:
        within, near = True, True
        for shape, paper in zip("ab", PAPER_BETA, strict=True):
            value, (low, high) = number(friction, f"set_beta_{shape}_{STUDY_WINDOWS}", level)
            within &= low <= paper <= high
            near &= abs(value - paper) <= SAME_SHAPE * paper
        return int(near) if within else -1

    level = min(levels, key=says)
    medians = {shape: [friction[f"set_beta_{shape}_{size}"][level] for size in SET_WINDOWS] for shape in "ab"}
    shapes = ", ".join(
        f"Beta({a:.2f}, {b:.2f}) of {size}" for size, a, b in zip(SET_WINDOWS, *medians.values(), strict=True)
    )
    note = (
        f"second shape with the 5 to 95 % of sets of {STUDY_WINDOWS} windows at percentile "
        f"{friction['percentile'][level]:g}. The number of windows in a set makes the shapes: medians are {shapes}"
    )
    return Found(*number(friction, f"set_beta_b_{STUDY_WINDOWS}", level), says(level), note)
