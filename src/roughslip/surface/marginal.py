"""Marginal distributions of heights, each with zero mean and the rms height asked for.

A law is written as a transformation of a standard normal variable g, x(g) = F^-1(Phi(g)), so that both tails keep their
relative accuracy; z = Sq (x - E x) / std x, or its mirror image -z(-g).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import scipy
from scipy.special import betainc, betainccinv, betaincinv, betaln, gammaln, log_ndtr, ndtr, ndtri

from roughslip.errors import IllPosedError, ParameterError, real
from roughslip.validation import reals

NEGLIGIBLE = 1e-12  # a share of the support of a Beta law
SYMMETRIC_WEIBULL = 3.6023494257197  # shape at which the skewness of a Weibull law changes its sign


class HeightMarginal(Protocol):
    """What a translation needs of a law of heights: also met by EmpiricalMarginal."""

    @property
    def rms_height_m(self) -> float:
        """Sq [m]."""
        ...

    def from_gaussian(self, normal: np.ndarray) -> np.ndarray:
        """z : (as normal) [m] the height of each standard normal value."""
        ...


class Moments(NamedTuple):
    """mean, std of the plain law; skewness, excess kurtosis"""

    mean: float
    std: float
    skewness: float
    excess: float


class _Family(NamedTuple):
    shapes: tuple[str, ...]
    limits: tuple[float, float]  # of each shape: beyond, the law is another one or its moments lose their meaning
    from_gaussian: Callable[..., np.ndarray]  # x(g, *shapes)
    cdf: Callable[..., np.ndarray]  # F(x, *shapes)
    moments: Callable[..., Moments]


def _beta_moments(a: float, b: float) -> Moments:
    total = a + b
    skewness = 2.0 * (b - a) * math.sqrt(total + 1.0) / ((total + 2.0) * math.sqrt(a * b))
    excess = 6.0 * ((a - b) ** 2 * (total + 1.0) - a * b * (total + 2.0)) / (a * b * (total + 2.0) * (total + 3.0))
    return Moments(a / total, math.sqrt(a * b / (total + 1.0)) / total, skewness, excess)


def _weibull_moments(k: float) -> Moments:
    m1, m2, m3, m4 = (math.exp(float(gammaln(1.0 + n / k)) - n * float(gammaln(1.0 + 1.0 / k))) for n in (1, 2, 3, 4))
    variance = m2 - 1.0  # in units of the mean, m1 = 1
    skewness = (m3 - 3.0 * m2 + 2.0 * m1) / variance**1.5
    mean = math.exp(float(gammaln(1.0 + 1.0 / k)))
    return Moments(mean, mean * math.sqrt(variance), skewness, (m4 - 4.0 * m3 + 6.0 * m2 - 3.0) / variance**2 - 3.0)


def _lognormal_moments(s: float) -> Moments:
    w = math.exp(s**2)
    excess = (w - 1.0) * (w**3 + 3.0 * w**2 + 6.0 * w + 6.0)
    return Moments(math.sqrt(w), math.sqrt(w * math.expm1(s**2)), (w + 2.0) * math.sqrt(math.expm1(s**2)), excess)


def _extreme(a: float, b: float, p: np.ndarray) -> np.ndarray:
    """The Beta quantile x where it is next to nothing, x^a = a B(a, b) p; NaN elsewhere.

    scipy 1.17 has NaN there for some shapes and p below 1e-15.
    """
    x = np.exp((np.log(np.maximum(p, 1e-300)) + math.log(a) + betaln(a, b)) / a)
    return np.where(x < NEGLIGIBLE, x, math.nan)


def _beta_from_gaussian(g: np.ndarray, a: float, b: float) -> np.ndarray:
    lower, upper = ndtr(np.minimum(g, 0.0)), ndtr(-np.maximum(g, 0.0))
    quantile = np.where(g < 0.0, betaincinv(a, b, lower), betainccinv(a, b, upper))
    if not np.isnan(quantile).any():
        return quantile
    extreme = np.where(g < 0.0, _extreme(a, b, lower), 1.0 - _extreme(b, a, upper))
    return np.where(np.isnan(quantile), extreme, quantile)


FAMILIES = {
    "gaussian": _Family((), (0.0, 0.0), lambda g: g, ndtr, lambda: Moments(0.0, 1.0, 0.0, 0.0)),
    "beta": _Family(
        ("a", "b"),
        (0.02, 1e4),
        _beta_from_gaussian,
        lambda x, a, b: betainc(a, b, np.clip(x, 0.0, 1.0)),
        _beta_moments,
    ),
    "weibull": _Family(
        ("k",),
        (0.2, 50.0),
        lambda g, k: (-log_ndtr(-g)) ** (1.0 / k),
        lambda x, k: -np.expm1(-(np.maximum(x, 0.0) ** k)),
        _weibull_moments,
    ),
    "lognormal": _Family(
        ("s",),
        (0.02, 1.5),
        lambda g, s: np.exp(s * g),
        lambda x, s: ndtr(np.log(np.maximum(x, 1e-300)) / s),
        _lognormal_moments,
    ),
}


@dataclass(frozen=True)
class Marginal:
    """A law of heights from a family, shifted and scaled to zero mean and the rms height given.

    family : "gaussian"; "beta" (shapes a, b), bounded on both sides; "weibull" (k) and "lognormal" (s, the standard
        deviation of its logarithm), bounded below with a long upper tail, as peaks on a plain
    rms_height_m : Sq [m]
    shapes : of the family
    mirrored : heights turned upside down, so that the tail hangs below a plateau (worn, honed surfaces)
    """

    family: str
    rms_height_m: float
    shapes: tuple[float, ...] = ()
    mirrored: bool = False

    def __post_init__(self) -> None:
        if self.family not in FAMILIES:
            raise ParameterError(f"family {self.family!r} is not known: {', '.join(FAMILIES)}")
        if not (math.isfinite(real("the rms height", self.rms_height_m)) and self.rms_height_m > 0.0):
            raise ParameterError(f"the rms height must be positive and finite, not {self.rms_height_m}")
        names, (least, most) = FAMILIES[self.family].shapes, FAMILIES[self.family].limits
        if len(self.shapes) != len(names):
            raise ParameterError(f"a {self.family} law has the shapes ({', '.join(names)}), not {self.shapes}")
        if not all(least <= real("a shape", shape) <= most for shape in self.shapes):
            raise ParameterError(f"shapes of a {self.family} law lie in {least} ... {most}, not {self.shapes}")

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
        return self._moments.excess

    def from_gaussian(self, normal: np.ndarray) -> np.ndarray:
        """z : (as normal) [m] = F^-1(Phi(g)), increasing, of standard normal g."""
        sign = -1.0 if self.mirrored else 1.0
        x = FAMILIES[self.family].from_gaussian(sign * np.asarray(normal, dtype=float), *self.shapes)
        return sign * self.rms_height_m * (x - self._moments.mean) / self._moments.std

    def quantile(self, probability: float | np.ndarray) -> np.ndarray:
        """z : (as probability) [m] height below which that share of the ensemble lies."""
        return self.from_gaussian(normal_score(probability))

    def cdf(self, height: float | np.ndarray) -> np.ndarray:
        """F : (as height) [-] probability of lying below `height` [m]."""
        z = np.asarray(height, dtype=float) / self.rms_height_m
        if np.isnan(z).any():
            raise ParameterError("heights must be numbers")
        sign = -1.0 if self.mirrored else 1.0
        below = FAMILIES[self.family].cdf(self._moments.mean + self._moments.std * sign * z, *self.shapes)
        return 1.0 - below if self.mirrored else below


def normal_score(probability: float | np.ndarray) -> np.ndarray:
    """g : (as probability) [-] standard normal quantile; raises ParameterError outside the open interval 0 ... 1."""
    p = reals("probabilities", probability)
    if not np.all((p > 0.0) & (p < 1.0)):
        raise ParameterError(f"probabilities lie between 0 and 1, not {probability}")
    return ndtri(p)


def from_moments(family: str, rms_height_m: float, skewness: float, excess_kurtosis: float) -> Marginal:
    """The law of a family with a given rms height, skewness and, for the two shapes of a beta, excess kurtosis.

    Weibull and lognormal laws follow the skewness alone, mirrored where it is negative. Raises IllPosedError where the
    family has no such law: with skewness s the beta (Pearson's type I) needs s^2 - 2 < excess < 1.5 s^2.
    """
    if not all(math.isfinite(real("a moment", moment)) for moment in (skewness, excess_kurtosis)):
        raise ParameterError("skewness and excess kurtosis must be finite")
    if family == "gaussian":
        return Marginal(family, rms_height_m)
    if family == "beta":
        return Marginal(family, rms_height_m, _beta_shapes(skewness, excess_kurtosis))
    if family not in FAMILIES:
        raise ParameterError(f"family {family!r} is not known: {', '.join(FAMILIES)}")
    shape = _weibull_shape(abs(skewness)) if family == "weibull" else _lognormal_shape(abs(skewness))
    return Marginal(family, rms_height_m, (shape,), mirrored=skewness < 0.0)


def _beta_shapes(skewness: float, excess: float) -> tuple[float, float]:
    square = skewness**2
    if not square - 2.0 < excess < 1.5 * square:
        nearest = square - 2.0 if excess <= square - 2.0 else 1.5 * square
        raise IllPosedError(
            f"no beta law has skewness {skewness:.3g} and excess kurtosis {excess:.3g}: with that skewness it "
            f"lies between {square - 2.0:.3g} and {1.5 * square:.3g}, nearest {nearest:.3g}; use an empirical law, "
            f"which keeps both, or a lognormal or Weibull one, which keep the skewness"
        )
    total = 3.0 * (excess - square + 2.0) / (1.5 * square - excess)
    pull = (total + 2.0) ** 2 * square
    half = 0.5 * total * math.sqrt(pull / (pull + 16.0 * (total + 1.0)))
    small, large = 0.5 * total - half, 0.5 * total + half
    shapes = (small, large) if skewness > 0.0 else (large, small)
    least, most = FAMILIES["beta"].limits
    if not (least <= small and large <= most):
        raise IllPosedError(
            f"skewness {skewness:.3g} and excess kurtosis {excess:.3g} lie on the edge of the beta laws: "
            f"shapes {small:.3g}, {large:.3g}, allowed {least:g} to {most:g}; use an empirical, gaussian or Weibull law"
        )
    return shapes


def _weibull_shape(skewness: float) -> float:
    """k between 0.2, where the skewness is 190, and the symmetric shape."""

    def excess(k: float) -> float:
        return _weibull_moments(k).skewness - skewness

    least = FAMILIES["weibull"].limits[0]
    if excess(least) < 0.0:
        raise IllPosedError(
            f"a skewness of {skewness:.3g} is beyond the Weibull laws, at most {_weibull_moments(least).skewness:.3g}; "
            f"use an empirical law, or remove outliers from the heights"
        )
    return (
        SYMMETRIC_WEIBULL
        if excess(SYMMETRIC_WEIBULL) >= 0.0
        else float(scipy.optimize.brentq(excess, least, SYMMETRIC_WEIBULL))
    )


def _lognormal_shape(skewness: float) -> float:
    """s with (w + 2) sqrt(w - 1) = skewness, w = exp(s^2): with w = 1 + u^2, u^3 + 3 u = skewness."""
    u = 2.0 * math.sinh(math.asinh(0.5 * skewness) / 3.0)
    s = math.sqrt(math.log1p(u**2))
    least, most = FAMILIES["lognormal"].limits
    if not least <= s <= most:
        raise IllPosedError(
            f"a skewness of {skewness:.3g} is beyond the lognormal laws, {_lognormal_moments(least).skewness:.3g} to "
            f"{_lognormal_moments(most).skewness:.3g}; use an empirical law, below also a gaussian, above a Weibull one"
        )
    return s


@dataclass(frozen=True)
class MarginalFit:
    """A law fitted to heights, and how far it is from them.

    marginal : the law
    mean_height_m : [m] mean of the heights, which the law lacks
    kolmogorov : largest difference of the distribution functions
    wasserstein : 2-Wasserstein distance over Sq, from 1000 quantiles
    """

    marginal: Marginal
    mean_height_m: float
    kolmogorov: float
    wasserstein: float


def fit(heights: np.ndarray, family: str) -> MarginalFit:
    """The law of a family with the moments of the heights: Sq, skewness and, for a beta, kurtosis are kept.

    heights : (any shape) [m]

    Neighbouring heights of a surface depend on each other, so the distances are measures and no test. Raises
    ParameterError for heights that are not finite, IllPosedError for constant ones or moments outside the family.
    """
    z = checked_heights(heights)
    mean, rms = float(np.mean(z)), float(np.std(z))
    score = (z - mean) / rms
    marginal = from_moments(family, rms, float(np.mean(score**3)), float(np.mean(score**4)) - 3.0)
    model = marginal.cdf(np.sort(z) - mean)
    steps = np.arange(z.size + 1) / z.size
    kolmogorov = max(float(np.max(steps[1:] - model)), float(np.max(model - steps[:-1])))
    p = (np.arange(1000) + 0.5) / 1000
    gap = np.quantile(z, p) - mean - marginal.quantile(p)
    return MarginalFit(marginal, mean, kolmogorov, math.sqrt(float(np.mean(gap**2))) / rms)


def checked_heights(heights: np.ndarray) -> np.ndarray:
    """heights : (n,) [m], finite and not constant."""
    z = reals("heights", heights).ravel()
    if z.size < 2 or not np.isfinite(z).all():
        raise ParameterError("a marginal needs two or more heights, all finite; leave missing points out")
    if not np.ptp(z) > 1e-12 * np.max(np.abs(z)):
        raise IllPosedError("all heights are equal: they have no distribution")
    return z
