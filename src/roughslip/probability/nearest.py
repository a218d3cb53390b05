"""Which of several samples lies nearest to the Beta distribution of the paper."""

from __future__ import annotations

import numpy as np

from roughslip.probability.distributions import beta_moments

PAPER_SKEWNESS = beta_moments(2.1, 5.0).skewness
SAME_SKEWNESS = 0.5  # relative; that of the normal distribution, 0.05 from Beta(2.1, 5) in Kolmogorov distance, is 1


def nearest_level(distance: np.ndarray, skewness: np.ndarray, among: np.ndarray) -> int:
    """Number of the penetration where friction lies nearest to the paper's Beta: of those as skewed, else of all.

    distance, skewness : (levels,) [-] Kolmogorov distance, both standardised, and skewness of the windows
    among : (levels,) bool, of the levels that count
    """
    is_skewed = np.abs(skewness / PAPER_SKEWNESS - 1.0) <= SAME_SKEWNESS
    return int(np.argmin(np.where(among, np.where(is_skewed, distance, 1.0 + distance), np.inf)))
