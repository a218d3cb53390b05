"""Empirical distributions of the pressure given contact, with their sampling error."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from roughslip.errors import IllPosedError

NORMAL_95 = float(ndtri(0.975))


def wilson_interval(successes: np.ndarray | float, trials: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """(low, high) : 95 % interval of a probability from independent trials (Wilson 1927); never leaves [0, 1]."""
    n = np.maximum(np.asarray(trials, dtype=float), 1.0)
    share = np.asarray(successes) / n
    centre = (share + NORMAL_95**2 / (2 * n)) / (1 + NORMAL_95**2 / n)
    half = NORMAL_95 * np.sqrt(share * (1 - share) / n + NORMAL_95**2 / (4 * n**2)) / (1 + NORMAL_95**2 / n)
    return np.maximum(centre - half, 0.0), np.minimum(centre + half, 1.0)


def cumulative_given_contact(pressure: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """F : (len(levels),) share of the positive values of `pressure` that are at most each level.

    Raises IllPosedError where nothing is in contact.
    """
    positive = np.sort(pressure[pressure > 0])
    if len(positive) == 0:
        raise IllPosedError("no sample is in contact: there is no distribution given contact; penetrate deeper")
    return np.searchsorted(positive, levels, side="right") / len(positive)


def quantile_levels(pressure: np.ndarray, lowest: float = 1e-4, count: int = 120) -> np.ndarray:
    """levels : (2 count - 1,) [Pa] quantiles of the positive values, dense in both tails down to `lowest`."""
    tail = np.geomspace(lowest, 0.5, count)
    probabilities = np.concatenate([tail, 1.0 - tail[-2::-1]])
    return np.unique(np.quantile(pressure[pressure > 0], probabilities))


def kolmogorov_distance(first: np.ndarray, second: np.ndarray) -> float:
    """sup |F1 - F2| of two samples; equal values, such as the atom at zero pressure, are counted in one step."""
    a, b = np.sort(first), np.sort(second)
    both = np.concatenate([a, b])
    return float(
        np.max(
            np.abs(np.searchsorted(a, both, side="right") / len(a) - np.searchsorted(b, both, side="right") / len(b))
        )
    )
