"""The transform of a self-affine spectrum: constant to q_r = 1, falling as q^(-2-2H) to Q, and zero beyond."""

import math
from functools import lru_cache

import numpy as np
import scipy  # its parts when they are used
from numpy.polynomial import Chebyshev

SERIES_END, ASYMPTOTIC_START = 4.0, 40.0  # of the integral: both ends are exact to some 1e-14

GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(80)


def mass(hurst: float, bandwidth: float) -> float:
    """int k S(k) / S(0) dk over 0 ... Q, in units of q_r."""
    return 0.5 - math.expm1(-2 * hurst * math.log(bandwidth)) / (2 * hurst)


def moment(power: int, hurst: float, bandwidth: float | np.ndarray) -> np.ndarray:
    """int k^(1 + power) S(k) / S(0) dk over 0 ... Q : (as Q) in units of q_r."""
    log = np.log(bandwidth)
    return np.asarray(1 / (power + 2) + log * scipy.special.exprel((power - 2 * hurst) * log))


def profile(u: np.ndarray, hurst: float, bandwidth: float) -> np.ndarray:
    """Correlation at u = q_r r: int_0^1 k J0(u k) dk + int_1^Q k^(-1-2H) J0(u k) dk over the mass of the spectrum.

    With G(z) = z^2H int_z^inf t^(-1-2H) J0(t) dt the second integral is G(u) - Q^(-2H) G(Q u).
    """
    plateau = np.where(u > 0, scipy.special.j1(u) / np.where(u > 0, u, 1.0), 0.5)
    slope = _tail_integral(u, hurst) - bandwidth ** (-2 * hurst) * _tail_integral(bandwidth * u, hurst)
    return (plateau + slope) / mass(hurst, bandwidth)


@lru_cache
def scale(hurst: float, bandwidth: float) -> float:
    """s = q_r l with a correlation of 1/e at u = s."""
    return float(
        scipy.optimize.brentq(lambda u: profile(np.array(u), hurst, bandwidth) - math.exp(-1), 1e-12, 3.5, xtol=1e-14)
    )


def _tail_integral(z: np.ndarray, hurst: float) -> np.ndarray:
    """G(z) = z^2H int_z^inf t^(-1-2H) J0(t) dt, to some 1e-13: power series, Chebyshev interpolation, asymptotics."""
    z = np.asarray(z, dtype=float)
    result = np.empty(z.shape)
    small, large = z <= SERIES_END, z >= ASYMPTOTIC_START
    middle = ~(small | large)
    if small.any():
        result[small] = _tail_series(z[small], hurst)
    if middle.any():
        result[middle] = _tail_between(hurst)(z[middle])
    if large.any():
        result[large] = _tail_asymptotics(z[large], hurst)
    return result


def _tail_series(z: np.ndarray, hurst: float) -> np.ndarray:
    """The series of J0 integrated term by term from z to SERIES_END, and G there.

    (c^p - z^p) / p is written with exprel, so that H = 1, where an exponent p = 2k - 2H vanishes, is no exception.
    """
    at_end = _tail_between(hurst)(SERIES_END)
    log = np.log(np.maximum(z, 1e-300) / SERIES_END)
    total = at_end * np.exp(2 * hurst * log) - np.expm1(2 * hurst * log) / (2 * hurst)
    coefficient = 1.0
    for k in range(1, 25):
        coefficient *= -(SERIES_END**2) / (4 * k**2)
        total -= coefficient * np.exp(2 * hurst * log) * log * scipy.special.exprel((2 * k - 2 * hurst) * log)
    return np.where(z > 0, total, 1 / (2 * hurst))  # z^2H vanishes too slowly for a cut near zero


def _tail_asymptotics(z: np.ndarray, hurst: float) -> np.ndarray:
    """I_a = int_z^inf t^-a J0 = -z^-a J1 + (a + 1) z^(-a-1) J0 - (a + 1)^2 I_(a+2), twice by parts, repeated."""
    a, factor, total = 1 + 2 * hurst, 1 / z, np.zeros_like(z)
    zeroth, first = scipy.special.j0(z), scipy.special.j1(z)
    for _ in range(16):
        total += factor * ((a + 1) / z * zeroth - first)
        factor = -factor * ((a + 1) / z) ** 2
        a += 2
    return total


@lru_cache
def _tail_between(hurst: float) -> Chebyshev:
    """G on SERIES_END ... ASYMPTOTIC_START by Gauss-Legendre quadrature."""
    end = np.array([ASYMPTOTIC_START])
    beyond = float(_tail_asymptotics(end, hurst)[0]) * ASYMPTOTIC_START ** (-2 * hurst)

    def tail(z: np.ndarray) -> np.ndarray:
        half = (ASYMPTOTIC_START - z)[:, None] / 2
        t = z[:, None] + half * (GAUSS_NODES + 1)
        integral = np.sum(half * GAUSS_WEIGHTS * t ** (-1 - 2 * hurst) * scipy.special.j0(t), axis=1)
        return z ** (2 * hurst) * (beyond + integral)

    return Chebyshev.interpolate(tail, 80, domain=[SERIES_END, ASYMPTOTIC_START])
