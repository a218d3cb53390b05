"""Distributions of heights and of friction coefficients: of a family by its moments, and of Beta type by its ends."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy
from scipy.special import ndtr

from roughslip.errors import IllPosedError, ParameterError, real
from roughslip.probability.families import (
    FAMILIES,
    Moments,
    beta_from_gaussian,
    beta_moments,
    lognormal_moments,
    normal_score,
    weibull_moments,
)
from roughslip.validation import reals

SYMMETRIC_WEIBULL = 3.6023494257197  # shape at which the skewness of a Weibull distribution changes its sign
FEWEST_QUANTILES = 10


@dataclass(frozen=True)
class FamilyDistribution:
    """A distribution of a family, shifted and scaled to zero mean and the standard deviation given.

    family : "gaussian"; "beta" (shapes a, b), bounded on both sides; "weibull" (k) and "lognormal" (s), bounded below.
        The last two have a long upper tail, as peaks on a plain. s is the standard deviation of the logarithm
    standard_deviation : [unit of x] of heights Sq [m]
    shapes : of the family
    mirrored : x in place of -x, so that the tail hangs below a plateau (worn, honed surfaces)
    """

    family: str
    standard_deviation: float
    shapes: tuple[float, ...] = ()
    mirrored: bool = False

    def __post_init__(self) -> None:
        if self.family not in FAMILIES:
            raise ParameterError(f"there is no family {self.family!r}; choose one of {', '.join(FAMILIES)}")
        _require_positive("the standard deviation (of heights: the rms height)", self.standard_deviation)
        names, (least, most) = FAMILIES[self.family].shapes, FAMILIES[self.family].limits
        if len(self.shapes) != len(names):
            raise ParameterError(f"a {self.family} distribution has the shapes ({', '.join(names)}), not {self.shapes}")
        if not all(least <= real("a shape", shape) <= most for shape in self.shapes):
            raise ParameterError(f"shapes of a {self.family} distribution lie in {least} ... {most}, not {self.shapes}")

    @property
    def _moments(self) -> Moments:
        return FAMILIES[self.family].moments(*self.shapes)

    @property
    def skewness(self) -> float:
        """Third standardised moment [-]."""
        return -self._moments.skewness if self.mirrored else self._moments.skewness

    @property
    def excess_kurtosis(self) -> float:
        """Fourth standardised moment less 3 [-]."""
        return self._moments.excess_kurtosis

    def from_gaussian(self, normal: np.ndarray) -> np.ndarray:
        """x : (as normal) = F^-1(Phi(g)), increasing, of standard normal g."""
        sign = -1.0 if self.mirrored else 1.0
        x = FAMILIES[self.family].from_gaussian(sign * np.asarray(normal, dtype=float), *self.shapes)
        return sign * self.standard_deviation * (x - self._moments.mean) / self._moments.standard_deviation

    def quantile(self, probability: float | np.ndarray) -> np.ndarray:
        """x : (as probability) value below which that share of the ensemble lies."""
        return self.from_gaussian(normal_score(probability))

    def cdf(self, value: float | np.ndarray) -> np.ndarray:
        """F : (as value) [-] probability of lying below the value."""
        x = np.asarray(value, dtype=float) / self.standard_deviation
        if np.isnan(x).any():
            raise ParameterError("values must be numbers")
        sign = -1.0 if self.mirrored else 1.0
        below = FAMILIES[self.family].cdf(
            self._moments.mean + self._moments.standard_deviation * sign * x, *self.shapes
        )
        return 1.0 - below if self.mirrored else below


@dataclass(frozen=True)
class BetaDistribution:
    """x = lower + (upper - lower) Beta(a, b).

    a, b : [-] shapes > 0
    lower, upper : [unit of x] ends of the support; equal ones stand for no scatter
    """

    a: float
    b: float
    lower: float
    upper: float

    def __post_init__(self) -> None:
        for name in ("a", "b"):
            _require_positive(f"BetaDistribution.{name}", getattr(self, name))
        lower, upper = real("the lower end", self.lower), real("the upper end", self.upper)
        if not (math.isfinite(lower) and math.isfinite(upper) and lower <= upper):
            raise ParameterError(f"the support must be finite and in order, not {self.lower} to {self.upper}")

    @classmethod
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

    def centred(self, normal: np.ndarray) -> np.ndarray:
        """(x - mean) / scale : (as normal) [-] at standard normal scores."""
        return beta_from_gaussian(normal, self.a, self.b) - self.a / (self.a + self.b)


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
        q = reals("quantiles", self.quantiles)
        if q.ndim != 1 or q.size < FEWEST_QUANTILES or not np.isfinite(q).all() or (np.diff(q) < 0.0).any():
            raise ParameterError(f"quantiles are a row of at least {FEWEST_QUANTILES} finite increasing numbers")
        mean, deviation = real("the mean", self.mean), real("the standard deviation", self.standard_deviation)
        if not (math.isfinite(mean) and math.isfinite(deviation) and deviation >= 0.0):
            raise ParameterError(
                f"the mean must be finite and the standard deviation finite and not negative, not {self.mean} and "
                f"{self.standard_deviation}"
            )
        if not q[-1] - q[0] > 1e-12 * max(abs(q[0]), abs(q[-1])):
            raise IllPosedError("the quantiles are all equal: they have no distribution; give a Beta distribution")

    @property
    def scale(self) -> float:
        """The standard deviation, the unit of `centred`; 0 stands for no scatter."""
        return self.standard_deviation

    def centred(self, normal: np.ndarray) -> np.ndarray:
        """(x - mean) / scale : (as normal) [-]; mean and variance of a piecewise linear quantile function are exact."""
        q = (self.quantiles - self.quantiles[0]) / (self.quantiles[-1] - self.quantiles[0])
        left, right = q[:-1], q[1:]
        mean = float(np.mean(left + right)) / 2.0
        variance = float(np.mean(left**2 + left * right + right**2)) / 3.0 - mean**2
        return (np.interp(ndtr(normal), np.linspace(0.0, 1.0, q.size), q) - mean) / math.sqrt(variance)


def distribution_of_moments(
    family: str, standard_deviation: float, skewness: float, excess_kurtosis: float
) -> FamilyDistribution:
    """The distribution of a family with the moments given; the excess kurtosis is used for a beta alone.

    Weibull and lognormal distributions follow the skewness, mirrored where it is negative. Raises IllPosedError where
    the family has no such distribution: with skewness s the beta (Pearson's type I) needs s^2 - 2 < excess < 1.5 s^2.
    """
    if not all(math.isfinite(real("a moment", moment)) for moment in (skewness, excess_kurtosis)):
        raise ParameterError("skewness and excess kurtosis must be finite")
    if family == "gaussian":
        return FamilyDistribution(family, standard_deviation)
    if family == "beta":
        return FamilyDistribution(family, standard_deviation, _beta_shapes(skewness, excess_kurtosis))
    if family not in FAMILIES:
        raise ParameterError(f"there is no family {family!r}; choose one of {', '.join(FAMILIES)}")
    shape = _weibull_shape(abs(skewness)) if family == "weibull" else _lognormal_shape(abs(skewness))
    return FamilyDistribution(family, standard_deviation, (shape,), mirrored=skewness < 0.0)


def _beta_shapes(skewness: float, excess: float) -> tuple[float, float]:
    square = skewness**2
    if not square - 2.0 < excess < 1.5 * square:
        nearest = square - 2.0 if excess <= square - 2.0 else 1.5 * square
        raise IllPosedError(
            f"no beta distribution has skewness {skewness:.3g} and excess kurtosis {excess:.3g}: with that skewness "
            f"it lies between {square - 2.0:.3g} and {1.5 * square:.3g}, nearest {nearest:.3g}; use an empirical "
            f"distribution, which keeps both, or a lognormal or Weibull one, which keep the skewness"
        )
    total = 3.0 * (excess - square + 2.0) / (1.5 * square - excess)
    pull = (total + 2.0) ** 2 * square
    half = 0.5 * total * math.sqrt(pull / (pull + 16.0 * (total + 1.0)))
    small, large = 0.5 * total - half, 0.5 * total + half
    shapes = (small, large) if skewness > 0.0 else (large, small)
    least, most = FAMILIES["beta"].limits
    if not (least <= small and large <= most):
        raise IllPosedError(
            f"skewness {skewness:.3g} and excess kurtosis {excess:.3g} need a beta distribution of shapes {small:.3g}, "
            f"{large:.3g}, allowed {least:g} to {most:g}; use an empirical, gaussian or Weibull distribution"
        )
    return shapes


def _weibull_shape(skewness: float) -> float:
    """k between 0.2, where the skewness is 190, and the symmetric shape."""

    def excess(k: float) -> float:
        return weibull_moments(k).skewness - skewness

    least = FAMILIES["weibull"].limits[0]
    if excess(least) < 0.0:
        raise IllPosedError(
            f"a Weibull distribution has a skewness of at most {weibull_moments(least).skewness:.3g}, not "
            f"{skewness:.3g}; use an empirical distribution, or remove outliers"
        )
    if excess(SYMMETRIC_WEIBULL) >= 0.0:
        return SYMMETRIC_WEIBULL
    return float(scipy.optimize.brentq(excess, least, SYMMETRIC_WEIBULL))


def _lognormal_shape(skewness: float) -> float:
    """s with (w + 2) sqrt(w - 1) = skewness, w = exp(s^2): with w = 1 + u^2, u^3 + 3 u = skewness."""
    u = 2.0 * math.sinh(math.asinh(0.5 * skewness) / 3.0)
    s = math.sqrt(math.log1p(u**2))
    least, most = FAMILIES["lognormal"].limits
    if not least <= s <= most:
        raise IllPosedError(
            f"a lognormal distribution has a skewness of {lognormal_moments(least).skewness:.3g} to "
            f"{lognormal_moments(most).skewness:.3g}, not {skewness:.3g}; use an empirical distribution, below also a "
            f"gaussian, above a Weibull one"
        )
    return s


def _require_positive(name: str, value: float) -> None:
    if not (math.isfinite(real(name, value)) and value > 0.0):
        raise ParameterError(f"{name} must be finite and positive, not {value}")
