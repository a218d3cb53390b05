"""Every statistic of the windows of one penetration that need no other level, with its interval."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from roughslip.friction.correlation import autocorrelation, correlation_fit
from roughslip.friction.level import Windows
from roughslip.friction.marginal import distance_to_beta, fit_beta, scaled_beta, set_beta
from roughslip.friction.statistics import window_statistics
from roughslip.probability import Estimate

FITTED = ("misfit_exponential", "misfit_triangle", "misfit_difference")
LENGTHS = ("least_squares", "half_window", "one_over_e", "integral")


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
    statistics = window_statistics(*windows, weights)
    estimates = {
        f.name: getattr(statistics, f.name) for f in fields(statistics) if f.name not in ("windows", "missing")
    }
    estimates["autocorrelation"] = autocorrelation(*windows, len(lags), weights)
    fit = correlation_fit(lags, estimates["autocorrelation"], window)
    estimates |= {f"length_{name}": getattr(fit, name) for name in LENGTHS}
    estimates |= {name: getattr(fit, name) for name in FITTED}
    beta, scaled = fit_beta(*windows, weights), scaled_beta(*windows, weights)
    for shape in ("a", "b", "lower", "upper"):
        estimates[f"beta_{shape}"], estimates[f"scaled_beta_{shape}"] = getattr(beta, shape), getattr(scaled, shape)
    estimates["beta_misfit"] = beta.distance
    estimates["set_beta_a"], estimates["set_beta_b"] = set_beta(*windows, sets)
    distance = distance_to_beta(*windows, weights)
    estimates["beta_distance_standardised"] = distance.standardised
    estimates["beta_distance_scaled"] = distance.scaled
    return estimates
