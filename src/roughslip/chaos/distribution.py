"""Empirical distributions of the pressure given contact, with their sampling error.

An infinite pressure, which the exponential of a poor fit of eq. (9) can give, is larger than every level and counts
as such; NaN is refused.
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

    Returns F : (n,) [-] share of the positive pressures that are at most each level. Raises ParameterError for NaN,
    IllPosedError where nothing is in contact.
    """
    positive = _ascending(pressure[pressure > 0], of=pressure)
    return np.searchsorted(positive, levels, side="right") / len(positive)


def quantile_levels(pressure: np.ndarray, lowest: float = 1e-4, count: int = 120) -> np.ndarray:
    """Levels at which to draw a distribution, dense in both of its tails.

    pressure : (...) [Pa] samples, zero out of contact
    lowest : [-] smallest probability, below 1/2; the largest is 1 - lowest
    count : number of probabilities from `lowest` to 1/2

    Returns levels : (2 count - 1,) [Pa] ascending quantiles of the positive pressures, fewer where some are equal.
    Raises as cumulative_given_contact, and ParameterError for an infinite pressure.
    """
    if np.isinf(pressure).any():
        raise ParameterError("quantiles need finite pressures")
    tail = np.geomspace(lowest, 0.5, count)
    probabilities = np.concatenate([tail, 1.0 - tail[::-1]])
    return np.unique(np.quantile(_ascending(pressure[pressure > 0], of=pressure), probabilities))


def kolmogorov_distance(first: np.ndarray, second: np.ndarray) -> float:
    """sup |F1 - F2| of two samples; equal values, such as the atom at zero pressure, are counted in one step.

    first, second : (n1,), (n2,)

    Raises ParameterError for NaN, IllPosedError for an empty sample.
    """
    a, b = _ascending(first, of=first), _ascending(second, of=second)
    both = np.concatenate([a, b])
    share_a, share_b = (np.searchsorted(x, both, side="right") / len(x) for x in (a, b))
    return float(np.max(np.abs(share_a - share_b)))


def _ascending(values: np.ndarray, of: np.ndarray) -> np.ndarray:
    """The values in order, after a check of all the samples that they are chosen of."""
    if np.isnan(of).any():
        raise ParameterError("pressures must not be NaN")
    if values.size == 0:
        raise IllPosedError("no sample is in contact: there is no distribution given contact; penetrate deeper")
    return np.sort(values, axis=None)
