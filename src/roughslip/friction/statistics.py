"""Moments of the friction coefficient over windows, each with its interval from resampled strips.

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
from roughslip.validation import finite, gate, reals

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
        raise IllPosedError(f"{strips} strip(s) cannot show their own scatter: solve at least 2, better 100")
    if whole("the number of replicates", replicates) < FEWEST_REPLICATES:
        raise ParameterError(f"a 95 % interval needs at least {FEWEST_REPLICATES} replicates, not {replicates}")
    drawn = rng.multinomial(strips, np.full(strips, 1.0 / strips), size=replicates)
    return np.concatenate((np.ones((1, strips), dtype=np.int64), drawn))


def margin_of(statistic: str, strips: int | np.ndarray) -> np.ndarray:
    """Factor on the half width of its percentile interval from so many strips; of std, of that of its logarithm."""
    if statistic == "mean":
        return interval_margin(strips)
    return interval_margin(strips, SCALE_FREEDOM) if statistic in (*SCALE, *SHAPE) else np.ones(np.shape(strips))


def estimate_of(statistic: str, rows: np.ndarray, strips: int) -> Estimate:
    """The statistic with its interval from so many strips. rows : (1 + R, ...) of the sample, then of replicates."""
    kind = Estimate.of_scale if statistic in SCALE and (rows > 0.0).all() else Estimate.from_rows
    return kind(rows, float(margin_of(statistic, strips)))


def check_windows(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """mu as (S, W) floats with 0 where not valid, and valid; refuses what statistics cannot be taken of."""
    mu, valid, weights = reals("mu", mu), np.asarray(valid), np.asarray(weights)
    if valid.dtype != bool:
        raise ParameterError(f"valid must be of bool, not {valid.dtype}: take valid != 0")
    if mu.ndim != 2 or valid.shape != mu.shape:
        raise ParameterError(f"mu and valid must be (strips, windows), not {mu.shape} and {valid.shape}")
    if not np.isfinite(mu[valid]).all():
        raise ParameterError("mu must be finite in every valid window")
    if weights.ndim != 2 or weights.shape[1] != mu.shape[0] or weights.dtype.kind not in "iu" or (weights < 0).any():
        raise ParameterError(f"weights must be counts of {mu.shape[0]} strips, a row a replicate: see strip_weights")
    if len(weights) <= FEWEST_REPLICATES or (weights[0] != 1).any():
        raise ParameterError(f"weights need a row of ones and {FEWEST_REPLICATES} replicates: see strip_weights")
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


def resampled_quantiles(
    mu: np.ndarray, valid: np.ndarray, weights: np.ndarray, numerators: np.ndarray, denominator: int
) -> np.ndarray:
    """Empirical quantiles (1 + R, Q) of every replicate at the probabilities numerators / denominator.

    The smallest mu whose share of windows at or below it reaches the probability; 0 gives the minimum. Numerators
    ascend. Ranks are whole numbers, so nothing is rounded.
    """
    values, strip = _sorted_windows(mu, valid)
    ranks = np.maximum(-(-numerators * (weights @ valid.sum(axis=1))[:, None] // denominator), 1)
    rows = zip(weights, ranks, strict=True)
    return np.stack([values[np.searchsorted(np.cumsum(counts[strip]), rank)] for counts, rank in rows])


def resampled_distribution(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Empirical distribution function (1 + R, Q) of every replicate at its points (1 + R, Q): share of mu <= point."""
    values, strip = _sorted_windows(mu, valid)
    shares = np.empty(points.shape)
    for row, counts, at in zip(shares, weights, points, strict=True):
        reached = np.concatenate(([0], np.cumsum(counts[strip])))
        row[:] = reached[np.searchsorted(values, at, side="right")] / reached[-1]
    return shares


def _sorted_windows(mu: np.ndarray, valid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ascending mu of the valid windows and the strip of each."""
    values, strip = mu[valid], np.nonzero(valid)[0].astype(np.int32)
    order = np.argsort(values)  # equal ones in any order: only what comes after all of them is asked for
    return values[order], strip[order]


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
    std: Estimate = described("standard deviation")
    variation: Estimate = described("standard deviation over mean")
    skewness: Estimate = described("skewness")
    kurtosis: Estimate = described("excess kurtosis over a normal distribution")
    missing_share: Estimate = described("share of windows without mu")


@gate
def window_statistics(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> WindowStatistics:
    """Moments of the friction coefficient, each with its interval.

    mu : (S, W) [-] friction coefficient, S independent strips of W overlapping windows
    valid : (S, W) bool, windows that have one
    weights : (1 + R, S) counts from `strip_weights`

    Windows are pooled: moments are sums over all valid windows divided by their number n (no n - 1: overlapping windows
    are not n draws). The mean of strips is unbiased. The variance is low by that of the mean.
    Intervals of mean, std and variation are widened to Student's, the last two reflected too (`Estimate.of_scale`).
    From 20 strips on each end misses the truth in 1 to 4 % of the trials, on Gaussian and Beta strips. Intervals of
    skewness and kurtosis are widened too, and cover 94 to 98 % and 90 to 96 %; those of kurtosis lie too low where they
    miss. Raises IllPosedError where strips in contact are too few or mu has no scatter.
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


@gate
def ratio_of_sums(area: np.ndarray, force: np.ndarray, shear_strength_pa: float, weights: np.ndarray) -> Estimate:
    """tau sum(A) / sum(N) over all windows, light ones included: the friction coefficient of the strips as a whole.

    area, force : (S, W) [m^2], [N] contact area and normal force
    shear_strength_pa : [Pa] shear strength tau
    weights : (1 + R, S) counts from `strip_weights`
    """
    force = finite("force", force, 2)
    area = finite("area", area, 2)
    area, loaded = check_windows(area, np.asarray(force) > 0.0, weights)
    force, _ = check_windows(force, loaded, weights)
    totals = resampled(weights, np.stack((area.sum(axis=1), force.sum(axis=1)), axis=1))
    return estimate_of("mean", shear_strength_pa * totals[:, 0] / totals[:, 1], len(area))
