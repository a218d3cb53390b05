"""Statistics of all penetrations from all strips: correlation lengths and trends."""

from __future__ import annotations

import numpy as np

from roughslip.friction.combination import Combined, Replicates, combine
from roughslip.friction.correlation import correlation_fit
from roughslip.friction.level import Levels
from roughslip.friction.penetration import Trend, trend
from roughslip.friction.statistics import estimate_of
from roughslip.probability import Estimate

LENGTHS = ("least_squares", "one_over_e", "integral", "log_line_50", "log_line_90")
"""Lengths of the autocorrelation from all strips, as `correlation.Lengths` has them."""

TRENDS = ("mean", "std", "variation", "length_least_squares", "length_log_line_50", "length_log_line_90")
"""Statistics of which the change with penetration is given too."""


def combined_estimates(combined: list[Combined], lags: np.ndarray, window: float) -> dict[str, list[Estimate]]:
    """By name the statistics of all levels from all strips, with the lengths [m] of the autocorrelation at the lags."""
    estimates = [each.estimates() for each in combined]
    fits = [correlation_fit(lags, each["autocorrelation"], window) for each in estimates]
    return {name: [each[name] for each in estimates] for name in estimates[0]} | {
        **{f"length_{name}": [getattr(fit, name) for fit in fits] for name in LENGTHS},
        "log_line_r2": [fit.log_line_r2 for fit in fits],
        "misfit_difference": [fit.misfit_difference for fit in fits],
    }


def trend_of(percentiles: np.ndarray, estimates: list[Estimate]) -> Trend:
    """Trend over penetration of estimates that share their replicates."""
    return trend(percentiles, np.array([e.value for e in estimates]), np.array([e.replicates for e in estimates]))


def trend_estimates(combined: dict[str, list[Estimate]], percentiles: np.ndarray) -> dict[str, Estimate]:
    """Change along a straight line, and last less first level, of TRENDS from all strips."""
    changes: dict[str, Estimate] = {}
    for name in TRENDS:
        along = trend_of(percentiles, combined[name])
        changes |= {f"trend_combined_{name}_line": along.line, f"trend_combined_{name}_change": along.change}
    return changes


def calibrated_levels(
    percentiles: np.ndarray, levels: Levels, weights: tuple[np.ndarray, np.ndarray], factors: Replicates, mean: float
) -> tuple[list[Combined], Estimate]:
    """Statistics of every penetration, in units in which the mean at the median is exact, and the shear strength.

    percentiles : (levels,) [%], 50 among them
    levels : windows (levels, S, W), for a shear strength of 1 Pa
    weights, factors : as of `combine`
    mean : friction coefficient at median penetration

    Returns the shear strength [Pa] as the second, with what few strips leave open of it.
    """
    combined = [combine(levels.at(number), weights, factors) for number in range(len(percentiles))]
    median = combined[int(np.flatnonzero(percentiles == 50.0)[0])]
    shear = estimate_of("mean", mean / np.exp(median.rows["mean"]), levels.strips[0])
    return [each.calibrated(mean, median) for each in combined], shear
