"""The law of scatter: how much the friction of a window scatters, from the covariance of the heights, without a solve.

The influence of a window on its pad is g = (A - kappa N) / mean(A), kappa = sum(A) / sum(N). Its standard deviation is
the coefficient of variation of friction where all windows touch, and exists where some do not.

Pairs of points. Persson (J. Chem. Phys. 115 (2001) 3840) lets the stress at a point diffuse from the nominal pressure p
as ever shorter waves are added, up to the variance s^2 = (E* h' / 2)^2. It is absorbed at zero, so A = erf(p / (sqrt(2)
s)). Two points a distance r apart share a part rho(r) of the variance, the correlation of the slopes, and diffuse
independently from there on. With f the density of the stress of what is not absorbed then, in units of s,

    C(rho) = int f(x) (erf(x / sqrt(2 (1 - rho))) - kappa x)^2 dx / A^2,      T^2 = mean of C over pairs of points.

At light loads it is shot noise, T^2 = c / (S p*) for a large window of area S, with p* = p / (E* h').

Summits. Real contacts at light loads are Hertz contacts of few summits (Bush, Gibson and Thomas, Wear 35 (1975) 87).
M is the matrix of the mean products of the slopes, and w <= 1 the ratio of its eigenvalues. Above a plane at t rms
heights there are t sqrt(det M) exp(-t^2 / 2) / ((2 pi)^(3/2) m0) summits a unit area. Their rise above the plane has an
exponential distribution of the mean m0^(1/2) / t, and their curvatures are M t / m0^(1/2). So A is in proportion to the
rise and N to its power 3/2. An elliptic contact bears e times what a circular one of the same mean curvature and rise
does. Then

    CV^2 = (<A^2> / <A>^2 - 2 <A N> / (<A> <N>) + <N^2> / <N>^2) <N> / (S p)
         = T^2 B nu / t^2,
    B    = (32 / (3 pi) - 3) sqrt(2 pi) m0 / (h'^2 c) / q,    q = sqrt(w (3 + w) (1 + 3 w)) / (1 + w)^2,
    nu   = e sqrt((1 + w) / (2 sqrt(w))) q.

nu is one without a lay, and B is 2.7 for exp(-r^2 / l^2) of any lay. It grows with the width of the spectrum. Wide
spectra depart from summits, as contacts stand in clusters. The law has the plane at which the heights above it are A,
and three constants, `FITTED` by `workflow.scatter_law`:

    CV^2 = a B^b T^2 / (1 + k t^2 / nu).
"""

from __future__ import annotations

import functools
import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its parts when they are used

from roughslip.errors import IllPosedError
from roughslip.friction.pad import NODE, WEIGHT, distances
from roughslip.validation import finite, gate, positive

Covariance = Callable[[np.ndarray, np.ndarray], np.ndarray]

FITTED = (0.761, 0.2702, 0.2587)  # a, b, k
JUDGED = 2.2, 34.0  # of B
NARROW = (
    "for waves within a factor of two alone it was up to 1.6 times the solved scatter below p = 0.01 E* h', and 0.7 "
    "times at 0.1"
)
LIGHTEST = 1e-5  # of p*: what tends to shot noise has done so
STRESSES = np.polynomial.legendre.leggauss(200)
POSITIVE = np.concatenate((np.geomspace(1e-6, 0.02, 30), np.linspace(0.02, 1.0, 100)[1:]))
SHARES = np.concatenate((-POSITIVE[::-1], [0.0], POSITIVE))  # rho of a table of C
IMAGES = range(-20, 21)
STEP, SHORT = 0.03, 1e-3  # of differences: over h' / curvature, or over a correlation length where that is none
FAR, ANGLES = 32.0, 16  # sqrt(m0 / M) up to which points share a stress; angles in half a turn


