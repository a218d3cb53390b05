"""Marginal distribution of the friction coefficient: four-parameter Beta, the paper's scaling to (0, 1), a distance.

A Beta variable on [lower, upper] is lower + (upper - lower) B with B of density b^(a-1) (1-b)^(b-1) on (0, 1).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import scipy
from scipy import special

from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.friction.statistics import (
    check_windows,
    power_sums,
    require_scatter,
    resampled,
    resampled_distribution,
    resampled_quantiles,
)
from roughslip.probability import Estimate, beta_moments
from roughslip.results import described, result
from roughslip.validation import gate, positive

SHAPES = (0.3, 300.0)
"""Range of both shapes in the four-parameter fit: beyond 300 a Beta is a gamma or normal distribution to the eye."""

SET_WINDOWS = 100
"""Windows of a set that is scaled by its own extremes, as a study of the paper's time has."""
SETS = 400

_NODES = 200
PROBABILITIES = (np.arange(_NODES) + 0.5) / _NODES
"""Of the quantiles by which distributions are compared."""

_TRIALS = 48
_LOG_SHAPES = np.linspace(math.log(SHAPES[0]), math.log(SHAPES[1]), _TRIALS)
_PATCHES = 4
_DISTANCE_NODES = 1000

PAPER_SKEWNESS = beta_moments(2.1, 5.0).skewness
SAME_SKEWNESS = 0.5  # relative; that of the normal distribution, 0.05 from Beta(2.1, 5) in Kolmogorov distance, is 1


@result
class BetaFit:
    """Beta distribution on an interval."""

    a: Estimate = described("first shape")
    b: Estimate = described("second shape")
    lower: Estimate = described("lower end of the interval")
    upper: Estimate = described("upper end of the interval")
    distance: Estimate = described(
        "2-Wasserstein distance between sample and fit, over the standard deviation of the sample"
    )
    at_bound: bool = described("a shape of the sample lies at the end of SHAPES: the data do not determine it")


