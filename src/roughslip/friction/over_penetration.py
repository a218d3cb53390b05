"""Statistics of all penetrations from all strips: correlation lengths, trends, and what the rules of verdicts read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roughslip.friction.combination import Combined, Windows, combine, mesh_factors
from roughslip.friction.correlation import correlation_fit
from roughslip.friction.marginal import distance_to_beta
from roughslip.friction.penetration import Trend, trend
from roughslip.friction.statistics import strip_weights
from roughslip.probability import Estimate

LENGTHS = ("least_squares", "one_over_e", "integral", "log_line_50", "log_line_90")
"""Lengths of the autocorrelation from all strips, as `correlation.Lengths` has them."""

TRENDS = ("mean", "std", "variation", "length_least_squares", "length_log_line_50", "length_log_line_90")
"""Statistics of which the change with penetration is given too."""

JUDGED = ("length_least_squares", "misfit_difference", "skewness", "kurtosis")
"""Combined statistics that rules read at single penetrations."""


def combined_estimates(combined: list[Combined], lags: np.ndarray, window: float) -> dict[str, list[Estimate]]:
    """By name the statistics of all levels from all strips, with the lengths [m] of the autocorrelation at the lags."""
    found = [each.estimates() for each in combined]
    fits = [correlation_fit(lags, each["autocorrelation"], window) for each in found]
    return {name: [each[name] for each in found] for name in found[0]} | {
        **{f"length_{name}": [getattr(fit, name) for fit in fits] for name in LENGTHS},
        "log_line_r2": [fit.log_line_r2 for fit in fits],
        "misfit_difference": [fit.misfit_difference for fit in fits],
    }


def trend_of(percentiles: np.ndarray, estimates: list[Estimate]) -> Trend:
    """Trend over penetration of estimates that share their replicates."""
    return trend(percentiles, np.array([e.value for e in estimates]), np.array([e.replicates for e in estimates]))


def trend_estimates(combined: dict[str, list[Estimate]], percentiles: np.ndarray) -> dict[str, Estimate]:
    """Change along a straight line, and last less first level, of TRENDS from all strips."""
    found: dict[str, Estimate] = {}
    for name in TRENDS:
        one = trend_of(percentiles, combined[name])
        found |= {f"trend_combined_{name}_line": one.line, f"trend_combined_{name}_change": one.change}
    return found


def judged_estimates(
    percentiles: np.ndarray,
    windows: tuple[Sequence[Windows], Sequence[Windows], Sequence[Windows] | None],
    lags: np.ndarray,
    window: float,
    replicates: int,
    rng: np.random.Generator,
) -> dict[str, Estimate]:
    """What the rules of verdicts read, by the name that stage friction stores it under, each () or (levels,).

    percentiles : (levels,) [%], 50 among them
    windows : by level (mu, valid) of the solved strips, each (S, W); of the control on them and then on others; of the
        solved strips on cells 2h
    lags, window : [m] as of `correlation_fit`
    """
    solved, control, coarse = windows
    strips, levels = len(solved[0][0]), len(percentiles)
    weights = strip_weights(strips, replicates, rng)
    weights_many = strip_weights(len(control[0][0]) - strips, replicates, rng)
    factors = mesh_factors(replicates, rng)
    best = []
    for level, (own, (mu, valid)) in enumerate(zip(solved, control, strict=True)):
        same, many = ((mu[part], valid[part]) for part in (slice(strips), slice(strips, None)))
        half = None if coarse is None else coarse[level]
        best.append(combine(own, same, many, weights, weights_many, half, factors))
    median = best[int(np.flatnonzero(percentiles == 50.0)[0])]
    combined = combined_estimates([one.calibrated(1.0, median) for one in best], lags, window)
    found = {f"combined_{name}": combined[name] for name in JUDGED}
    found["beta_distance_standardised"] = [distance_to_beta(*own, weights).standardised for own in solved]
    trends = trend_estimates(combined, percentiles) if levels > 1 else {}
    return {name: _stacked(of_levels) for name, of_levels in found.items()} | trends


def _stacked(estimates: list[Estimate]) -> Estimate:
    """Estimates () of the levels as one (levels,)."""
    parts = ("value", "low", "high", "replicates")
    return Estimate(*(np.stack([getattr(one, part) for one in estimates]) for part in parts))
