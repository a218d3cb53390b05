"""Rules on friction over penetration, its distribution, and its correlation along the path."""

from __future__ import annotations

import numpy as np

from roughslip.friction.marginal import SAME_SKEWNESS, SET_WINDOWS
from roughslip.probability import beta_moments
from roughslip.verdicts.found import VISIBLE, Arrays, Found, Judge, Place, inside, lies, number, row_of, shown

PAPER_LENGTH = 250e-6  # m
SAME_LENGTH = 0.2  # relative difference of correlation lengths that would not be reported as a dependence
PAPER_BETA = (2.1, 5.0)
_, _, BETA_SKEWNESS, BETA_KURTOSIS = beta_moments(*PAPER_BETA)
SKEWNESS_RANGE = BETA_SKEWNESS * (1 - SAME_SKEWNESS), BETA_SKEWNESS * (1 + SAME_SKEWNESS)
SAME_SHAPE = 0.2  # relative difference of the shapes of two Beta distributions that would be reported as one
MEDIAN: Place = ("percentile", 50.0)
ONE_LEVEL = "the scene has one penetration only"
FALLS = (
    "the intervals of the change along a straight line over penetration and of the last less the first level both lie "
    "below zero"
)
EVERY_STEP = "the interval of every change from a level to the next lies below zero"
SUMS_FALL = (
    "sum of the areas over sum of the forces of all windows: the interval of the last less the first level lies below "
    "zero"
)
NEARER = (
    "at median penetration the mean square distance to the fitted exponential is less than that to the triangle of the "
    "window itself: the interval of their difference lies below zero"
)
CLOSE = f"at median penetration the interval of the rms distance to the exponential lies below {VISIBLE}"
AT_LENGTH = f"at median penetration the interval of the length lies within {SAME_LENGTH:.0%} of 250 µm"
STEADY = (
    "the interval of the change from the first to the last level, along a straight line through all, lies within "
    f"{SAME_LENGTH:.0%} of the mean length"
)
LIKE_BETA = (
    f"the interval of the Kolmogorov distance, both standardised, lies below {VISIBLE} and that of the skewness lies "
    f"from {SKEWNESS_RANGE[0]:.2f} to {SKEWNESS_RANGE[1]:.2f}, around the {BETA_SKEWNESS:.2f} of Beta(2.1, 5)"
)
IN_SETS = (
    "contradicted where a shape of the paper lies outside the 5 to 95 % of the shapes of such sets, reproduced where "
    f"also both medians lie within {SAME_SHAPE:.0%} of the paper's, else undecided"
)
OF_KURTOSIS = f"excess kurtosis at median penetration; the paper's own Beta(2.1, 5) has {BETA_KURTOSIS:.3f}"


def several_levels(judge: Judge) -> Judge:
    """The rule, where the scene has several penetrations."""
    return lambda friction: ONE_LEVEL if len(friction["percentile"]) == 1 else judge(friction)


@several_levels
def by_sums(friction: Arrays) -> Found:
    """The last less the first level; their errors are taken as independent, so this is wide."""
    value, low, high = (friction[f"ratio_of_sums{end}"] for end in ("", "_low", "_high"))
    change = float(value[-1] - value[0])
    below = float(np.hypot(value[-1] - low[-1], high[0] - value[0]))
    above = float(np.hypot(high[-1] - value[-1], value[0] - low[0]))
    note = (
        f"change of all areas over all forces from the first to the last level, from {value[0]:.3g} to {value[-1]:.3g}"
    )
    return lies((change, (change - below, change + above)), note, high=0.0)


def falls(key: str, title: str) -> Judge:
    """A statistic falls from the first to the last level, and along a straight line through all."""

    def judge(friction: Arrays) -> Found:
        values = friction[f"combined_{key}"]
        note = f"change of the {title} from the first to the last level, from {values[0]:.3g} to {values[-1]:.3g}"
        change, line = (number(friction, f"trend_combined_{key}_{part}") for part in ("change", "line"))
        return Found(*change, min(inside(change[1], high=0.0), inside(line[1], high=0.0)), note)

    return several_levels(judge)


def falls_at_every_step(key: str, title: str) -> Judge:
    """Errors of neighbouring levels are taken as independent; they rise and fall together, so this is wide."""

    def judge(friction: Arrays) -> Found:
        value, low, high = (friction[f"combined_{key}{end}"] for end in ("", "_low", "_high"))
        steps = np.diff(value)
        below = np.hypot(value[1:] - low[1:], high[:-1] - value[:-1])
        above = np.hypot(high[1:] - value[1:], value[:-1] - low[:-1])
        ends = list(zip((steps - below).tolist(), (steps + above).tolist(), strict=True))
        worst = int(np.argmax(steps + above))
        first, second = friction["percentile"][worst : worst + 2]
        note = f"largest change of the {title} in a step, from percentile {first:g} to {second:g}"
        return Found(float(steps[worst]), ends[worst], min(inside(step, high=0.0) for step in ends), note)

    return several_levels(judge)


def of_misfits(friction: Arrays) -> str:
    """How far the autocorrelation is from the exponential and from the triangle of the window."""
    exponential, triangle = (
        friction[f"misfit_{name}"][row_of(friction, MEDIAN)] for name in ("exponential", "triangle")
    )
    return f"rms distance {exponential:.3f} from the exponential, {triangle:.3f} from the triangle of the window"


def window(friction: Arrays) -> float:
    """Length of a window [m], at which its own triangle ends."""
    return float(friction["lag"][1] / (1.0 - friction["triangle"][1]))


