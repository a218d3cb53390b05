"""A statistic with its 95 % interval."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtri, stdtrit

from roughslip.errors import ParameterError
from roughslip.validation import gate

TAILS = (0.025, 0.975)
"""Probabilities of the ends of a 95 % interval."""

NORMAL_95 = float(ndtri(TAILS[1]))
"""Half width of the 95 % interval of a normal variable, over its standard deviation."""

SCALE_FREEDOM = 1 / 3
"""Degrees of freedom of the variance of log std that resampled groups show, over those of a mean. Influences of
kurtosis k have 2 / (k + 2). k is 4 for Gaussian groups of three independent values each, and more for smaller ones."""


def student_95(samples: int | np.ndarray) -> np.ndarray:
    """Half width of Student's 95 % interval of a mean, over its standard error. samples : independent ones"""
    return np.asarray(stdtrit(np.asarray(samples) - 1, TAILS[1]))


@gate
def wilson_interval(successes: np.ndarray | float, trials: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """95 % interval of a probability from independent trials; it never leaves [0, 1].

    successes, trials : (...) 0 <= successes <= trials, fractions allowed; no trials give the interval [0, 1]

    Returns (low, high) : (...) [-]. Raises ParameterError.

    Method: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209. `scipy.stats.binomtest` takes one pair of whole numbers.
    """
    k, n = np.asarray(successes, dtype=np.float64), np.asarray(trials, dtype=np.float64)
    if not (np.isfinite(n).all() and np.all((k >= 0) & (k <= n))):
        raise ParameterError("successes must lie between none and all of the trials, which must be finite")
    squared = NORMAL_95**2
    centre = (k + squared / 2) / (n + squared)
    half = NORMAL_95 * np.sqrt(k * (n - k) / np.where(n > 0, n, 1.0) + squared / 4) / (n + squared)
    return np.maximum(centre - half, 0.0), np.minimum(centre + half, 1.0)


def interval_margin(samples: int | np.ndarray, freedom: float = 1.0) -> np.ndarray:
    """Factor on the half width of a percentile interval that makes it Student's.

    samples : independent ones, which are resampled; their replicates scatter by sqrt(1 - 1 / samples) too little
    freedom : degrees of freedom of the variance that they show, over those of a Gaussian mean, samples - 1
    """
    degrees = np.asarray(samples) - 1.0
    quantile = stdtrit(np.maximum(freedom * degrees, 1.0), TAILS[1])
    return np.asarray(quantile / ndtri(TAILS[1]) * np.sqrt(1.0 + 1.0 / degrees))


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
    def from_rows(cls, rows: np.ndarray, margin: float = 1.0) -> Estimate:
        """Percentile interval of the bootstrap.

        rows : (1 + R, ...) the statistic of the sample, then of replicates
        margin : factor on its distances from the value, see `interval_margin`
        """
        replicates = np.ascontiguousarray(np.moveaxis(rows[1:], 0, -1))
        low, high = rows[0] + margin * (np.quantile(replicates, TAILS, axis=-1) - rows[0])
        return cls(np.array(rows[0]), np.asarray(low), np.asarray(high), replicates)

    @classmethod
    def of_scale(cls, rows: np.ndarray, margin: float = 1.0) -> Estimate:
        """Interval of a standard deviation or a ratio to one, which a sample tends to show too small.

        Replicates lie below the value as the value lies below the truth. So the percentiles of their logarithms are
        reflected at the value: the basic interval of Davison and Hinkley, Bootstrap Methods, 1997, ch. 5.
        rows, margin : as of `from_rows`, above zero; the margin acts on logarithms
        """
        of_logarithm = cls.from_rows(np.log(rows), margin)
        low, high = 2.0 * of_logarithm.value - of_logarithm.high, 2.0 * of_logarithm.value - of_logarithm.low
        return cls(np.array(rows[0]), np.exp(low), np.exp(high), np.exp(of_logarithm.replicates))

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

    def __repr__(self) -> str:
        """`0.3001 [0.2983, 0.3024]`, or the shape of several."""
        if np.ndim(self.value):
            return f"Estimate of shape {np.shape(self.value)}"
        return "{:.4g} [{:.4g}, {:.4g}]".format(*(float(part) for part in (self.value, self.low, self.high)))

    @property
    def rows(self) -> np.ndarray:
        """(1 + R, ...) the value, then the replicates: the inverse of `from_rows`."""
        return np.concatenate((self.value[None], np.moveaxis(self.replicates, -1, 0)))


def columns_of(estimates: Estimate | Sequence[Estimate]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Value, lower and upper end of an estimate; those of several stack along a first axis."""
    if isinstance(estimates, Estimate):
        return estimates.value, estimates.low, estimates.high
    value, low, high = (np.array([getattr(each, part) for each in estimates]) for part in ("value", "low", "high"))
    return value, low, high
