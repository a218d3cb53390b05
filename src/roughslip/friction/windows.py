"""Friction coefficient of windows that slide along a strip, and its moments, each with an interval.

Bowden and Tabor, The Friction and Lubrication of Solids, 1950: junctions shear at the strength tau of the softer body,
so mu = tau A / N. As A / N of a vanishing contact grows without bound (Hertz: A / N ~ 1 / a), windows below a least
contact area have no mu; they are marked, never averaged.

Windows of one strip overlap and are correlated; strips are independent. So whole strips are resampled (Efron and
Tibshirani, An Introduction to the Bootstrap, 1993, ch. 8). A replicate is a row of counts, one a strip; row 0 counts
each strip once and is the sample. Moments of all replicates follow from one product of the counts with sums over
strips. Levels of penetration share their counts, so that differences between levels are paired.
"""

from __future__ import annotations

import numpy as np

from roughslip.errors import IllPosedError, ParameterError, whole
from roughslip.probability import Estimate
from roughslip.probability.estimate import SCALE_FREEDOM, interval_margin
from roughslip.results import described, result
from roughslip.validation import finite, gate, positive, reals

Windows = tuple[np.ndarray, np.ndarray]  # mu and valid, or area and force, each (..., S, W)


@gate
def window_sums(column_sums: np.ndarray, window_nodes: int, stride_nodes: int) -> np.ndarray:
    """Sums over windows of `window_nodes` columns that start every `stride_nodes` columns.

    column_sums : (..., nx) a quantity summed across the strip, a column a node along it
    window_nodes, stride_nodes : length of a window and distance of two starts [columns]

    Returns (..., W) with W = (nx - window_nodes) // stride_nodes + 1.

    Differences of one running sum a strip. Both ends of a window share the roundings made before it, so the error is at
    most (window_nodes + 1) 2^-53 sum|column_sums| of the strip. Terms >= 0 give sums >= 0, and windows of zeros exactly
    0. A strip's result does not depend on the other strips.
    """
    columns = finite("column_sums", column_sums)
    nx = columns.shape[-1] if columns.ndim else 0
    if whole("stride_nodes", stride_nodes) < 1 or not 1 <= whole("window_nodes", window_nodes) <= nx:
        raise ParameterError(
            f"window_nodes = {window_nodes} every stride_nodes = {stride_nodes} does not fit a strip of {nx} columns: "
            "1 <= window <= strip and stride >= 1"
        )
    running = np.zeros((*columns.shape[:-1], nx + 1))
    np.cumsum(columns, axis=-1, out=running[..., 1:])
    start = np.arange(0, nx - window_nodes + 1, stride_nodes)
    return running[..., start + window_nodes] - running[..., start]


@gate
def friction_coefficient(
    area: np.ndarray, force: np.ndarray, shear_strength_pa: float, least_area_m2: float
) -> tuple[np.ndarray, np.ndarray]:
    """mu = tau A / N of every window with at least the least contact area.

    area : (...) [m^2] real area of contact of a window
    force : (...) [N] normal force of a window
    shear_strength_pa : [Pa] shear strength tau of the junctions
    least_area_m2 : [m^2] contact area, positive, below which a window has no mu

    Returns (mu, valid): mu (...) [-], 0 where a window has none, and valid (...) bool.
    Raises ParameterError where a contact carries no force: area and force then do not belong together.
    """
    force = finite("force", force)
    area = finite("area", area)
    if area.shape != force.shape:
        raise ParameterError(f"area {area.shape} and force {force.shape} must have one shape")
    if (area < 0.0).any() or (force < 0.0).any():
        raise ParameterError("contact area and normal force of a window must not be negative")
    positive("shear_strength_pa", shear_strength_pa, "Pa")
    positive("least_area_m2", least_area_m2, "m^2")
    valid = area >= least_area_m2
    if (force[valid] <= 0.0).any():
        raise ParameterError("a window in contact carries no normal force: area and force do not belong together")
    return shear_strength_pa * np.divide(area, force, out=np.zeros_like(area), where=valid), valid


BIN_EDGES = 513  # at which a resampled distribution is counted
SCALE = ("std", "variation")
SHAPE = ("skewness", "kurtosis")

FEWEST_REPLICATES = 40
"""Below this many replicates the ends of a 95 % interval are the extreme replicates."""

