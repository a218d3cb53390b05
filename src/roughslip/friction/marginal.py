"""Marginal distribution of the friction coefficient: four-parameter Beta, the paper's scaling to (0, 1), and distances.

A Beta variable on [lower, upper] is lower + (upper - lower) B with B of density b^(a-1) (1-b)^(b-1) on (0, 1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy
from scipy import special

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError, real
from roughslip.friction.statistics import (
    check_windows,
    power_sums,
    require_scatter,
    resampled,
    resampled_distribution,
    resampled_extremes,
    resampled_quantiles,
)
from roughslip.probability import Estimate, beta_moments
from roughslip.short_repr import short_repr
from roughslip.validation import gate

SHAPES = (0.3, 300.0)
"""Range of both shapes in the four-parameter fit: beyond 300 a Beta is a gamma or normal distribution to the eye."""

SET_WINDOWS = 100
"""Windows of a set that is scaled by its own extremes."""
SETS = 400

_NODES = 200
PROBABILITIES = (np.arange(_NODES) + 0.5) / _NODES
"""Of the quantiles by which distributions are compared."""

_TRIALS = 48
_LOG_SHAPES = np.linspace(math.log(SHAPES[0]), math.log(SHAPES[1]), _TRIALS)
_PATCHES = 4
_DISTANCE_NODES = 1000

# The shape of a member is named by its skewness: both families are the normal distribution at 0, the gamma is the
# exponential distribution at 2, and members of negative skewness are mirror images.
SKEWNESS = np.linspace(-2.0, 2.0, 401)
FAMILIES = ("normal", "gamma", "lognormal")


@short_repr
@dataclass(frozen=True)
class BetaFit:
    """Beta distribution on an interval.

    a, b : () shapes
    lower, upper : () [-] ends of the interval
    distance : () 2-Wasserstein distance between sample and fit, over the standard deviation of the sample
    at_bound : a shape of the sample lies at the end of SHAPES: the data do not determine it
    at_bound_share : share of replicates where one does
    """

    a: Estimate
    b: Estimate
    lower: Estimate
    upper: Estimate
    distance: Estimate
    at_bound: bool
    at_bound_share: float


@dataclass(frozen=True)
class ScaledBeta:
    """The paper's recipe: Beta distribution of mu scaled by its sample minimum and maximum to (0, 1).

    a, b : () shapes
    lower, upper : () [-] sample minimum and maximum
    """

    a: Estimate
    b: Estimate
    lower: Estimate
    upper: Estimate


@dataclass(frozen=True)
class BetaDistance:
    """Kolmogorov distance between the sample and a Beta(a, b).

    standardised : () both with mean 0 and standard deviation 1: the difference in shape alone
    scaled : () sample scaled by its minimum and maximum to (0, 1), as the paper has it
    """

    standardised: Estimate
    scaled: Estimate


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
    edge = np.min(np.minimum(log_shapes - _LOG_SHAPES[0], _LOG_SHAPES[-1] - log_shapes), axis=1) < 1e-3
    return BetaFit(
        a=Estimate.from_rows(a),
        b=Estimate.from_rows(b),
        lower=Estimate.from_rows(lower),
        upper=Estimate.from_rows(lower + scale),
        distance=Estimate.of_distance(
            np.sqrt(np.maximum(0.0, 1.0 - correlation**2)), np.sqrt(np.mean((standard[1:] - standard[0]) ** 2, axis=1))
        ),
        at_bound=bool(edge[0]),
        at_bound_share=float(np.mean(edge[1:])),
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


def scaled_beta(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> ScaledBeta:
    """The paper's recipe: scale mu by its minimum and maximum to (0, 1), fit Beta(a, b) by the moments.

    mu, valid : (S, W) friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`

    Mean and variance need no logarithms, so the two end points stay in as they are. The ends, and with them the shapes,
    drift outwards with the number of windows; resampling cannot see beyond the sample's own extremes, so the
    intervals are too short. Both are properties of the recipe.
    """
    mu, valid = check_windows(mu, valid, weights)
    mean, std = _mean_and_std(mu, valid, weights)
    lower, upper = resampled_extremes(mu, valid, weights)
    m, v = (mean - lower) / (upper - lower), (std / (upper - lower)) ** 2
    total = m * (1.0 - m) / v - 1.0
    if (total <= 1e-12).any():
        raise IllPosedError("mu takes two values only: scaled to (0, 1) it has no Beta distribution; use more windows")
    return ScaledBeta(*(Estimate.from_rows(rows) for rows in (m * total, (1.0 - m) * total, lower, upper)))


def set_beta(mu: np.ndarray, valid: np.ndarray, rng: np.random.Generator) -> tuple[Estimate, Estimate]:
    """Shapes a, b of Beta distributions by the moments, of sets of SET_WINDOWS windows scaled by their own extremes.

    mu, valid : (S, W) friction coefficient and bool

    Returns for each shape the median of SETS sets, drawn from all windows, and their 5 to 95 %. The number of windows
    of a set makes the shapes: with more windows the extremes lie farther apart.
    """
    drawn = rng.choice(mu[valid], (SETS, SET_WINDOWS))
    lower, upper = drawn.min(axis=1, keepdims=True), drawn.max(axis=1, keepdims=True)
    if not (upper > lower).all():
        raise IllPosedError(f"mu has no scatter in a set of {SET_WINDOWS} windows; use more windows")
    scaled = (drawn - lower) / (upper - lower)
    m, v = scaled.mean(axis=1), scaled.var(axis=1)
    total = m * (1.0 - m) / v - 1.0
    shapes = (np.quantile(shape, (0.5, 0.05, 0.95)) for shape in (m * total, (1.0 - m) * total))
    first, second = (Estimate(*map(np.array, ends)) for ends in shapes)
    return first, second


def distance_to_beta(
    mu: np.ndarray, valid: np.ndarray, weights: np.ndarray, a: float = 2.1, b: float = 5.0
) -> BetaDistance:
    """Kolmogorov distance sup |F_sample - F_Beta(a, b)|, an effect size that does not grow with the number of windows.

    mu, valid : (S, W) friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`
    a, b : shapes, by default the paper's

    The supremum runs over 1001 quantiles of the Beta, so a distance is at most 0.001 too small. Sampling noise raises
    it: a sample of the Beta itself shows about 0.6 / sqrt(effective windows) standardised. Intervals: of_distance.
    """
    if not all(math.isfinite(real("a shape", shape)) and shape > 0.0 for shape in (a, b)):
        raise ParameterError(f"shapes of a Beta distribution must be positive and finite, not {a} and {b}")
    mu, valid = check_windows(mu, valid, weights)
    mean, std = _mean_and_std(mu, valid, weights)
    lower, upper = resampled_extremes(mu, valid, weights)
    probability = np.arange(_DISTANCE_NODES + 1) / _DISTANCE_NODES
    node = special.betaincinv(a, b, probability)
    beta_mean, beta_std, _, _ = beta_moments(a, b)

    def distance(origin: np.ndarray, scale: np.ndarray) -> Estimate:
        shares = resampled_distribution(mu, valid, weights, origin[:, None] + scale[:, None] * node)
        return Estimate.of_distance(
            np.max(np.abs(shares - probability), axis=1), np.max(np.abs(shares[1:] - shares[0]), axis=1)
        )

    scale = std / beta_std
    return BetaDistance(standardised=distance(mean - scale * beta_mean, scale), scaled=distance(lower, upper - lower))


def standardised_distribution(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Share (1 + R, points) of the windows that lie at most so many standard deviations : (points,) above their mean.

    mu, valid : (S, W) friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`

    Raises IllPosedError where mu has no scatter.
    """
    mean, std = _mean_and_std(mu, valid, weights)
    return resampled_distribution(mu, valid, weights, mean[:, None] + std[:, None] * points)


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


