"""The friction table: every statistic over penetration, with its interval, from levels of windows of falling cost.

Three estimates of a statistic stand side by side. Solved windows alone have all of them. From all levels together,
`combination` gives those with the smallest error. The expansion alone has mean and scatter. All resample whole strips,
with the same draws at every penetration, so that differences between penetrations have intervals too. The friction
coefficient is in units in which the combined mean at the median is as given, in each resampled set. `describe` has the
statistics of the windows of one penetration that need no other level.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from roughslip.errors import IllPosedError
from roughslip.friction.bowden_tabor import Windows
from roughslip.friction.combination import Combined, Levels, combine
from roughslip.friction.correlation import LENGTHS, CorrelationFit, autocorrelation, correlation_fit
from roughslip.friction.marginal import SET_WINDOWS, distance_to_beta, fit_beta, set_beta
from roughslip.friction.statistics import estimate_of, ratio_of_sums, window_statistics
from roughslip.probability import Estimate


def describe(
    windows: Windows, weights: np.ndarray, lags: np.ndarray, window: float, sets: np.random.Generator
) -> dict[str, Estimate]:
    """Moments, quantiles, autocorrelation with its lengths, and Beta distributions, by name.

    windows : mu and valid, each (S, W), friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`
    lags : (W,) [m] distances of two windows; window : [m] length of one
    sets : draws the sets of windows that `set_beta` scales by their extremes

    Raises IllPosedError where too few windows have a friction coefficient, or all have the same.
    """
    moments, curve = window_statistics(*windows, weights), autocorrelation(*windows, len(lags), weights)
    beta, (set_a, set_b) = fit_beta(*windows, weights), set_beta(*windows, sets)
    return {
        "mean": moments.mean,
        "std": moments.std,
        "variation": moments.variation,
        "skewness": moments.skewness,
        "kurtosis": moments.kurtosis,
        "missing_share": moments.missing_share,
        "autocorrelation": curve,
        **of_correlation(correlation_fit(lags, curve, window)),
        "beta_a": beta.a,
        "beta_b": beta.b,
        "beta_lower": beta.lower,
        "beta_upper": beta.upper,
        "beta_misfit": beta.distance,
        "beta_distance_standardised": distance_to_beta(*windows, weights),
        "set_beta_a": set_a,
        "set_beta_b": set_b,
    }


def of_correlation(fit: CorrelationFit) -> dict[str, Estimate]:
    """Lengths of the autocorrelation and its misfits, by name."""
    return {f"length_{name}": getattr(fit, name) for name in LENGTHS} | {
        "misfit_exponential": fit.misfit_exponential,
        "misfit_triangle": fit.misfit_triangle,
        "misfit_difference": fit.misfit_difference,
    }


BY_SOURCE = ("mean", "std")  # also given of the expansion alone


@dataclass(frozen=True, eq=False)
class WindowLayout:
    """Penetrations, and how windows lie on a strip.

    percentiles : (levels,) [%] share of heights above the plane, increasing, 50 among them
    window_m, spacing_m : [m] length of a window and distance between the starts of two neighbours
    count : windows of a strip
    """

    percentiles: np.ndarray
    window_m: float
    spacing_m: float
    count: int

    @property
    def lags(self) -> np.ndarray:
        """(count,) [m] distances of two windows."""
        return self.spacing_m * np.arange(self.count)

    @property
    def median(self) -> int:
        """Number of the level at median penetration."""
        return int(np.flatnonzero(self.percentiles == 50.0)[0])


@dataclass(frozen=True, eq=False)
class FrictionTable:
    """Statistics at every penetration.

    layout : penetrations and windows
    mu : (levels, S, W) friction coefficient of the solved windows, and whether they have one
    weights : (1 + R, S) how often each solved strip counts, in the sample and in each resampled set
    shear : () [Pa] shear strength
    solved : by name the estimates of the solved windows at each level; for those of BY_SOURCE then of the expansion
    levels : statistics from all strips at each level, as rows
    combined : the same by name, as estimates, with correlation lengths
    """

    layout: WindowLayout
    mu: Windows
    weights: np.ndarray
    shear: Estimate
    solved: dict[str, list[Estimate]]
    levels: list[Combined]
    combined: dict[str, list[Estimate]]


def friction_table(
    levels: Levels,
    sums: Windows,
    layout: WindowLayout,
    mean: float,
    replicates: int,
    seed: Sequence[int],
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> FrictionTable:
    """Calibrate the shear strength at the median, and estimate every statistic.

    levels : windows (levels, S, W), for a shear strength of 1 Pa
    sums : area [m2] and force [N] of the solved windows, each (levels, S, W)
    mean : friction coefficient at median penetration
    replicates : resampled sets; seed : of their draws
    progress : receives the number of levels that are done, and of all

    Raises IllPosedError where windows are too few or do not scatter, with the penetration.
    """
    weights = levels.weights(replicates, np.random.default_rng(seed))
    best, shear = calibrated(layout, levels, weights, mean)
    combined: dict[str, list[Estimate]] = {}
    for of_level in (each.estimates() for each in best):
        fit = correlation_fit(layout.lags, of_level["autocorrelation"], layout.window_m)
        for name, estimate in (of_level | of_correlation(fit)).items():
            combined.setdefault(name, []).append(estimate)
    mu = float(shear.value) * levels.solved[0], levels.solved[1]
    solved: dict[str, list[Estimate]] = {}
    for number, percentile in enumerate(layout.percentiles):
        sets = np.random.default_rng([*seed, SET_WINDOWS])
        try:
            estimates = describe((mu[0][number], mu[1][number]), weights[0], layout.lags, layout.window_m, sets)
            area, force = (values[number] for values in sums)
            estimates["ratio_of_sums"] = ratio_of_sums(area, force, float(shear.value), weights[0])
        except IllPosedError as error:
            raise IllPosedError(f"percentile {percentile:g}: {error}") from error
        for name, estimate in estimates.items():
            solved.setdefault(name, []).append(estimate)
        progress(number + 1, len(layout.percentiles))
    for name in BY_SOURCE:
        rows = ((shear.value * np.exp(level.control[name]), level.strips[1]) for level in best)
        solved[name] += [estimate_of(name, *pair) for pair in rows]
    return FrictionTable(layout, mu, weights[0], shear, solved, best, combined)


def calibrated(
    layout: WindowLayout, levels: Levels, weights: tuple[np.ndarray, np.ndarray], mean: float
) -> tuple[list[Combined], Estimate]:
    """Statistics of every penetration, in units in which the mean at the median is exact, and the shear strength [Pa].

    levels, weights : as of `combination.combine` at each penetration, for a shear strength of 1 Pa
    mean : friction coefficient at median penetration

    The shear strength is () [Pa], with what few strips leave open of it.
    """
    combined = [combine(levels.at(number), weights) for number in range(len(layout.percentiles))]
    median = combined[layout.median]
    shear = estimate_of("mean", mean / np.exp(median.rows["mean"]), levels.strips[0])
    return [each.calibrated(mean, median) for each in combined], shear
