"""A statistic with its 95 % interval."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.special import chdtri

TAILS = (0.025, 0.975)  # probabilities of the ends of a 95 % interval
CHANCE = 0.1  # of a pilot that shows less variance than `variance_margin` allows for


def variance_margin(samples: int) -> float:
    """Factor on the variance that few Gaussian samples show, which holds the true one but for CHANCE."""
    return float((samples - 1) / chdtri(samples - 1, 1.0 - CHANCE))


@dataclass(frozen=True)
class Estimate:
    """A statistic with its 95 % interval.

    value, low, high : (...) point estimate and ends of the interval
    replicates : (..., R) the statistic of each bootstrap replicate; empty where the interval has another source
    """

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray
    replicates: np.ndarray = field(default_factory=lambda: np.empty(0))

    @classmethod
    def from_rows(cls, rows: np.ndarray) -> Estimate:
        """Percentile interval of the bootstrap. rows : (1 + R, ...) the statistic of the sample, then of replicates."""
        replicates = np.ascontiguousarray(np.moveaxis(rows[1:], 0, -1))
        low, high = np.quantile(replicates, TAILS, axis=-1)
        return cls(np.array(rows[0]), np.asarray(low), np.asarray(high), replicates)

    @classmethod
    def of_distance(cls, rows: np.ndarray, moved: np.ndarray) -> Estimate:
        """Interval of a distance (). Noise can only raise a distance, so percentiles of its replicates lie too high.

        rows : (1 + R,) distance of a curve from a model or a family of models, in some norm
        moved : (R,) distance of each resampled curve from the curve of the sample, in the same norm

        By the triangle inequality the truth lies within the 95 % quantile of `moved` (Bickel and Krieger, Journal of
        the American Statistical Association 84, 1989), cut at 0. The interval is conservative.
        """
        value, radius = rows[0], np.quantile(moved, 0.95)
        return cls(np.array(value), np.maximum(value - radius, 0.0), np.asarray(value + radius), rows[1:].copy())

    @property
    def rows(self) -> np.ndarray:
        """(1 + R, ...) the value, then the replicates: the inverse of `from_rows`."""
        return np.concatenate((self.value[None], np.moveaxis(self.replicates, -1, 0)))
