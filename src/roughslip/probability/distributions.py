"""Distributions of heights and of friction coefficients: of a family by its moments, and of Beta type by its ends.

A family is a translation x(g) = F^-1(Phi(g)) of a standard normal variable g, so both tails keep relative accuracy.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from scipy.special import betainc, betainccinv, betaincinv, betaln, gammaln, log_ndtr, ndtr, ndtri

from roughslip.errors import IllPosedError, ParameterError, real
from roughslip.validation import finite, gate, not_negative, positive, reals

NEGLIGIBLE = 1e-12  # share of the support of a Beta distribution
SYMMETRIC_WEIBULL = 3.6023494257197  # shape at which the skewness of a Weibull distribution changes its sign
FEWEST_QUANTILES = 10


class Moments(NamedTuple):
    """Mean, standard deviation, skewness and excess kurtosis."""

    mean: float
    standard_deviation: float
    skewness: float
    excess_kurtosis: float


class Family(NamedTuple):
    """A family of distributions.

    shapes, limits : names of the shapes, and the range of each; beyond it the moments lose their meaning
    from_gaussian, cdf : x(g, *shapes) and F(x, *shapes)
    moments : of the shapes
    """

    shapes: tuple[str, ...]
    limits: tuple[float, float]
    from_gaussian: Callable[..., np.ndarray]
    cdf: Callable[..., np.ndarray]
    moments: Callable[..., Moments]


def normal_score(probability: float | np.ndarray) -> np.ndarray:
    """g : (as probability) [-] standard normal quantile; raises ParameterError outside the open interval 0 ... 1."""
    p = reals("probabilities", probability)
    if not np.all((p > 0.0) & (p < 1.0)):
        raise ParameterError(f"probabilities must lie between 0 and 1, not {_first(p, (p > 0.0) & (p < 1.0))}")
    return ndtri(p)


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


def weibull_moments(k: float) -> Moments:
    """Moments of the Weibull distribution of shape k and scale 1."""
    m1, m2, m3, m4 = (math.exp(float(gammaln(1.0 + n / k)) - n * float(gammaln(1.0 + 1.0 / k))) for n in (1, 2, 3, 4))
    variance = m2 - 1.0  # in units of the mean, m1 = 1
    skewness = (m3 - 3.0 * m2 + 2.0 * m1) / variance**1.5
    mean = math.exp(float(gammaln(1.0 + 1.0 / k)))
    return Moments(mean, mean * math.sqrt(variance), skewness, (m4 - 4.0 * m3 + 6.0 * m2 - 3.0) / variance**2 - 3.0)


def lognormal_moments(s: float) -> Moments:
    """Moments of exp(s g)."""
    w = math.exp(s**2)
    excess = (w - 1.0) * (w**3 + 3.0 * w**2 + 6.0 * w + 6.0)
    return Moments(math.sqrt(w), math.sqrt(w * math.expm1(s**2)), (w + 2.0) * math.sqrt(math.expm1(s**2)), excess)


FAMILIES = {
    "gaussian": Family((), (0.0, 0.0), lambda g: g, ndtr, lambda: Moments(0.0, 1.0, 0.0, 0.0)),
    "beta": Family(
        ("a", "b"),
        (0.02, 1e4),
        beta_from_gaussian,
        lambda x, a, b: betainc(a, b, np.clip(x, 0.0, 1.0)),
        beta_moments,
    ),
    "weibull": Family(
        ("k",),
        (0.2, 50.0),
        lambda g, k: (-log_ndtr(-g)) ** (1.0 / k),
        lambda x, k: -np.expm1(-(np.maximum(x, 0.0) ** k)),
        weibull_moments,
    ),
    "lognormal": Family(
        ("s",),
        (0.02, 1.5),
        lambda g, s: np.exp(s * g),
        lambda x, s: ndtr(np.log(np.maximum(x, 1e-300)) / s),
        lognormal_moments,
    ),
}


@gate
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
        positive("the standard deviation (of heights: the rms height)", self.standard_deviation)
        names, (minimum, maximum) = FAMILIES[self.family].shapes, FAMILIES[self.family].limits
        if len(self.shapes) != len(names):
            raise ParameterError(f"a {self.family} distribution has the shapes ({', '.join(names)}), not {self.shapes}")
        if not all(minimum <= real("a shape", shape) <= maximum for shape in self.shapes):
            raise ParameterError(
                f"shapes of a {self.family} distribution must lie in {minimum} to {maximum}, not {self.shapes}; scene "
                "key: roughness.marginal.shapes"
            )

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

    @gate
    def from_gaussian(self, normal: np.ndarray) -> np.ndarray:
        """x : (as normal) = F^-1(Phi(g)), increasing, of standard normal g."""
        sign = -1.0 if self.mirrored else 1.0
        x = FAMILIES[self.family].from_gaussian(sign * np.asarray(normal, dtype=float), *self.shapes)
        return sign * self.standard_deviation * (x - self._moments.mean) / self._moments.standard_deviation

    @gate
    def quantile(self, probability: float | np.ndarray) -> np.ndarray:
        """x : (as probability) value below which that share of the ensemble lies."""
        return self.from_gaussian(normal_score(probability))

    @gate
    def cdf(self, value: float | np.ndarray) -> np.ndarray:
        """F : (as value) [-] probability of lying below the value."""
        x = np.asarray(value, dtype=float) / self.standard_deviation
        if np.isnan(x).any():
            raise ParameterError(f"{np.count_nonzero(np.isnan(x))} of {x.size} values are NaN: leave them out")
        sign = -1.0 if self.mirrored else 1.0
        below = FAMILIES[self.family].cdf(
            self._moments.mean + self._moments.standard_deviation * sign * x, *self.shapes
        )
        return 1.0 - below if self.mirrored else below


@gate
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
            positive(f"BetaDistribution.{name}", getattr(self, name))
        lower, upper = real("the lower end", self.lower), real("the upper end", self.upper)
        if not (math.isfinite(lower) and math.isfinite(upper) and lower <= upper):
            raise ParameterError(f"lower and upper must be finite and in order, not {self.lower} and {self.upper}")

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
            raise ParameterError(
                f"quantiles must be a row of at least {FEWEST_QUANTILES} finite increasing numbers, not of the shape "
                f"{q.shape}"
            )
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


@gate
def distribution_of_moments(
    family: str, standard_deviation: float, skewness: float, excess_kurtosis: float
) -> FamilyDistribution:
    """The distribution of a family with the moments given; the excess kurtosis is used for a beta alone.

    Weibull and lognormal distributions follow the skewness, mirrored where it is negative. Raises IllPosedError where
    the family has no such distribution: with skewness s the beta (Pearson's type I) needs s^2 - 2 < excess < 1.5 s^2.
    """
    if not all(math.isfinite(real("a moment", moment)) for moment in (skewness, excess_kurtosis)):
        raise ParameterError(f"skewness and excess kurtosis must be finite, not {skewness} and {excess_kurtosis}")
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
    minimum, maximum = FAMILIES["beta"].limits
    if not (minimum <= small and large <= maximum):
        raise IllPosedError(
            f"skewness {skewness:.3g} and excess kurtosis {excess:.3g} need a beta distribution of shapes {small:.3g}, "
            f"{large:.3g}, allowed {minimum:g} to {maximum:g}; use an empirical, gaussian or Weibull distribution"
        )
    return shapes


def _weibull_shape(skewness: float) -> float:
    """k between 0.2, where the skewness is 190, and the symmetric shape."""

    def excess(k: float) -> float:
        return weibull_moments(k).skewness - skewness

    minimum = FAMILIES["weibull"].limits[0]
    if excess(minimum) < 0.0:
        raise IllPosedError(
            f"a Weibull distribution has a skewness of at most {weibull_moments(minimum).skewness:.3g}, not "
            f"{skewness:.3g}; use an empirical distribution, or remove outliers"
        )
    if excess(SYMMETRIC_WEIBULL) >= 0.0:
        return SYMMETRIC_WEIBULL
    return float(scipy.optimize.brentq(excess, minimum, SYMMETRIC_WEIBULL))


def _lognormal_shape(skewness: float) -> float:
    """s with (w + 2) sqrt(w - 1) = skewness, w = exp(s^2): with w = 1 + u^2, u^3 + 3 u = skewness."""
    u = 2.0 * math.sinh(math.asinh(0.5 * skewness) / 3.0)
    s = math.sqrt(math.log1p(u**2))
    minimum, maximum = FAMILIES["lognormal"].limits
    if not minimum <= s <= maximum:
        raise IllPosedError(
            f"a lognormal distribution has a skewness of {lognormal_moments(minimum).skewness:.3g} to "
            f"{lognormal_moments(maximum).skewness:.3g}, not {skewness:.3g}; use an empirical distribution, below "
            f"also a gaussian, above a Weibull one"
        )
    return s


def _first(values: np.ndarray, allowed: np.ndarray) -> float:
    """The first value that is not allowed."""
    return float(values[~allowed][0])
