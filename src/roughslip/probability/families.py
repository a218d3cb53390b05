"""Families of distributions on a fixed scale, each a translation x(g) = F^-1(Phi(g)) of a standard normal variable g.

Written that way both tails keep their relative accuracy.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.special import betainc, betainccinv, betaincinv, betaln, gammaln, log_ndtr, ndtr, ndtri

from roughslip.errors import ParameterError
from roughslip.validation import reals

NEGLIGIBLE = 1e-12  # share of the support of a Beta distribution


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
        raise ParameterError(f"probabilities lie between 0 and 1, not {probability}")
    return ndtri(p)


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
