"""The law of scatter: how much the friction of a window scatters, from the covariance of the heights, without a solve.

The influence of a window on its pad is g = (A - kappa N) / mean(A), kappa = sum(A) / sum(N). Its standard deviation is
the coefficient of variation of friction where all windows touch, and exists where some do not.

Theory. Persson (J. Chem. Phys. 115 (2001) 3840) lets the stress at a point diffuse as ever shorter waves are added. It
begins at the nominal pressure p, is absorbed at zero, and ends with the variance s^2 = (E* h' / 2)^2. So A =
erf(p / (sqrt(2) s)). Two points a distance r apart share the waves longer than r: a part rho(r) of the variance, with
rho the correlation of the slopes. From there on they diffuse independently. With f the density of the stress of what is
not absorbed after a variance of rho, in units of s,

    C(rho) = int f(x) (erf(x / sqrt(2 (1 - rho))) - kappa x)^2 dx / A^2,      CV^2 = mean of C over pairs of points.

It has no constant. For rho << p^2 it is (d ln A / d ln s^2)^2 2 rho^2, the scatter of the slope of a window. At light
loads it is shot noise, C = g(rho) s / p. Real contacts sit on high summits, and those of wide spectra in clusters. That
moves CV by a power of p / (E* h') and one of Nayak's parameter: `FITTED`, by `workflow.scatter_law`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import erf

from roughslip.errors import IllPosedError
from roughslip.friction.pad import distances
from roughslip.validation import gate, positive

Covariance = Callable[[np.ndarray, np.ndarray], np.ndarray]

FITTED = (1.0709, 0.1169, 0.0903)  # CV = a p*^b alpha^c times theory, p* = p / (E* h')
LOADS = 1e-3, 0.5  # of p*, between which the law was judged
STRESSES = np.polynomial.legendre.leggauss(200)
SHARES = np.concatenate(([0.0], np.geomspace(1e-6, 0.02, 30), np.linspace(0.02, 1.0, 100)[1:]))  # rho of a table of C
FINEST, SMOOTH = 40, 1e-3  # halvings of a step of differences at most, until h' changes by less than this share


@dataclass(frozen=True)
class Roughness:
    """What the law takes of the heights.

    slope : h' [-] rms gradient over both directions
    bandwidth : alpha = m0 m4 / m2^2 [-] of the isotropic part, Nayak's parameter times 2/3; 2 for exp(-r^2 / l^2)
    step_m : [m] of the differences that give the correlation of slopes
    """

    slope: float
    bandwidth: float
    step_m: float


@gate
def scatter_of_friction(
    covariance: Covariance, plane_strain_modulus_pa: float, pressure_pa: float, window_m: tuple[float, float]
) -> float:
    """Coefficient of variation [-] of the friction of windows of elastic contact, one of many under one load.

    covariance : C(x, y) [m^2] of the heights at distances along and across the belt [m], with a finite rms slope
    plane_strain_modulus_pa : E* [Pa]
    pressure_pa : p [Pa] nominal
    window_m : [m] length and width of a window, or of a whole pad

    Right to 7 % (rms) over Gaussian, Matern and self-affine surfaces at p = 1e-3 to 0.5 E* h'; see the manual. In
    contact that yields friction does not scatter, as A = N / H. Raises IllPosedError where the rms slope has no limit.
    """
    for name, value in (("the modulus", plane_strain_modulus_pa), ("the pressure", pressure_pa)):
        positive(name, value, "Pa")
    rough = roughness_of(covariance, positive("the length of the window", min(window_m), "m"))
    load = pressure_pa / (plane_strain_modulus_pa * rough.slope)
    factor, power, width = FITTED
    theory = mean_over_window(covariance, rough, load, window_m)
    return float(factor * load**power * rough.bandwidth**width * math.sqrt(theory))


def roughness_of(covariance: Covariance, scale_m: float) -> Roughness:
    """Slope and bandwidth by differences, from a step that is halved until the slope is known to a thousandth."""
    step, slope = scale_m / 8.0, 0.0
    for _ in range(FINEST):
        before, slope = slope, math.sqrt(float(_bend(covariance, np.zeros(1), np.zeros(1), step)[0]))
        if abs(slope - before) <= SMOOTH * slope:
            break
        step /= 2.0
    else:
        raise IllPosedError(
            "the rms slope of the heights grows without limit as waves get shorter, and contact with it: cut the "
            "spectrum off; scene keys: roughness.covariance, roughness.bandwidth"
        )
    rough, zero = Roughness(slope, 1.0, step), np.zeros(1)

    def rho(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return correlation_of_slopes(covariance, rough, x, y)

    m4 = slope**2 * float(_bend(rho, zero, zero, 4.0 * step)[0])
    variance = float(covariance(zero, zero)[0])
    return Roughness(slope, variance * m4 / slope**4, step)


def _bend(function: Covariance, x: np.ndarray, y: np.ndarray, h: float) -> np.ndarray:
    """Minus the Laplacian by differences of a step h."""
    around = function(x + h, y) + function(x - h, y) + function(x, y + h) + function(x, y - h)
    return np.asarray(4.0 * function(x, y) - around) / h**2


def correlation_of_slopes(covariance: Covariance, rough: Roughness, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """rho : (broadcast of x and y) [-] minus the Laplacian of the covariance over h'^2; also that of the stress."""
    return _bend(covariance, x, y, rough.step_m) / rough.slope**2


def mean_over_window(
    covariance: Covariance, rough: Roughness, load: float, window_m: tuple[float, float], lag_m: float = 0.0
) -> float:
    """Mean of C over pairs of points of two windows a lag apart along the belt; load : p / (E* h')."""
    (x, weight_x), (y, weight_y) = (
        distances(edge, lag, 16.0 * rough.step_m) for edge, lag in zip(window_m, (lag_m, 0.0), strict=True)
    )
    rho = correlation_of_slopes(covariance, rough, x[:, None], y[None, :])
    table = pair_covariance(SHARES, 2.0 * load)
    return float(weight_x @ np.interp(rho, SHARES, table) @ weight_y)


def pair_covariance(rho: np.ndarray, pressure: float) -> np.ndarray:
    """C : (as rho) [-] of the influences of two points that share a part rho of the stress's variance.

    pressure : p / s
    """
    area = math.erf(pressure / math.sqrt(2.0))
    share = np.maximum(rho, 1e-12)[:, None]
    deviation, high = np.sqrt(share), pressure + 9.0 * np.sqrt(share)
    low = np.maximum(pressure - 9.0 * deviation, 0.0)
    x = low + (high - low) * (STRESSES[0] + 1.0) / 2.0
    near, far = (np.exp(-((x + sign * pressure) ** 2) / (2.0 * share)) for sign in (-1.0, 1.0))
    density = (near - far) / (deviation * math.sqrt(2.0 * math.pi))
    beyond = erf(x / np.sqrt(2.0 * np.maximum(1.0 - share, 1e-15)))
    squares = density * (beyond - area / pressure * x) ** 2
    found = ((high - low) / 2.0 * squares) @ STRESSES[1] / area**2
    return np.where(rho > 0.0, found, 0.0)
