"""Marginal distribution of the friction coefficient: four-parameter Beta, the paper's scaling to (0, 1), a distance.

A Beta variable on [lower, upper] is lower + (upper - lower) B with B of density b^(a-1) (1-b)^(b-1) on (0, 1).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import scipy  # its parts when they are used
from scipy import special

from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.friction.windows import (
    check_windows,
    power_sums,
    require_scatter,
    resampled,
    resampled_distribution,
)
from roughslip.probability import Estimate, beta_moments
from roughslip.results import described, result
from roughslip.validation import finite, gate

SHAPES = (0.3, 300.0)
"""Range of both shapes in the four-parameter fit: beyond 300 a Beta is a gamma or normal distribution to the eye."""

SET_WINDOWS = (20, 50, 100, 200)
"""Windows of a set that is scaled by its own extremes."""
SETS = 400

_NODES = 200
PROBABILITIES = (np.arange(_NODES) + 0.5) / _NODES
"""Of the quantiles by which distributions are compared."""

_TRIALS = 12
_LOG_SHAPES = np.linspace(math.log(SHAPES[0]), math.log(SHAPES[1]), _TRIALS)
_DISTANCE_NODES = 1000
_MOST_STEPS = 500

PAPER_BETA = (2.1, 5.0)
PAPER_MOMENTS = beta_moments(*PAPER_BETA)
_PROBABILITY = np.arange(_DISTANCE_NODES + 1) / _DISTANCE_NODES
_STANDARD = (special.betaincinv(*PAPER_BETA, _PROBABILITY) - PAPER_MOMENTS.mean) / PAPER_MOMENTS.standard_deviation
NORMAL_DISTANCE = float(np.max(np.abs(special.ndtr(_STANDARD) - _PROBABILITY)))
"""Kolmogorov distance of the normal distribution from Beta(2.1, 5), both standardised; a uniform one is farther."""


@result
class BetaFit:
    """Beta distribution on an interval."""

    a: float = described("first shape")
    b: float = described("second shape")
    lower: float = described("lower end of the interval")
    upper: float = described("upper end of the interval")
    distance: float = described(
        "2-Wasserstein distance between sample and fit, over the standard deviation of the sample"
    )
    at_bound: bool = described("a shape lies at the end of SHAPES: the data do not determine it")


@gate
def fit_beta(values: np.ndarray) -> BetaFit:
    """Four-parameter Beta nearest to a sample in the 2-Wasserstein distance.

    values : (any shape) of the sample

    Least squares between empirical and Beta quantiles at 200 probabilities (j - 1/2) / 200. For given shapes the ends
    follow from linear regression, so only log a and log b are searched: on a table, then by least squares (trust
    region, steps below 1e-12). Raises IllPosedError where the values have no scatter, ConvergenceError where the least
    squares do not end.
    """
    ascending = np.sort(finite("values", values), axis=None)
    if not ascending.size:
        raise IllPosedError("no values, so no distribution: take more strips or a deeper penetration")
    ranks = -(-(2 * np.arange(_NODES) + 1) * ascending.size // (2 * _NODES))  # whole numbers, so nothing is rounded
    quantiles = ascending[ranks - 1]
    centre, spread = float(np.mean(quantiles)), float(np.std(quantiles))
    require_scatter(np.array([spread**2]), centre)
    standard = (quantiles - centre) / spread
    log_shapes = _fitted(standard, _LOG_SHAPES[np.stack(np.divmod(np.argmax(_standard_table() @ standard), _TRIALS))])
    a, b = np.exp(log_shapes)
    model = special.betaincinv(a, b, PROBABILITIES)
    correlation = float(np.mean(standard * (model - np.mean(model)))) / float(np.std(model))
    scale = spread * correlation / float(np.std(model))
    lower = centre - scale * float(np.mean(model))
    from_bounds = np.minimum(log_shapes - _LOG_SHAPES[0], _LOG_SHAPES[-1] - log_shapes)
    distance, at_bound = math.sqrt(max(0.0, 1.0 - correlation**2)), bool(from_bounds.min() < 1e-3)
    return BetaFit(float(a), float(b), lower, lower + scale, distance, at_bound)


@lru_cache(maxsize=1)
def _standard_table() -> np.ndarray:
    """Beta quantiles (shape a * shape b, nodes) at the probabilities, each with mean 0 and mean square 1."""
    shapes = np.exp(_LOG_SHAPES)
    table = special.betaincinv(shapes[:, None, None], shapes[None, :, None], PROBABILITIES).reshape(-1, _NODES)
    return np.asarray((table - table.mean(axis=1, keepdims=True)) / table.std(axis=1, keepdims=True))


def _fitted(standard: np.ndarray, start: np.ndarray) -> np.ndarray:
    """(log a, log b) of least distance to standardised quantiles (nodes,), from a start inside the bounds."""

    def residual(log_shapes: np.ndarray) -> np.ndarray:
        model = special.betaincinv(*np.exp(log_shapes), PROBABILITIES)
        model = (model - np.mean(model)) / np.std(model)
        return standard - np.mean(standard * model) * model

    bounds, nearly = (_LOG_SHAPES[0], _LOG_SHAPES[-1]), {"xtol": 1e-12, "ftol": 1e-15, "gtol": 1e-15}
    start = np.clip(start, bounds[0] + 1e-6, bounds[1] - 1e-6)
    fit = scipy.optimize.least_squares(residual, start, bounds=bounds, max_nfev=_MOST_STEPS, **nearly)
    if not fit.success:
        raise ConvergenceError("Beta fit: gradient of the squared distance; use more windows", fit.optimality, fit.nfev)
    return np.asarray(fit.x)


def set_beta(mu: np.ndarray, valid: np.ndarray, seed: Sequence[int]) -> dict[str, Estimate]:
    """The paper's recipe: shapes a, b of a Beta by the moments of windows scaled to (0, 1) by their own extremes.

    mu, valid : (S, W) friction coefficient and bool
    seed : of the draws

    Returns by name set_beta_a_20 ... the median of SETS sets of so many windows, drawn from all, and their 5 to 95 %.
    The number of windows of a set makes the shapes: with more windows the extremes lie farther apart. Raises
    IllPosedError where mu has no scatter in a set.
    """
    found = {}
    for windows in SET_WINDOWS:
        drawn = np.random.default_rng([*seed, windows]).choice(mu[valid], (SETS, windows))
        lower, upper = drawn.min(axis=1, keepdims=True), drawn.max(axis=1, keepdims=True)
        if not (upper > lower).all():
            raise IllPosedError(f"mu has no scatter in a set of {windows} windows; use more windows")
        scaled = (drawn - lower) / (upper - lower)
        m, v = scaled.mean(axis=1), scaled.var(axis=1)
        total = m * (1.0 - m) / v - 1.0
        for shape, values in (("a", m * total), ("b", (1.0 - m) * total)):
            found[f"set_beta_{shape}_{windows}"] = Estimate(*map(np.array, np.quantile(values, (0.5, 0.05, 0.95))))
    return found


def distance_to_beta(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> Estimate:
    """() Kolmogorov distance sup |F_sample - F_Beta|, both with mean 0 and standard deviation 1, to the paper's Beta.

    mu, valid : (S, W) friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`

    It is a difference in shape alone, which does not grow with the number of windows. The supremum runs over 1001
    quantiles of the Beta, so it is at most 0.001 too small; `scipy.stats.kstest` takes one sample, and here are all
    replicates. Sampling noise raises it: a sample of the Beta itself shows about 0.6 / sqrt(effective windows).
    """
    mu, valid = check_windows(mu, valid, weights)
    centre = float(np.mean(mu[valid]))
    n, first, second = resampled(weights, power_sums(mu, valid, centre, 2)).T
    variance = second / n - (first / n) ** 2
    require_scatter(variance, centre, first / n)
    mean, std = centre + first / n, np.sqrt(variance)
    shares = resampled_distribution(mu, valid, weights, mean[:, None] + std[:, None] * _STANDARD)
    moved = np.max(np.abs(shares[1:] - shares[0]), axis=1)
    return Estimate.of_distance(np.max(np.abs(shares - _PROBABILITY), axis=1), moved)
