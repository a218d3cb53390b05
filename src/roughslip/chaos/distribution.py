"""Empirical distributions of the pressure given contact, with their sampling error.

An infinite pressure, which the exponential of a poor fit of eq. (9) can give, is larger than every level. NaN is
refused.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from roughslip.errors import IllPosedError, ParameterError

NORMAL_95 = float(ndtri(0.975))


def wilson_interval(successes: np.ndarray | float, trials: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """95 % interval of a probability from independent trials; it never leaves [0, 1].

    successes, trials : (...) 0 <= successes <= trials, fractions allowed; no trials give the interval [0, 1]

    Returns (low, high) : (...) [-]. Raises ParameterError.

    Method: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209.
    """
    k, n = np.asarray(successes, dtype=np.float64), np.asarray(trials, dtype=np.float64)
    if not (np.isfinite(n).all() and np.all((k >= 0) & (k <= n))):
        raise ParameterError("successes must lie between none and all of the trials, which must be finite")
    squared = NORMAL_95**2
    centre = (k + squared / 2) / (n + squared)
    half = NORMAL_95 * np.sqrt(k * (n - k) / np.where(n > 0, n, 1.0) + squared / 4) / (n + squared)
    return np.maximum(centre - half, 0.0), np.minimum(centre + half, 1.0)


def cumulative_given_contact(pressure: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Distribution of the pressure given contact.

    pressure : (...) [Pa] samples, zero out of contact
    levels : (n,) [Pa]

    Returns F : (n,) [-] share of the positive pressures up to each level. Raises ParameterError for NaN, IllPosedError
    where no sample is in contact.
    """
    positive = _ascending(pressure[pressure > 0], of=pressure)
    return np.searchsorted(positive, levels, side="right") / len(positive)


def quantile_levels(pressure: np.ndarray, lowest: float = 1e-4, count: int = 120) -> np.ndarray:
    """Levels for the plot of a distribution, dense in both tails.

    pressure : (...) [Pa] samples, zero out of contact
    lowest : [-] smallest probability, below 1/2; the largest is 1 - lowest
    count : number of probabilities from `lowest` to 1/2

    Returns levels : (2 count - 1,) [Pa] ascending quantiles of the positive pressures, fewer where some are equal.
    Raises as cumulative_given_contact, and ParameterError for infinite pressures.
    """
    if np.isinf(pressure).any():
        raise ParameterError("quantiles need finite pressures")
    tail = np.geomspace(lowest, 0.5, count)
    probabilities = np.concatenate([tail, 1.0 - tail[::-1]])
    return np.unique(np.quantile(_ascending(pressure[pressure > 0], of=pressure), probabilities))


def kolmogorov_distance(first: np.ndarray, second: np.ndarray) -> float:
    """Kolmogorov distance sup |F1 - F2| of two samples; equal values, such as zero pressures, form one step.

    first, second : (n1,), (n2,)

    Raises ParameterError for NaN, IllPosedError for an empty sample.
    """
    a, b = _ascending(first, of=first), _ascending(second, of=second)
    both = np.concatenate([a, b])
    share_a, share_b = (np.searchsorted(x, both, side="right") / len(x) for x in (a, b))
    return float(np.max(np.abs(share_a - share_b)))


def _ascending(values: np.ndarray, of: np.ndarray) -> np.ndarray:
    """The values in ascending order, after a check of all samples `of` which they were selected."""
    if np.isnan(of).any():
        raise ParameterError("pressures must not be NaN")
    if values.size == 0:
        raise IllPosedError(
            "no sample is in contact: there is no distribution given contact; take a deeper penetration"
        )
    return np.sort(values, axis=None)