@dataclass(frozen=True)
class Candidate:
    """A family nearest to the sample.

    skewness : () of the nearest member, which names its shape
    distance : () 2-Wasserstein distance between sample and member, over the standard deviation of the sample
    """

    skewness: Estimate
    distance: Estimate


def fit_candidates(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> dict[str, Candidate]:
    """The nearest member of every family of FAMILIES.

    mu, valid : (S, W) friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`

    Raises IllPosedError where mu has no scatter. Shapes are searched on a table, 0.01 apart in skewness.
    """
    standard, _, _ = standard_quantiles(mu, valid, weights)
    moved = np.sqrt(np.mean((standard[1:] - standard[0]) ** 2, axis=1))
    candidates = {}
    for family in FAMILIES:
        table = _table(family)
        correlation = standard @ table.T / len(PROBABILITIES)
        best = np.argmax(correlation, axis=1)
        largest = np.take_along_axis(correlation, best[:, None], axis=1)[:, 0]
        candidates[family] = Candidate(
            skewness=Estimate.from_rows((SKEWNESS if len(table) > 1 else np.zeros(1))[best]),
            distance=Estimate.of_distance(np.sqrt(np.maximum(0.0, 1.0 - largest**2)), moved),
        )
    return candidates


@lru_cache(maxsize=len(FAMILIES))
def _table(family: str) -> np.ndarray:
    """Quantiles (members, nodes) of a family at PROBABILITIES, each with mean 0 and mean square 1."""
    if family == "normal":
        table = special.ndtri(PROBABILITIES)[None]
    else:
        half = (_gamma if family == "gamma" else _lognormal)(SKEWNESS[SKEWNESS > 0][:, None])
        table = np.concatenate((-half[::-1, ::-1], special.ndtri(PROBABILITIES)[None], half))
    table = table - table.mean(axis=1, keepdims=True)
    table /= np.sqrt(np.mean(table**2, axis=1, keepdims=True))
    return np.ascontiguousarray(table)


def _gamma(skewness: np.ndarray) -> np.ndarray:
    """Quantiles of gamma distributions; a shape k has the skewness 2 / sqrt(k)."""
    return special.gammaincinv(4.0 / skewness**2, PROBABILITIES)


def _lognormal(skewness: np.ndarray) -> np.ndarray:
    """Quantiles of exp(s Z); its skewness is (w + 2) sqrt(w - 1) with w = exp(s^2), a cubic in w."""
    root = skewness * np.sqrt(1.0 + skewness**2 / 4.0)
    w = np.cbrt(1.0 + skewness**2 / 2.0 + root) + np.cbrt(1.0 + skewness**2 / 2.0 - root) - 1.0
    return np.exp(np.sqrt(np.log(w)) * special.ndtri(PROBABILITIES))
