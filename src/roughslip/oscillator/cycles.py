"""Statistics of an ensemble of stick-slip motions: cycle counts, and the point where the mass sticks again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from roughslip.errors import IllPosedError, ParameterError

NORMAL_95 = 1.959963984540054
REPLICATES = 1000
FEWEST_REALISATIONS = 8


@dataclass(frozen=True)
class CycleCounts:
    """Difference M_d - E[M_S] of cycle counts over the damping ratios, all (dampings,).

    mean, standard_error : of the count of a stochastic run
    difference, low, high : M_d - mean and its 95 % interval
    still_cycling : share of the runs with at least one cycle
    """

    mean: np.ndarray
    standard_error: np.ndarray
    difference: np.ndarray
    low: np.ndarray
    high: np.ndarray
    still_cycling: np.ndarray


def count_difference(deterministic: np.ndarray, stochastic: np.ndarray) -> CycleCounts:
    """Compare counts : (realisations, dampings) of independent runs with the deterministic (dampings,).

    The interval is the normal one of a mean. The same realisations serve every damping ratio, so neighbouring points
    of the curve err together. Raises IllPosedError for fewer than FEWEST_REALISATIONS.
    """
    realisations = len(stochastic)
    if realisations < FEWEST_REALISATIONS:
        raise IllPosedError(f"{realisations} realisations give no interval: run at least {FEWEST_REALISATIONS}")
    mean = stochastic.mean(axis=0)
    error = stochastic.std(axis=0, ddof=1) / np.sqrt(realisations)
    difference = deterministic - mean
    return CycleCounts(
        mean, error, difference, difference - NORMAL_95 * error, difference + NORMAL_95 * error,
        (stochastic > 0).mean(axis=0),
    )  # fmt: skip


@dataclass(frozen=True)
class Reattachment:
    """Moments of the reattachment point, each as (value, low, high) with a 95 % interval.

    mean, std : [m]
    skewness, kurtosis : [-], kurtosis in excess over the normal
    distance_to_normal : [-] Kolmogorov distance to the normal of the same mean and standard deviation
    events, realisations : what they rest on
    """

    mean: np.ndarray
    std: np.ndarray
    skewness: np.ndarray
    kurtosis: np.ndarray
    distance_to_normal: np.ndarray
    events: int
    realisations: int


def reattachment_statistics(
    position: np.ndarray, realisation: np.ndarray, generator: np.random.Generator
) -> Reattachment:
    """Moments of X : (events,) [m] at the start of stick, where realisation : (events,) says whose event it is.

    Cycles of one run follow on one another, so intervals come from resampling whole runs. Raises IllPosedError where
    fewer than FEWEST_REALISATIONS runs stick again, or where all do so at one place.
    """
    if position.shape != realisation.shape or not np.all(np.isfinite(position)):
        raise ParameterError("reattachment points must be finite, each with its realisation")
    owners, index = np.unique(realisation, return_inverse=True)
    if len(owners) < FEWEST_REALISATIONS:
        raise IllPosedError(f"only {len(owners)} runs stick again: lower the damping or run more realisations")
    order = np.argsort(position, kind="stable")
    values, index = position[order], index[order]
    centre, scale = values.mean(), values.std()
    if scale <= 1e-12 * np.abs(centre):
        raise IllPosedError("every run sticks again at the same place: the friction has no scatter")
    powers = ((values - centre) / scale)[None, :] ** np.arange(5)[:, None]
    sums = np.stack([np.bincount(index, weights=power, minlength=len(owners)) for power in powers])
    drawn = generator.multinomial(len(owners), np.full(len(owners), 1 / len(owners)), size=REPLICATES)
    weights = np.concatenate([np.ones((1, len(owners)), dtype=np.int64), drawn])
    moments = np.array([_moments(np.einsum("ks,s->k", sums, row)) for row in weights])
    moments[:, 0] = centre + scale * moments[:, 0]
    moments[:, 1] *= scale
    interval = np.quantile(moments[1:], [0.025, 0.975], axis=0)
    table = np.vstack([moments[:1], interval]).T
    distance = _distance_to_normal(values, index, weights[:201], moments[:201, 0], moments[:201, 1])
    mean, std, skewness, kurtosis = table
    return Reattachment(mean, std, skewness, kurtosis, distance, len(values), len(owners))


def _moments(sums: np.ndarray) -> tuple[float, float, float, float]:
    """Mean, standard deviation, skewness and excess kurtosis from the sums of powers 0 ... 4."""
    m1, m2, m3, m4 = sums[1:] / sums[0]
    variance = m2 - m1**2
    third = m3 - 3 * m1 * m2 + 2 * m1**3
    fourth = m4 - 4 * m1 * m3 + 6 * m1**2 * m2 - 3 * m1**4
    return m1, np.sqrt(variance), third / variance**1.5, fourth / variance**2 - 3


def _distance_to_normal(
    values: np.ndarray, index: np.ndarray, weights: np.ndarray, mean: np.ndarray, std: np.ndarray
) -> np.ndarray:
    """(value, low, high) of the Kolmogorov distance; resampling can only raise a distance, so the interval is the
    reflected one, cut at zero and holding the value."""
    distances = np.empty(len(weights))
    for row, counts in enumerate(weights):
        reached = np.cumsum(counts[index])
        normal = ndtr((values - mean[row]) / std[row])
        share = reached / reached[-1]
        before = np.concatenate([[0.0], share[:-1]])
        distances[row] = max(np.max(np.abs(share - normal)), np.max(np.abs(before - normal)))
    low, high = np.quantile(distances[1:], [0.025, 0.975])
    value = distances[0]
    return np.array([value, np.clip(2 * value - high, 0.0, value), max(2 * value - low, value)])