@dataclass(frozen=True)
class Roughness:
    """What the law takes of the heights.

    slope : h' [-] rms gradient over both directions
    bandwidth : B [-] width of the spectrum, 2.7 for exp(-r^2 / l^2)
    lay : nu [-] by which elliptic contacts of a lay scatter less, 1 without a lay
    step_m : [m] of the differences that give the correlation of slopes
    """

    slope: float
    bandwidth: float
    lay: float
    step_m: float


@gate
def scatter_of_friction(
    covariance: Covariance, plane_strain_modulus_pa: float, pressure_pa: float, window_m: tuple[float, float]
) -> float:
    """Coefficient of variation [-] of the friction of windows of elastic contact, one of many under one load.

    covariance : C(x, y) [m^2] of the heights at distances along and across the belt [m], of `roughslip.surface`
    plane_strain_modulus_pa : E* [Pa]
    pressure_pa : p [Pa] nominal
    window_m : [m] length and width of a window, or of a whole pad

    Right to 5 % (rms) over Gaussian, Matern and self-affine surfaces at p = 1e-3 to 0.5 E* h'; see the manual. Warns of
    other spectra, as `doubt_of_law` does. In contact that yields friction does not scatter, as A = N / H. Raises
    IllPosedError where the covariance has no own rms slope, or one without a limit.
    """
    if doubt := doubt_of_law(covariance):
        warnings.warn(doubt, stacklevel=3)
    return scatter_by_law(covariance, plane_strain_modulus_pa, pressure_pa, window_m)


def scatter_by_law(
    covariance: Covariance, plane_strain_modulus_pa: float, pressure_pa: float, window_m: tuple[float, float]
) -> float:
    """The same without a warning, for callers that say `doubt_of_law` themselves."""
    rough, load = _checked(covariance, plane_strain_modulus_pa, pressure_pa, window_m)
    return math.sqrt(of_summits(rough, load) * _mean_of_pairs(covariance, rough, load, window_m))


@gate
def autocorrelation_of_friction(
    covariance: Covariance,
    plane_strain_modulus_pa: float,
    pressure_pa: float,
    window_m: tuple[float, float],
    lags_m: np.ndarray,
) -> np.ndarray:
    """Autocorrelation (K,) [-] of the friction of a window over the slipped distance.

    lags_m : (K,) [m] slipped distances
    others, and raises : as `scatter_of_friction`

    From pairs of points of the window before and after. Far longer windows than the longest wave have the triangle
    1 - lag / length. So friction is correlated over the length of the pad, not over that of its roughness.
    """
    lags_m = finite("lags_m", lags_m, 1)
    rough, load = _checked(covariance, plane_strain_modulus_pa, pressure_pa, window_m)
    variance = _mean_of_pairs(covariance, rough, load, window_m)
    return np.array([mean_over_window(covariance, rough, load, window_m, abs(float(lag))) for lag in lags_m]) / variance


def _mean_of_pairs(covariance: Covariance, rough: Roughness, load: float, window_m: tuple[float, float]) -> float:
    """T^2 [-]. Raises IllPosedError in contact so full that it is less than its error."""
    if (found := mean_over_window(covariance, rough, load, window_m)) <= 0.0:
        raise IllPosedError(
            f"under {load:.3g} E* h' contact is so full that friction scatters by less than its error: lower the load",
            scene_keys="load.nominal_pressure_pa",
        )
    return found


def _checked(
    covariance: Covariance, modulus_pa: float, pressure_pa: float, window_m: tuple[float, float]
) -> tuple[Roughness, float]:
    """The roughness and p / (E* h')."""
    positive("plane_strain_modulus_pa", modulus_pa, "Pa")
    positive("pressure_pa", pressure_pa, "Pa")
    positive("window_m", min(window_m), "m")
    rough = roughness_of(covariance)
    return rough, pressure_pa / (modulus_pa * rough.slope)