NO_SCATTER = 1e-10
"""Scatter below this share of the mean is rounding: window sums carry errors of some 1e-12."""

CANCELLED = 1e-3
"""Scatter below this share of the distance from the sample's mean: a fourth moment about it has 4 digits left."""


@gate
def strip_weights(strips: int, replicates: int, rng: np.random.Generator) -> np.ndarray:
    """Counts (1 + replicates, strips): row 0 ones, the sample; the others multinomial, the bootstrap replicates."""
    if strips < 2:
        raise IllPosedError(f"strips must be at least 2, better 100, to show their own scatter, not {strips}")
    if whole("replicates", replicates) < FEWEST_REPLICATES:
        raise ParameterError(f"a 95 % interval needs at least {FEWEST_REPLICATES} replicates, not {replicates}")
    drawn = rng.multinomial(strips, np.full(strips, 1.0 / strips), size=replicates)
    return np.concatenate((np.ones((1, strips), dtype=np.int64), drawn))


def estimate_of(statistic: str, rows: np.ndarray, strips: int) -> Estimate:
    """The statistic with its interval from so many strips. rows : (1 + R, ...) of the sample, then of replicates"""
    freedom = {"mean": 1.0} | dict.fromkeys((*SCALE, *SHAPE), SCALE_FREEDOM)
    margin = float(interval_margin(strips, freedom[statistic])) if statistic in freedom else 1.0
    kind = Estimate.of_scale if statistic in SCALE and (rows > 0.0).all() else Estimate.from_rows
    return kind(rows, margin)


