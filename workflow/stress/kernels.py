"""Correlations by the judges' own formulas: of heights a lag apart, and of translated normal variables.

Matern: K_nu by the trapezoidal rule on int_0^inf exp(-u cosh t) cosh(nu t) dt, which converges like exp(-pi^2 / step).
Self-affine: the transform of the spectrum by Gauss's rule between all required ends, summed from the far one.
Translated variables: a double integral by the trapezoidal rule, on a cubic spline through the quantile function. The
same with half the nodes shows the error.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.special import gammaln, j0, j1

from roughslip.surface.covariance import Covariance

STEP, FALLEN = 0.1, 750.0  # of t; exp(-750) is zero
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
OSCILLATION = 1.5  # of t: a panel holds a quarter of a wave of J0
PANELS = 200_000
ROUNDING = 1e-12  # of a correlation, from logarithms and powers of some hundred

EDGE, SCORES, TABLE = 9.0, 201, 4097  # normal scores: the largest, and numbers of them
FINE = 2**15 + 1
SAFE = 10.0  # times the change from half the nodes

Quantile = Callable[[np.ndarray], np.ndarray]  # of the normal score


def correlation(covariance: Covariance, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return correlations (broadcast of x and y) of heights x, y [m] apart."""
    along, across = covariance.lengths_m
    cos, sin = math.cos(covariance.lay_rad), math.sin(covariance.lay_rad)
    a, b = (cos * x + sin * y) / along, (cos * y - sin * x) / across
    r = np.hypot(a, b)
    match covariance.kind:
        case "gaussian":
            return np.exp(-(r**2))
        case "exponential":
            return np.exp(-r)
        case "separable_exponential":
            return np.exp(-np.abs(a) - np.abs(b))
        case "matern":
            scale, nu = _matern_scale(covariance.smoothness), covariance.smoothness
            return _of_each(r, lambda distinct: matern(scale * distinct, nu))
        case _:
            scale = 2 * math.pi * along / covariance.rolloff_wavelengths_m[0]
            return _of_each(r, lambda distinct: self_affine(scale * distinct, covariance.hurst, covariance.bandwidth))


def matern(u: np.ndarray, nu: float) -> np.ndarray:
    """Return 2^(1-nu) / Gamma(nu) u^nu K_nu(u) : (n,)."""
    positive = u > 0
    at = np.where(positive, u, 1.0)
    last = math.acosh(max(FALLEN / float(at.min()), 1.0) + 1.0) + nu
    t = STEP * np.arange(math.ceil(last / STEP) + 1)
    log = (1 - nu) * math.log(2) - gammaln(nu) + nu * np.log(at)[:, None]
    log_cosh = nu * t + np.log1p(np.exp(-2 * nu * t)) - math.log(2)
    with np.errstate(over="ignore"):  # of exp(-inf), which is zero
        values = np.exp(log + log_cosh - at[:, None] * np.cosh(t))
    values[:, 0] *= 0.5
    return np.where(positive, STEP * values.sum(axis=1), 1.0)


@lru_cache
def _matern_scale(nu: float) -> float:
    return float(brentq(lambda u: matern(np.array([u]), nu)[0] - math.exp(-1), 1e-9, 100.0, xtol=1e-15, rtol=1e-14))


def self_affine(z: np.ndarray, hurst: float, bandwidth: float) -> np.ndarray:
    """Return the transform at lags z : (n,) of the spectrum 1 up to 1, then k^(-2-2H), over that at zero."""
    positive = z > 0
    at = z[positive]
    mass = 0.5 - math.expm1(-2 * hurst * math.log(bandwidth)) / (2 * hurst)
    total = np.ones_like(z)
    if at.size:
        last = float(at.max()) * bandwidth
        if last > OSCILLATION * PANELS:
            raise ValueError(f"{last:.3g} is beyond the range of this quadrature, {OSCILLATION * PANELS:.3g}")
        first = math.log(float(at.min()))
        grown = np.exp(np.linspace(first, math.log(OSCILLATION), max(2, math.ceil(4 * abs(first)) + 2)))
        ends = np.unique(np.concatenate((at, at * bandwidth, grown, np.arange(OSCILLATION, last, OSCILLATION))))
        half = 0.5 * np.diff(ends)
        t = (ends[:-1] + half)[:, None] + half[:, None] * NODES
        panels = half * ((t ** (-1 - 2 * hurst) * j0(t)) @ WEIGHTS)
        beyond = np.append(np.cumsum(panels[::-1])[::-1], 0.0)
        found = beyond[np.searchsorted(ends, at)] - beyond[np.searchsorted(ends, at * bandwidth)]
        total[positive] = (j1(at) / at + at ** (2 * hurst) * found) / mass
    return total


def _of_each(r: np.ndarray, of: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Evaluate a function once for each distinct distance."""
    distinct, where = np.unique(r, return_inverse=True)
    return of(distinct)[where].reshape(r.shape)


def pair_correlation(quantile: Quantile, rho: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the correlation (n,) of quantile(g) and quantile(h), and its largest error.

    rho : (n,) correlations of the normal variables g and h
    """
    table = np.linspace(-1.5 * EDGE, 1.5 * EDGE, TABLE)
    values = quantile(table)
    whole, half = (_integrals(CubicSpline(table[::s], values[::s]), rho, (SCORES - 1) // s + 1) for s in (1, 2))
    return whole, SAFE * float(np.abs(whole - half).max()) + ROUNDING


def left_out(quantile: Quantile, terms: int) -> float:
    """Return the share of the variance beyond so many Hermite polynomials."""
    g = np.linspace(-EDGE, EDGE, FINE)
    weight = np.exp(-0.5 * g**2)
    weight /= weight.sum()
    z = quantile(g)
    z = z - weight @ z
    before, now, carried = np.ones_like(g), g.copy(), 0.0
    for n in range(1, terms + 1):
        carried += float(weight @ (z * now)) ** 2
        before, now = now, (g * now - np.sqrt(n) * before) / np.sqrt(n + 1.0)
    return abs(1.0 - carried / float(weight @ z**2))


def _integrals(spline: CubicSpline, rho: np.ndarray, nodes: int) -> np.ndarray:
    g = np.linspace(-EDGE, EDGE, nodes)
    weight = np.exp(-0.5 * g**2)
    weight /= weight.sum()
    z = spline(g)
    mean = float(weight @ z)
    z = z - mean
    variance = float(weight @ z**2)
    found = np.empty(len(rho))
    for k, r in enumerate(rho):
        other = spline(np.clip(r * g[:, None] + np.sqrt(max(1.0 - r**2, 0.0)) * g, -1.5 * EDGE, 1.5 * EDGE)) - mean
        found[k] = (weight * z) @ (other @ weight) / variance
    return found