@gate
def doubt_of_law(covariance: Covariance) -> str:
    """Why the law may miss by more than 5 % for a spectrum; empty where surfaces as wide were solved.

    Raises as `scatter_of_friction`.
    """
    rough, (least, most) = roughness_of(covariance), JUDGED
    if least <= rough.bandwidth <= most:
        return ""
    error = NARROW if rough.bandwidth < least else "its error there is not known"
    return (
        f"the law of scatter was judged for widths of the spectrum of {least:g} to {most:g}, and this one has "
        f"{rough.bandwidth:.2g}: {error}"
    )


def of_summits(rough: Roughness, load: float, fitted: Sequence[float] = FITTED) -> float:
    """CV^2 over T^2 [-]: at light loads contacts are those of high summits. load : p / (E* h')"""
    a, b, k = fitted
    height = max(-float(scipy.special.ndtri(math.erf(math.sqrt(2.0) * load))), 0.0)
    return a * rough.bandwidth**b / (1.0 + k * height**2 / rough.lay)


def roughness_of(covariance: Covariance) -> Roughness:
    """Slope and spectrum of a covariance that has its own rms slope, as those of `roughslip.surface` do.

    Raises IllPosedError for another, and where the slope has no limit.
    """
    slope, curvature = (float(getattr(covariance, name, math.inf)) for name in ("rms_slope", "rms_curvature"))
    if not math.isfinite(slope):
        raise IllPosedError(
            "the rms slope of the heights is not known or grows without limit as waves get shorter, and contact with "
            "it: take a covariance of roughslip.surface and cut its spectrum off",
            scene_keys="roughness.covariance, roughness.bandwidth",
        )
    is_smooth = math.isfinite(curvature)
    step = STEP * slope / curvature if is_smooth else SHORT * min(covariance.lengths_m)  # type: ignore[attr-defined]
    x, y = np.array([0.0, step, 0.0, step, step]), np.array([0.0, 0.0, step, step, -step])
    zero, along, across, up, down = covariance(x, y) / step**2
    slopes, axes = np.linalg.eigh(
        [[2.0 * (zero - along), (down - up) / 2.0], [(down - up) / 2.0, 2.0 * (zero - across)]]
    )
    w, variance = float(slopes[0] / slopes[1]), float(zero) * step**2
    q = math.sqrt(w * (3.0 + w) * (1.0 + 3.0 * w)) / (1.0 + w) ** 2
    shot = _of_pairs(covariance, Roughness(slope, 1.0, 1.0, step), axes * np.sqrt(variance / slopes))
    bandwidth = (32.0 / (3.0 * math.pi) - 3.0) * math.sqrt(2.0 * math.pi) * variance / (slope**2 * shot * q)
    lay = elliptic_contact(1.0 / w) * math.sqrt((1.0 + w) / (2.0 * math.sqrt(w))) * q
    return Roughness(slope, bandwidth, lay, step)


def _of_pairs(covariance: Covariance, rough: Roughness, axes_m: np.ndarray) -> float:
    """c [m^2]: the integral of C p* over all distances at the lightest load. axes_m : (2, 2) columns, of equal falls"""
    panels = math.ceil(2.0 * math.log2(FAR * float(np.abs(axes_m).max()) / rough.step_m))
    log = np.linspace(-panels / 2.0, 0.0, panels + 1) * math.log(2.0) + math.log(FAR)
    r = np.exp((log[:-1, None] + np.diff(log)[:, None] * (1.0 + NODE) / 2.0).ravel())
    angle = np.arange(ANGLES) * math.pi / ANGLES
    x, y = (np.outer(np.cos(angle), a) + np.outer(np.sin(angle), b) for a, b in (np.outer(ax, r) for ax in axes_m))
    shared = np.interp(correlation_of_slopes(covariance, rough, x, y), SHARES, table_of_pairs(LIGHTEST))
    weight = np.tile(WEIGHT, panels) * math.log(2.0) / 4.0
    area = 2.0 * math.pi * abs(float(np.linalg.det(axes_m)))
    return float(LIGHTEST * area * (shared.mean(axis=0) @ (weight * r**2)))