def check_windows(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """mu as (S, W) floats with 0 where not valid, and valid; refuses what statistics cannot be taken of."""
    mu, valid, weights = reals("mu", mu), np.asarray(valid), np.asarray(weights)
    if mu.ndim != 2 or valid.shape != mu.shape or valid.dtype != bool:
        raise ParameterError(
            f"mu and valid must be (strips, windows), valid of bool, not {mu.shape} and {valid.shape} of {valid.dtype}"
        )
    if not np.isfinite(mu[valid]).all():
        raise ParameterError("mu must be finite in every valid window")
    are_counts = weights.shape[1:] == mu.shape[:1] and weights.dtype.kind in "iu" and (weights >= 0).all()
    if not are_counts or len(weights) <= FEWEST_REPLICATES or (weights[0] != 1).any():
        raise ParameterError(
            f"weights must be counts of {mu.shape[0]} strips, a row of ones and then {FEWEST_REPLICATES} replicates or "
            "more: see strip_weights"
        )
    in_contact = valid.any(axis=1)
    if in_contact.sum() < 2 or not (weights @ in_contact).all():
        raise IllPosedError(
            f"only {in_contact.sum()} of {len(mu)} strips have a window with a friction coefficient, too few to "
            "resample: solve more strips, deepen the penetration or lower the least contact area"
        )
    return np.where(valid, mu, 0.0), valid


def resampled(weights: np.ndarray, strip_sums: np.ndarray) -> np.ndarray:
    """Totals (1 + R, k) of sums over strips (S, k), each strip counted as often as the row of weights says."""
    return weights.astype(np.float64) @ strip_sums


def power_sums(mu: np.ndarray, valid: np.ndarray, centre: float, order: int) -> np.ndarray:
    """Sums (S, order + 1) of (mu - centre)^k, k = 0 ... order, over the valid windows of each strip."""
    deviation = np.where(valid, mu - centre, 0.0)
    powers, power = [], np.ones_like(deviation)
    for _ in range(order):
        power *= deviation
        powers.append(power.sum(axis=1))
    return np.stack([np.sum(valid, axis=1, dtype=np.float64), *powers], axis=1)


def resampled_distribution(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Empirical distribution function (1 + R, Q) of every replicate at its points (1 + R, Q), ascending in a row.

    It is the share of mu <= point at BIN_EDGES over the range of all points, and linear between them. What lies between
    two edges is known only as a whole: some 1 / 500 of the windows, which scatters far less than the function itself.
    """
    edges = np.linspace(points.min(), points.max(), BIN_EDGES)
    first = np.searchsorted(edges, mu[valid])  # the first edge that is not below
    each = np.nonzero(valid)[0] * (BIN_EDGES + 1) + first
    counts = np.bincount(each, minlength=len(mu) * (BIN_EDGES + 1)).reshape(len(mu), -1)
    reached = resampled(weights, np.cumsum(counts, axis=1))
    return np.array([np.interp(at, edges, row[:-1] / row[-1]) for at, row in zip(points, reached, strict=True)])


def require_scatter(variance: np.ndarray, centre: float, shift: np.ndarray | float = 0.0) -> None:
    """Raises IllPosedError where a variance (1 + R,) is no more than rounding.

    centre : mean of the sample
    shift : (1 + R,) distance of a row's mean from it, where the variance was taken about it: its square has cancelled
    """
    if (variance <= np.maximum((NO_SCATTER * centre) ** 2, (CANCELLED * shift) ** 2)).any():
        raise IllPosedError(
            "the friction coefficient has no scatter in the sample or a resampled one, so its shape is undefined. "
            "Solve more strips; a fully plastic contact has mu = tau / H exactly and needs no statistics"
        )


@result
class WindowStatistics:
    """Statistics of mu over the windows that have one."""

    mean: Estimate = described("mean friction coefficient")
    std: Estimate = described("standard deviation of the friction coefficient")
    variation: Estimate = described("coefficient of variation")
    skewness: Estimate = described("skewness; of 20 strips or more its interval holds the truth in 94 to 98 % of cases")
    kurtosis: Estimate = described(
        "excess kurtosis; of 20 strips or more its interval holds the truth in 90 to 96 %, else it is too low"
    )
    missing_share: Estimate = described("share of windows with too little contact for a friction coefficient")


@gate
def window_statistics(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> WindowStatistics:
    """Moments of the friction coefficient, each with its interval.

    mu : (S, W) [-] friction coefficient, S independent strips of W overlapping windows
    valid : (S, W) bool, windows that have one
    weights : (1 + R, S) counts from `strip_weights`

    Windows are pooled: moments are sums over all valid windows divided by their number n (no n - 1: overlapping windows
    are not n draws). The mean of strips is unbiased. The variance is low by that of the mean.
    Intervals are widened to Student's, and those of std and variation reflected (`Estimate.of_scale`). From 20 strips
    on each end misses the truth in 1 to 4 % of the trials, on Gaussian and Beta strips. Intervals of the kurtosis lie
    too low where they miss. Raises IllPosedError where strips in contact are too few or mu has no scatter.
    """
    mu = finite("mu", mu, 2)
    mu, valid = check_windows(mu, valid, weights)
    if (mu[valid] <= 0.0).any():
        raise ParameterError("a friction coefficient must be positive")
    centre = float(np.mean(mu[valid]))
    totals = resampled(weights, power_sums(mu, valid, centre, 4))
    n = totals[:, 0]
    m1, m2, m3, m4 = (totals[:, 1:] / n[:, None]).T
    variance = m2 - m1**2
    require_scatter(variance, centre, m1)
    std = np.sqrt(variance)
    third = m3 - 3.0 * m1 * m2 + 2.0 * m1**3
    fourth = m4 - 4.0 * m1 * m3 + 6.0 * m1**2 * m2 - 3.0 * m1**4
    strips, windows = len(mu), mu.shape[1] * weights.sum(axis=1)
    return WindowStatistics(
        mean=estimate_of("mean", centre + m1, strips),
        std=estimate_of("std", std, strips),
        variation=estimate_of("variation", std / (centre + m1), strips),
        skewness=estimate_of("skewness", third / std**3, strips),
        kurtosis=estimate_of("kurtosis", fourth / variance**2 - 3.0, strips),
        missing_share=Estimate.from_rows(1.0 - n / windows),
    )


def ratio_of_sums(area: np.ndarray, force: np.ndarray, shear_strength_pa: float, weights: np.ndarray) -> Estimate:
    """tau sum(A) / sum(N) over all windows, light ones included: the friction coefficient of the strips as a whole.

    area, force : (S, W) [m^2], [N] contact area and normal force
    shear_strength_pa : [Pa] shear strength tau
    weights : (1 + R, S) counts from `strip_weights`
    """
    totals = resampled(weights, np.stack((area.sum(axis=1), force.sum(axis=1)), axis=1))
    return estimate_of("mean", shear_strength_pa * totals[:, 0] / totals[:, 1], len(area))