def length(name: str, by: str) -> Judge:
    """A correlation length against that of the paper."""
    low, high = PAPER_LENGTH * (1 - SAME_LENGTH), PAPER_LENGTH * (1 + SAME_LENGTH)

    def judge(friction: Arrays) -> Found:
        own = float(friction["triangle_length"][row_of(friction, ("length_name", name))])
        stored, lengths = number(friction, f"combined_length_{name}", MEDIAN), 1e6 * friction[f"combined_length_{name}"]
        passes = ", which passes the rule too: then it says nothing of friction" if low < own < high else ""
        shorter = 1e6 * window(friction) * PAPER_LENGTH / stored[0]
        note = (
            f"metres, {by}; {lengths.min():.0f} to {lengths.max():.0f} µm over all levels. The triangle of the window "
            f"alone gives {1e6 * own:.0f} µm{passes}. The length goes with the window, and one of {shorter:.0f} µm "
            "would give the paper's"
        )
        return lies(stored, note, low, high)

    return judge


@several_levels
def length_at_any_depth(friction: Arrays) -> Found:
    """The change of the length along a straight line through all levels."""
    lengths = friction["combined_length_least_squares"]
    allowed = SAME_LENGTH * float(np.mean(lengths))
    note = (
        f"metres, change along a straight line through all levels; {1e6 * allowed:.0f} µm are allowed; the levels have "
        f"{1e6 * lengths.min():.0f} to {1e6 * lengths.max():.0f} µm"
    )
    return lies(number(friction, "trend_combined_length_least_squares_line"), note, -allowed, allowed)


def of_skewness(friction: Arrays) -> str:
    """What the number is, and its range."""
    skewness = friction["combined_skewness"]
    return f"skewness at median penetration; over all levels {skewness.min():.2f} to {skewness.max():.2f}"


def positive_at_every_level(name: str, title: str) -> Judge:
    """A moment of every level; shown is the level whose lower end is least."""

    def judge(friction: Arrays) -> Found:
        value, low, high = (friction[f"combined_{name}{end}"] for end in ("", "_low", "_high"))
        worst = int(np.argmin(low))
        says = min(inside(ends, low=0.0) for ends in zip(low, high, strict=True))
        note = f"{title} at percentile {friction['percentile'][worst]:g}, of the least lower end"
        return Found(float(value[worst]), (float(low[worst]), float(high[worst])), says, note)

    return several_levels(judge)


def like_beta(friction: Arrays, level: int) -> int:
    """Distance and skewness: by the distance alone the normal would pass."""
    _, distance = number(friction, "beta_distance_standardised", level)
    _, skewness = number(friction, "combined_skewness", level)
    return min(inside(distance, high=VISIBLE), inside(skewness, *SKEWNESS_RANGE))


def beta_at_the_median(friction: Arrays) -> Found:
    """The shape of the distribution at median penetration."""
    middle = row_of(friction, MEDIAN)
    skewness = number(friction, "combined_skewness", middle)
    fitted = ", ".join(f"{friction[f'beta_{shape}'][middle]:.3g}" for shape in "ab")
    at_bound = friction["beta_at_bound"][middle]
    undetermined = " (at the end of the range of shapes: they are not determined)" if at_bound else ""
    root = skewness[0] / BETA_SKEWNESS  # the skewness of a mean falls with the root of its window
    size = f"a window of {1e6 * window(friction) * root**2:.0f} µm" if root > 0 else "no window"
    note = (
        f"Kolmogorov distance; skewness {shown(skewness)}; fitted Beta({fitted}){undetermined}; "
        f"{size} would have the skewness of Beta(2.1, 5), {BETA_SKEWNESS:.2f}"
    )
    return Found(*number(friction, "beta_distance_standardised", middle), like_beta(friction, middle), note)


@several_levels
def beta_at_any_depth(friction: Arrays) -> Found:
    """The same at every level; shown is the level whose distance has the largest upper end."""
    says = [like_beta(friction, level) for level in range(len(friction["percentile"]))]
    far, skewness = int(np.argmax(friction["beta_distance_standardised_high"])), friction["combined_skewness"]
    note = (
        f"Kolmogorov distance at percentile {friction['percentile'][far]:g}, of the largest upper end; "
        f"{says.count(1)} of {len(says)} levels follow it; skewness {skewness.min():.2f} to {skewness.max():.2f}"
    )
    return Found(*number(friction, "beta_distance_standardised", far), min(says), note)


def shapes_of_sets(friction: Arrays, levels: list[int]) -> Found:
    """Shapes after scaling by the extremes of small sets; shown is the level that agrees least."""

    def says(level: int) -> int:
        within, near = True, True
        for shape, paper in zip("ab", PAPER_BETA, strict=True):
            value, (low, high) = number(friction, f"set_beta_{shape}", level)
            within &= low <= paper <= high
            near &= abs(value - paper) <= SAME_SHAPE * paper
        return int(near) if within else -1

    level = min(levels, key=says)
    shapes = ", ".join(f"{friction[f'set_beta_{shape}'][level]:.2f}" for shape in "ab")
    note = (
        f"second shape with the 5 to 95 % of sets of {SET_WINDOWS} windows at percentile "
        f"{friction['percentile'][level]:g}; median shapes Beta({shapes}). The number of windows in a set makes the "
        "shapes: more windows reach farther, and the shapes grow"
    )
    return Found(*number(friction, "set_beta_b", level), says(level), note)


def sets_at_the_median(friction: Arrays) -> Found:
    """Shapes of small sets at median penetration."""
    return shapes_of_sets(friction, [row_of(friction, MEDIAN)])


@several_levels
def sets_at_any_depth(friction: Arrays) -> Found:
    """Shapes of small sets at every penetration."""
    return shapes_of_sets(friction, list(range(len(friction["percentile"]))))
