"""Stationary random friction along the belt: a marginal and an exponential autocorrelation.

mu_S is a Gaussian process translated to the marginal, less its mean (M. Grigoriu, J. Eng. Mech. 110 (1984) 610-620).
How its paths are drawn is in recursion.py, piece by piece, and in whole_paths.py.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.special import betainccinv, betaincinv, betaln, ndtr

from roughslip.errors import IllPosedError, ParameterError, real
from roughslip.validation import reals

PAPER_SHAPES = (2.1, 5.0)  # of the Beta distribution in section 4 of the paper
FEWEST_QUANTILES = 10
NEGLIGIBLE = 1e-12  # a share of the support


class Marginal(Protocol):
    """A distribution of mu as its quantile function, in a unit of its own."""

    @property
    def mean(self) -> float:
        """Mean of mu [-]."""

    @property
    def standard_deviation(self) -> float:
        """Standard deviation of mu [-]."""

    @property
    def scale(self) -> float:
        """The unit of `centred` [-]; 0 stands for no scatter."""

    def centred(self, z: np.ndarray) -> np.ndarray:
        """(mu - mean) / scale : (as z) [-] at standard normal scores z."""


@dataclass(frozen=True)
class BetaMarginal:
    """mu = lower + (upper - lower) Beta(a, b).

    a, b : [-] shapes > 0
    lower, upper : [-] ends of the support of mu; equal ones stand for no scatter
    """

    a: float
    b: float
    lower: float
    upper: float

    def __post_init__(self) -> None:
        for name in ("a", "b"):
            _require_positive(f"BetaMarginal.{name}", getattr(self, name))
        lower, upper = real("the lower end", self.lower), real("the upper end", self.upper)
        if not (math.isfinite(lower) and math.isfinite(upper) and lower <= upper):
            raise ParameterError(f"the support of mu must be finite and in order, not {self.lower} to {self.upper}")

    @classmethod
    def of_moments(cls, a: float, b: float, mean: float, standard_deviation: float) -> BetaMarginal:
        """The Beta distribution of these shapes, mean and standard deviation."""
        width = standard_deviation / np.sqrt(a * b / ((a + b) ** 2 * (a + b + 1)))
        lower = mean - width * a / (a + b)
        return cls(a, b, lower, lower + width)

    @property
    def mean(self) -> float:
        """Mean of mu [-]."""
        return self.lower + self.scale * self.a / (self.a + self.b)

    @property
    def standard_deviation(self) -> float:
        """Standard deviation of mu [-]."""
        total = self.a + self.b
        return self.scale * math.sqrt(self.a * self.b / (total + 1.0)) / total

    @property
    def scale(self) -> float:
        """Width of the support [-]."""
        return self.upper - self.lower

    def centred(self, z: np.ndarray) -> np.ndarray:
        """The Beta quantile on (0, 1) less its mean, each tail from its own probability."""
        a, b = self.a, self.b
        lower, upper = ndtr(np.minimum(z, 0.0)), ndtr(-np.maximum(z, 0.0))
        quantile = np.where(z < 0.0, betaincinv(a, b, lower), betainccinv(a, b, upper))
        if np.isnan(quantile).any():
            extreme = np.where(z < 0.0, _extreme(a, b, lower), 1.0 - _extreme(b, a, upper))
            quantile = np.where(np.isnan(quantile), extreme, quantile)
        return quantile - a / (a + b)


@dataclass(frozen=True, eq=False)
class EmpiricalMarginal:
    """The distribution of measured values, shifted and scaled to a mean and a standard deviation.

    quantiles : (n + 1,) increasing, at the probabilities 0, 1/n, ..., 1; linear between them
    mean, standard_deviation : [-] of mu
    """

    quantiles: np.ndarray
    mean: float
    standard_deviation: float

    def __post_init__(self) -> None:
        q = reals("quantiles", self.quantiles)
        if q.ndim != 1 or q.size < FEWEST_QUANTILES or not np.isfinite(q).all() or (np.diff(q) < 0.0).any():
            raise ParameterError(f"quantiles are a row of at least {FEWEST_QUANTILES} finite increasing numbers")
        mean, deviation = real("the mean", self.mean), real("the standard deviation", self.standard_deviation)
        if not (math.isfinite(mean) and math.isfinite(deviation) and deviation >= 0.0):
            raise ParameterError(
                f"mean and standard deviation of mu must be finite and the latter not negative, not {self.mean} and "
                f"{self.standard_deviation}"
            )
        if not q[-1] - q[0] > 1e-12 * max(abs(q[0]), abs(q[-1])):
            raise IllPosedError("the quantiles are all equal: they have no distribution; give a Beta marginal")

    @property
    def scale(self) -> float:
        """The standard deviation [-]."""
        return self.standard_deviation

    def centred(self, z: np.ndarray) -> np.ndarray:
        """The standardised quantile; mean and variance of a piecewise linear quantile function are exact."""
        q = (self.quantiles - self.quantiles[0]) / (self.quantiles[-1] - self.quantiles[0])
        left, right = q[:-1], q[1:]
        mean = float(np.mean(left + right)) / 2.0
        variance = float(np.mean(left**2 + left * right + right**2)) / 3.0 - mean**2
        return (np.interp(ndtr(z), np.linspace(0.0, 1.0, q.size), q) - mean) / math.sqrt(variance)


@dataclass(frozen=True)
class FrictionProcess:
    """mu_S along the slipped distance s: mu of the marginal less its mean, with the autocorrelation exp(-s / L).

    marginal : of mu
    correlation_length_m : [m] L > 0
    """

    marginal: Marginal
    correlation_length_m: float

    def __post_init__(self) -> None:
        _require_positive("FrictionProcess.correlation_length_m", self.correlation_length_m)


def _extreme(a: float, b: float, p: np.ndarray) -> np.ndarray:
    """The Beta quantile x where it is next to nothing, x^a = a B(a, b) p; NaN elsewhere.

    scipy 1.17 has NaN there for some shapes and p below 1e-15.
    """
    x = np.exp((np.log(np.maximum(p, 1e-300)) + math.log(a) + betaln(a, b)) / a)
    return np.where(x < NEGLIGIBLE, x, math.nan)


def _require_positive(name: str, value: float) -> None:
    if not (math.isfinite(real(name, value)) and value > 0.0):
        raise ParameterError(f"{name} must be finite and positive, not {value}")