def elliptic_contact(ratio: float) -> float:
    """Force of a Hertz contact over that of a circular one of equal mean curvature and approach.

    ratio : of the two principal curvatures, at least 1

    Method: Johnson, Contact Mechanics (1985), section 4.2, with the geometric mean of the curvatures.
    """

    def curvatures(axes: float) -> tuple[float, float, float]:
        """Both curvatures and the approach under p0 = E* and a longer semi-axis of one; axes : b / a."""
        square = 1.0 - axes**2
        first, second = scipy.special.ellipk(square), scipy.special.ellipe(square)
        scale = 2.0 * axes / square
        return scale * (first - second), scale * (second / axes**2 - first), axes * first

    def excess(axes: float) -> float:
        low, high, _ = curvatures(axes)
        return math.log(high / low / ratio)

    if ratio < 1.0 + 1e-6:
        return 1.0
    axes = scipy.optimize.brentq(excess, 1e-6, 1.0 - 1e-7)
    low, high, approach = curvatures(axes)
    return float(math.pi / 2.0 * axes / approach**1.5 * (low * high) ** 0.25)


def correlation_of_slopes(covariance: Covariance, rough: Roughness, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """rho : (broadcast of x and y) [-] minus the Laplacian of the covariance over h'^2; also that of the stress."""
    h = rough.step_m
    around = covariance(x + h, y) + covariance(x - h, y) + covariance(x, y + h) + covariance(x, y - h)
    return np.asarray(4.0 * covariance(x, y) - around) / h**2 / rough.slope**2


def mean_over_window(
    covariance: Covariance, rough: Roughness, load: float, window_m: tuple[float, float], lag_m: float = 0.0
) -> float:
    """Mean of C over pairs of points of two windows a lag apart along the belt; load : p / (E* h')."""
    (x, weight_x), (y, weight_y) = (
        distances(edge, lag, 16.0 * rough.step_m) for edge, lag in zip(window_m, (lag_m, 0.0), strict=True)
    )
    rho = correlation_of_slopes(covariance, rough, x[:, None], y[None, :])
    return float(weight_x @ np.interp(rho, SHARES, table_of_pairs(load)) @ weight_y)


@functools.lru_cache(maxsize=16)
def table_of_pairs(load: float) -> np.ndarray:
    """C at SHARES. load : p / (E* h')"""
    return pair_covariance(SHARES, 2.0 * load)


def pair_covariance(rho: np.ndarray, pressure: float) -> np.ndarray:
    """C : (as rho) [-] of the influences of two points that share a part rho of the stress's variance.

    pressure : p / s

    Where rho < 0 the stress of one rises as that of the other falls, and one of both reaches zero: above 16 p^2 none is
    left. Densities of the deviation u of the stress from p are sums over mirror images of its start.
    """
    area, found = math.erf(pressure / math.sqrt(2.0)), np.zeros_like(rho)
    for side, images, kept in (
        (1.0, (0, -1), rho > 0.0),
        (-1.0, IMAGES, (rho < 0.0) & (rho > -16.0 * pressure**2)),
    ):
        share = np.abs(rho[kept])[:, None]
        deviation, rest = np.sqrt(share), np.sqrt(2.0 * np.maximum(1.0 - share, 1e-15))
        low = -np.minimum(pressure, 9.0 * deviation)
        high = 9.0 * deviation if side > 0.0 else -low
        u = low + (high - low) * (STRESSES[0] + 1.0) / 2.0
        density = sum((-1.0) ** k * np.exp(-((u - 2.0 * k * pressure) ** 2) / (2.0 * share)) for k in images)
        one, other = (scipy.special.erf(x / rest) - area / pressure * x for x in (pressure + u, pressure + side * u))
        mean = ((high - low) / 2.0 * density * one * other) @ STRESSES[1]
        found[kept] = mean / (deviation[:, 0] * math.sqrt(2.0 * math.pi) * area**2)
    return found