@gate
def fit_beta(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> BetaFit:
    """Four-parameter Beta nearest to the sample in the 2-Wasserstein distance.

    mu, valid : (S, W) friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`

    Least squares between empirical and Beta quantiles at 200 probabilities (j - 1/2) / 200. For given shapes the ends
    follow from linear regression, so only log a and log b are searched: on a table, then by least squares (trust
    region, steps below 1e-10). Replicates stop at the table's interpolation, within about 1 % of a shape.
    Raises IllPosedError where mu has no scatter, ConvergenceError where the least squares do not end.
    """
    standard, centre, spread = standard_quantiles(mu, valid, weights)
    log_shapes = _table_search(standard)
    log_shapes[0] = _refined(standard[0], log_shapes[0])
    a, b = np.exp(log_shapes).T
    model = special.betaincinv(a[:, None], b[:, None], PROBABILITIES)
    model_centre, model_spread = np.mean(model, axis=1), np.std(model, axis=1)
    correlation = np.mean(standard * (model - model_centre[:, None]), axis=1) / model_spread
    scale = spread * correlation / model_spread
    lower = centre - scale * model_centre
    from_bounds = np.minimum(log_shapes[0] - _LOG_SHAPES[0], _LOG_SHAPES[-1] - log_shapes[0])
    return BetaFit(
        a=Estimate.from_rows(a),
        b=Estimate.from_rows(b),
        lower=Estimate.from_rows(lower),
        upper=Estimate.from_rows(lower + scale),
        distance=Estimate.of_distance(
            np.sqrt(np.maximum(0.0, 1.0 - correlation**2)), np.sqrt(np.mean((standard[1:] - standard[0]) ** 2, axis=1))
        ),
        at_bound=bool(from_bounds.min() < 1e-3),
    )


def standard_quantiles(
    mu: np.ndarray, valid: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Quantiles (1 + R, nodes) at PROBABILITIES with mean 0 and mean square 1, and what they lost: centre and spread.

    mu, valid : (S, W) friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`

    Raises IllPosedError where mu has no scatter.
    """
    mu, valid = check_windows(mu, valid, weights)
    quantiles = resampled_quantiles(mu, valid, weights, 2 * np.arange(_NODES) + 1, 2 * _NODES)
    require_scatter(np.var(quantiles, axis=1), float(np.mean(mu[valid])))
    centre, spread = np.mean(quantiles, axis=1), np.std(quantiles, axis=1)
    return (quantiles - centre[:, None]) / spread[:, None], centre, spread


def set_beta(
    mu: np.ndarray, valid: np.ndarray, rng: np.random.Generator, windows: int = SET_WINDOWS
) -> tuple[Estimate, Estimate]:
    """The paper's recipe: shapes a, b of a Beta by the moments of windows scaled to (0, 1) by their own extremes.

    mu, valid : (S, W) friction coefficient and bool
    windows : of a set that is scaled by its extremes

    Returns for each shape the median of SETS sets, drawn from all windows, and their 5 to 95 %. The number of windows
    of a set makes the shapes: with more windows the extremes lie farther apart. Raises IllPosedError where mu has no
    scatter in a set.
    """
    drawn = rng.choice(mu[valid], (SETS, windows))
    lower, upper = drawn.min(axis=1, keepdims=True), drawn.max(axis=1, keepdims=True)
    if not (upper > lower).all():
        raise IllPosedError(f"mu has no scatter in a set of {windows} windows; use more windows")
    scaled = (drawn - lower) / (upper - lower)
    m, v = scaled.mean(axis=1), scaled.var(axis=1)
    total = m * (1.0 - m) / v - 1.0
    shapes = (np.quantile(shape, (0.5, 0.05, 0.95)) for shape in (m * total, (1.0 - m) * total))
    first, second = (Estimate(*map(np.array, ends)) for ends in shapes)
    return first, second


def distance_to_beta(
    mu: np.ndarray, valid: np.ndarray, weights: np.ndarray, a: float = 2.1, b: float = 5.0
) -> Estimate:
    """() Kolmogorov distance sup |F_sample - F_Beta(a, b)|, both with mean 0 and standard deviation 1.

    mu, valid : (S, W) friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`
    a, b : shapes, by default the paper's

    It is a difference in shape alone, which does not grow with the number of windows. The supremum runs over 1001
    quantiles of the Beta, so it is at most 0.001 too small; `scipy.stats.kstest` takes one sample, and here are all
    replicates. Sampling noise raises it: a sample of the Beta itself shows about 0.6 / sqrt(effective windows).
    """
    for shape in (a, b):
        positive("a shape of a Beta distribution", shape)
    mu, valid = check_windows(mu, valid, weights)
    mean, std = _mean_and_std(mu, valid, weights)
    probability = np.arange(_DISTANCE_NODES + 1) / _DISTANCE_NODES
    beta_mean, beta_std, _, _ = beta_moments(a, b)
    standard = (special.betaincinv(a, b, probability) - beta_mean) / beta_std
    shares = resampled_distribution(mu, valid, weights, mean[:, None] + std[:, None] * standard)
    moved = np.max(np.abs(shares[1:] - shares[0]), axis=1)
    return Estimate.of_distance(np.max(np.abs(shares - probability), axis=1), moved)


def nearest_level(distance: np.ndarray, skewness: np.ndarray, among: np.ndarray) -> int:
    """Number of the penetration where friction lies nearest to the paper's Beta: of those as skewed, else of all.

    distance, skewness : (levels,) [-] from `distance_to_beta`, and skewness of the windows
    among : (levels,) bool, of the levels that count
    """
    is_skewed = np.abs(skewness / PAPER_SKEWNESS - 1.0) <= SAME_SKEWNESS
    return int(np.argmin(np.where(among, np.where(is_skewed, distance, 1.0 + distance), np.inf)))


def _mean_and_std(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    centre = float(np.mean(mu[valid]))
    n, first, second = resampled(weights, power_sums(mu, valid, centre, 2)).T
    variance = second / n - (first / n) ** 2
    require_scatter(variance, centre, first / n)
    return centre + first / n, np.sqrt(variance)


@lru_cache(maxsize=1)
def _standard_table() -> np.ndarray:
    """Beta quantiles (nodes, shape a * shape b) at the probabilities, each with mean 0 and mean square 1."""
    shapes = np.exp(_LOG_SHAPES)
    table = special.betaincinv(shapes[:, None, None], shapes[None, :, None], PROBABILITIES)
    table -= np.mean(table, axis=2, keepdims=True)
    table /= np.sqrt(np.mean(table**2, axis=2, keepdims=True))
    return np.ascontiguousarray(table.reshape(-1, _NODES).T)


def _table_search(standard: np.ndarray) -> np.ndarray:
    """(log a, log b) (rows, 2) of least squared distance 1 - correlation^2 to standardised quantiles (rows, nodes).

    First the best entry of the table. Then the best point of the polynomial of degree 4 through the 5 x 5 entries
    around it. The mesh width is 1/20 of a step (0.7 % of a shape). As the valley is narrow and oblique, that is
    repeated around each new best.
    """
    misfit = 1.0 - (standard @ _standard_table() / _NODES) ** 2
    row = np.arange(len(standard))
    best: np.ndarray = np.stack(np.divmod(np.argmin(misfit, axis=1), _TRIALS), axis=1)
    misfit = misfit.reshape(-1, _TRIALS, _TRIALS)
    near = np.arange(-2, 3)
    fine = np.linspace(-2.0, 2.0, 81)
    lagrange = np.array([[np.prod([(x - m) / (k - m) for m in near if m != k]) for k in near] for x in fine])
    for _ in range(_PATCHES):
        centre = np.clip(np.rint(best).astype(np.int64), 2, _TRIALS - 3)
        i, j = centre[:, :1] + near, centre[:, 1:] + near
        patch = misfit[row[:, None, None], i[:, :, None], j[:, None, :]]
        smooth = (lagrange @ patch @ lagrange.T).reshape(len(row), -1)
        x, y = np.divmod(np.argmin(smooth, axis=1), len(fine))
        best = centre + np.stack((fine[x], fine[y]), axis=1)
    return np.clip(_LOG_SHAPES[0] + best * (_LOG_SHAPES[1] - _LOG_SHAPES[0]), _LOG_SHAPES[0], _LOG_SHAPES[-1])


def _refined(standard: np.ndarray, start: np.ndarray) -> np.ndarray:
    """(log a, log b) of least distance to standardised quantiles (nodes,), from a start inside the bounds."""

    def residual(log_shapes: np.ndarray) -> np.ndarray:
        model = special.betaincinv(*np.exp(log_shapes), PROBABILITIES)
        model = (model - np.mean(model)) / np.std(model)
        return standard - np.mean(standard * model) * model

    bounds = (_LOG_SHAPES[0], _LOG_SHAPES[-1])
    fit = scipy.optimize.least_squares(residual, start, bounds=bounds, xtol=1e-10, ftol=1e-12, gtol=1e-12, max_nfev=500)
    if not fit.success:
        raise ConvergenceError("Beta fit: gradient of the squared distance; use more windows", fit.optimality, fit.nfev)
    return fit.x
