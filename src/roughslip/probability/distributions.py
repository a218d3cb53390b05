"""Distributions of heights and of friction coefficients: of Beta type by its ends, and by measured quantiles.

Each is a translation x(g) = F^-1(Phi(g)) of a standard normal variable g, so both tails keep relative accuracy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import betainccinv, betaincinv, betaln, ndtr

from roughslip.errors import IllPosedError, ParameterError
from roughslip.validation import finite, gate, not_negative, positive

NEGLIGIBLE = 1e-12  # share of the support of a Beta distribution
FEWEST_QUANTILES = 10


class Moments(NamedTuple):
    """Mean, standard deviation, skewness and excess kurtosis."""

    mean: float
    standard_deviation: float
    skewness: float
    excess_kurtosis: float


@gate
def beta_moments(a: float, b: float) -> Moments:
    """Moments of Beta(a, b) on (0, 1)."""
    total = a + b
    variance = a * b / (total**2 * (total + 1.0))
    skewness = 2.0 * (b - a) * math.sqrt(total + 1.0) / ((total + 2.0) * math.sqrt(a * b))
    excess = 6.0 * ((a - b) ** 2 * (total + 1.0) - a * b * (total + 2.0)) / (a * b * (total + 2.0) * (total + 3.0))
    return Moments(a / total, math.sqrt(variance), skewness, excess)


def beta_from_gaussian(normal: np.ndarray, a: float, b: float) -> np.ndarray:
    """Quantiles of Beta(a, b) on (0, 1) : (as normal) at standard normal scores, each tail from its own probability."""
    lower, upper = ndtr(np.minimum(normal, 0.0)), ndtr(-np.maximum(normal, 0.0))
    quantile = np.where(normal < 0.0, betaincinv(a, b, lower), betainccinv(a, b, upper))
    if not np.isnan(quantile).any():
        return quantile
    extreme = np.where(normal < 0.0, _smallest_quantile(a, b, lower), 1.0 - _smallest_quantile(b, a, upper))
    return np.where(np.isnan(quantile), extreme, quantile)


def _smallest_quantile(a: float, b: float, p: np.ndarray) -> np.ndarray:
    """The Beta quantile x where it is negligible, x^a = a B(a, b) p; NaN elsewhere.

    scipy 1.17 returns NaN there for some shapes and p below 1e-15.
    """
    x = np.exp((np.log(np.maximum(p, 1e-300)) + math.log(a) + betaln(a, b)) / a)
    return np.where(x < NEGLIGIBLE, x, math.nan)


@gate
@dataclass(frozen=True)
class BetaDistribution:
    """x = lower + (upper - lower) Beta(a, b).

    a, b : [-] shapes > 0. With a > b the tail hangs below a plateau, as of worn surfaces
    lower, upper : [unit of x] ends of the support; equal ones stand for no scatter
    """

    a: float
    b: float
    lower: float
    upper: float

    def __post_init__(self) -> None:
        for name in ("a", "b"):
            positive(f"BetaDistribution.{name}", getattr(self, name))
        lower, upper = finite("lower", self.lower), finite("upper", self.upper)
        if lower > upper:
            raise ParameterError(f"lower and upper must be in order, not {self.lower} and {self.upper}")

    @classmethod
    @gate
    def of_moments(cls, a: float, b: float, mean: float, standard_deviation: float) -> BetaDistribution:
        """The Beta distribution of these shapes, mean and standard deviation."""
        width = standard_deviation / beta_moments(a, b).standard_deviation
        lower = mean - width * a / (a + b)
        return cls(a, b, lower, lower + width)

    @property
    def mean(self) -> float:
        """Mean of x."""
        return self.lower + self.scale * self.a / (self.a + self.b)

    @property
    def standard_deviation(self) -> float:
        """Standard deviation of x."""
        return self.scale * beta_moments(self.a, self.b).standard_deviation

    @property
    def scale(self) -> float:
        """Width of the support, the unit of `centred`; 0 stands for no scatter."""
        return self.upper - self.lower

    @gate
    def centred(self, normal: np.ndarray) -> np.ndarray:
        """(x - mean) / scale : (as normal) [-] at standard normal scores."""
        return beta_from_gaussian(normal, self.a, self.b) - self.a / (self.a + self.b)

    @gate
    def from_gaussian(self, normal: np.ndarray) -> np.ndarray:
        """x - mean : (as normal) [unit of x] at standard normal scores."""
        return self.scale * self.centred(normal)


@gate
@dataclass(frozen=True, eq=False)
class QuantileDistribution:
    """The distribution of measured values, shifted and scaled to a mean and a standard deviation.

    quantiles : (n + 1,) increasing, at the probabilities 0, 1/n, ..., 1; linear between them
    mean, standard_deviation : [unit of x] of x
    """

    quantiles: np.ndarray
    mean: float
    standard_deviation: float

    def __post_init__(self) -> None:
        q = finite("quantiles", self.quantiles, 1)
        if q.size < FEWEST_QUANTILES or (np.diff(q) < 0.0).any():
            raise ParameterError(f"quantiles must be at least {FEWEST_QUANTILES} increasing numbers, not {q.size}")
        finite("the mean", self.mean)
        not_negative("the standard deviation", self.standard_deviation)
        if not q[-1] - q[0] > 1e-12 * max(abs(q[0]), abs(q[-1])):
            raise IllPosedError(
                f"the quantiles are all equal to {q[0]:.6g}: they have no distribution; give a BetaDistribution, "
                "which may have no scatter; scene key: ensemble.marginal"
            )

    @property
    def scale(self) -> float:
        """The standard deviation, the unit of `centred`; 0 stands for no scatter."""
        return self.standard_deviation

    @gate
    def centred(self, normal: np.ndarray) -> np.ndarray:
        """(x - mean) / scale : (as normal) [-]; mean and variance of a piecewise linear quantile function are exact."""
        q = (self.quantiles - self.quantiles[0]) / (self.quantiles[-1] - self.quantiles[0])
        left, right = q[:-1], q[1:]
        mean = float(np.mean(left + right)) / 2.0
        variance = float(np.mean(left**2 + left * right + right**2)) / 3.0 - mean**2
        return (np.interp(ndtr(normal), np.linspace(0.0, 1.0, q.size), q) - mean) / math.sqrt(variance)
