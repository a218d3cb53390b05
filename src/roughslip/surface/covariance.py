"""Stationary covariance of surface heights: closed models, a measured table, and where a rigid plane stands.

Every closed model is a function of the scaled lag (a, b) = (x'/l, y'/l'), x' along the lay and y' across it, that has
fallen to 1/e at one correlation length. Spectra are S(q) = int C(x) exp(-i q.x) dx, so that Sq^2 = int S dq / (2 pi)^2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, Protocol

import numpy as np
import scipy  # its parts when they are used: `scipy.optimize` takes half a second to import
from numpy.polynomial import chebyshev
from scipy.special import exprel, gammaln, j0, j1, kve, ndtri

from roughslip.errors import ParameterError, real
from roughslip.grid import Grid
from roughslip.validation import reals

Kind = Literal["gaussian", "exponential", "separable_exponential", "matern", "self_affine"]
KINDS: tuple[Kind, ...] = ("gaussian", "exponential", "separable_exponential", "matern", "self_affine")

NEGLIGIBLE = 1e-15  # correlation that counts as none
REACH = {"gaussian": 6.0, "exponential": 36.0, "separable_exponential": 36.0}  # lengths beyond which it is below that
SMOOTHEST = 20.0  # of the Matern family: within 0.01 of the Gaussian, and no Bessel function overflows
SERIES_END, ASYMPTOTIC_START = 4.0, 40.0  # of the self-affine integral: both ends are exact to some 1e-14

GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(80)


class StationaryCovariance(Protocol):
    """What sampling and expansion need of a covariance."""

    @property
    def rms_height_m(self) -> float:
        """Sq [m]."""
        ...

    @property
    def separable(self) -> bool:
        """Whether C(x, y) is a product of a function of x and one of y."""
        ...

    @property
    def mirror_symmetric(self) -> bool:
        """Whether C(-x, y) = C(x, y); C(-x, -y) = C(x, y) always holds."""
        ...

    @property
    def reach_m(self) -> tuple[float, float]:
        """[m] half edges along x and y of the box outside which the correlation is below 1e-15."""
        ...

    def __call__(self, x: np.ndarray, y: np.ndarray | float = 0.0) -> np.ndarray:
        """C : (broadcast of x and y) [m^2] covariance of two heights that lie x [m] and y [m] apart."""
        ...


@dataclass(frozen=True)
class Covariance:
    """Covariance of a zero-mean Gaussian field of heights. With r^2 = a^2 + b^2 of the scaled lag, C / Sq^2 is

    gaussian : exp(-r^2)
    exponential : exp(-r)
    separable_exponential : exp(-|a| - |b|), Markov along each axis
    matern : 2^(1-nu) / Gamma(nu) (s r)^nu K_nu(s r); nu = 1/2 is exponential, nu to infinity gaussian
    self_affine : the transform of a spectrum constant below q_r, falling as q^(-2-2H) up to Q q_r, zero beyond

    kind : one of these
    rms_height_m : Sq [m]
    correlation_length_m : l [m] along the lay, where the autocorrelation is 1/e
    correlation_length_across_m : l' [m] across it; equal to l if not given
    lay_rad : angle from x to the lay
    smoothness : nu of matern [-]
    hurst : H of self_affine, in (0, 1] [-]
    bandwidth : Q = q_s / q_r of self_affine, above 1 [-]

    Raises ParameterError for values outside these ranges, and for shape parameters that the kind does not have.
    """

    kind: Kind
    rms_height_m: float
    correlation_length_m: float
    correlation_length_across_m: float | None = None
    lay_rad: float = 0.0
    smoothness: float | None = None
    hurst: float | None = None
    bandwidth: float | None = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ParameterError(f"covariance {self.kind!r} is not known: {', '.join(KINDS)}")
        lengths = self.lengths_m
        for name, value in (("rms height", self.rms_height_m), *(("correlation length", length) for length in lengths)):
            if not (math.isfinite(real(name, value)) and value > 0):
                raise ParameterError(f"{name} must be positive and finite, not {value}")
        if not math.isfinite(real("the angle of lay", self.lay_rad)):
            raise ParameterError(f"the angle of lay must be finite, not {self.lay_rad}")
        _check_shape("matern", self.kind, "smoothness", self.smoothness, 0.05, SMOOTHEST)
        _check_shape("self_affine", self.kind, "hurst", self.hurst, 0.01, 1.0)
        _check_shape("self_affine", self.kind, "bandwidth", self.bandwidth, 1.0 + 1e-6, 1e9)

    @property
    def lengths_m(self) -> tuple[float, float]:
        """(l, l') [m] along and across the lay."""
        across = self.correlation_length_across_m
        return self.correlation_length_m, self.correlation_length_m if across is None else across

    @property
    def axis_lengths_m(self) -> tuple[float, float]:
        """[m] distances along x and y at which the autocorrelation is 1/e."""
        (along, across), (cos, sin) = self.lengths_m, _direction(self.lay_rad)
        if sin == 0.0:
            return along, across
        if self.kind == "separable_exponential":
            return 1 / (abs(cos) / along + abs(sin) / across), 1 / (abs(sin) / along + abs(cos) / across)
        return 1 / math.hypot(cos / along, sin / across), 1 / math.hypot(sin / along, cos / across)

    @property
    def mirror_symmetric(self) -> bool:
        """Whether C(-x, y) = C(x, y)."""
        along, across = self.lengths_m
        round_ = along == across and self.kind != "separable_exponential"
        return round_ or 0.0 in _direction(self.lay_rad)

    @property
    def separable(self) -> bool:
        """Whether C(x, y) is a product of a function of x and one of y."""
        return self.kind in ("gaussian", "separable_exponential") and self.mirror_symmetric

    @property
    def reach_m(self) -> tuple[float, float]:
        """[m] half edges of the box outside which the correlation is below 1e-15; infinite for self_affine."""
        (along, across), (cos, sin) = self.lengths_m, _direction(self.lay_rad)
        reach = _matern_reach(self.smoothness) if self.smoothness is not None else REACH.get(self.kind, math.inf)
        if self.kind == "separable_exponential":  # a rhombus: its vertices lie on the axes of lay
            return reach * max(along * abs(cos), across * abs(sin)), reach * max(along * abs(sin), across * abs(cos))
        return reach * math.hypot(along * cos, across * sin), reach * math.hypot(along * sin, across * cos)

    @property
    def rolloff_wavelengths_m(self) -> tuple[float, float]:
        """2 pi / q_r [m] of self_affine along and across the lay."""
        if self.hurst is None or self.bandwidth is None:
            raise ParameterError(f"a {self.kind} covariance has no roll-off")
        scale = 2 * math.pi / _self_affine_scale(self.hurst, self.bandwidth)
        return scale * self.lengths_m[0], scale * self.lengths_m[1]

    @property
    def cutoff_wavelengths_m(self) -> tuple[float, float]:
        """2 pi / q_s [m] of self_affine along and across the lay."""
        along, across = self.rolloff_wavelengths_m
        return along / (self.bandwidth or 1.0), across / (self.bandwidth or 1.0)

    def __call__(self, x: np.ndarray, y: np.ndarray | float = 0.0) -> np.ndarray:
        """C : (broadcast of x and y) [m^2] covariance of two heights that lie x [m] and y [m] apart."""
        (along, across), (cos, sin) = self.lengths_m, _direction(self.lay_rad)
        if sin != 0.0:
            x, y = cos * x + sin * y, cos * y - sin * x
        if self.kind == "gaussian":
            correlation = np.exp(-((x / along) ** 2) - (y / across) ** 2)
        elif self.kind == "separable_exponential":
            correlation = np.exp(-np.abs(x / along)) * np.exp(-np.abs(y / across))
        else:
            r = np.hypot(x, y) / along if along == across else np.hypot(x / along, y / across)
            if self.smoothness is not None:
                correlation = _matern(_matern_scale(self.smoothness) * r, self.smoothness)
            elif self.hurst is not None and self.bandwidth is not None:
                scale = _self_affine_scale(self.hurst, self.bandwidth)
                correlation = _self_affine(scale * r, self.hurst, self.bandwidth)
            else:
                correlation = np.exp(-r)
        return self.rms_height_m**2 * correlation

    def spectrum(self, qx: np.ndarray, qy: np.ndarray | float = 0.0) -> np.ndarray:
        """S : (broadcast of qx and qy) [m^4] spectral density at the wave vector (qx, qy) [rad/m]."""
        (along, across), (cos, sin) = self.lengths_m, _direction(self.lay_rad)
        a, b = along * (cos * qx + sin * qy), across * (cos * qy - sin * qx)
        if self.kind == "separable_exponential":
            shape = 4.0 / ((1 + a**2) * (1 + b**2))
        elif self.kind == "gaussian":
            shape = math.pi * np.exp(-(a**2 + b**2) / 4)
        elif self.hurst is not None and self.bandwidth is not None:
            scale = _self_affine_scale(self.hurst, self.bandwidth)
            k = np.hypot(a, b) / scale
            plateau = 2 * math.pi / (scale**2 * _self_affine_mass(self.hurst, self.bandwidth))
            shape = np.where(k <= self.bandwidth, plateau * np.maximum(k, 1.0) ** (-2 - 2 * self.hurst), 0.0)
        else:
            nu = 0.5 if self.smoothness is None else self.smoothness
            scale = _matern_scale(nu)
            shape = 4 * math.pi * nu / scale**2 * (1 + (a**2 + b**2) / scale**2) ** (-nu - 1)
        return self.rms_height_m**2 * along * across * shape


def self_affine(
    rms_height_m: float,
    hurst: float,
    rolloff_wavelength_m: float,
    cutoff_wavelength_m: float,
    rolloff_wavelength_across_m: float | None = None,
    lay_rad: float = 0.0,
) -> Covariance:
    """The self-affine covariance of a roll-off and a cut-off wavelength.

    rms_height_m : Sq [m]
    hurst : H [-]; the fractal dimension of a profile is 2 - H, that of the surface 3 - H
    rolloff_wavelength_m : 2 pi / q_r [m] along the lay; longer waves have a constant spectrum
    cutoff_wavelength_m : 2 pi / q_s [m] along the lay; none is shorter. `nyquist_wavelength` of the mesh or more
    rolloff_wavelength_across_m : [m] across the lay, with the cut-off in the same ratio; equal if not given
    lay_rad : angle from x to the lay

    Returns the covariance, whose `correlation_length_m` is its 1/e length. Raises ParameterError as Covariance.
    Method: Persson et al., J. Phys.: Condens. Matter 17 (2005) R1, section 3, with the transform in closed functions.
    """
    wavelengths = rolloff_wavelength_m, cutoff_wavelength_m, rolloff_wavelength_across_m or rolloff_wavelength_m
    if not all(math.isfinite(real("a wavelength", length)) and length > 0 for length in wavelengths):
        raise ParameterError(f"wavelengths must be positive and finite, not {wavelengths}")
    bandwidth = rolloff_wavelength_m / cutoff_wavelength_m
    _check_shape("self_affine", "self_affine", "hurst", hurst, 0.01, 1.0)
    _check_shape("self_affine", "self_affine", "bandwidth", bandwidth, 1.0 + 1e-6, 1e9)
    scale = _self_affine_scale(hurst, bandwidth) / (2 * math.pi)
    along, across = scale * wavelengths[0], scale * wavelengths[2]
    return Covariance("self_affine", rms_height_m, along, across, lay_rad, hurst=hurst, bandwidth=bandwidth)


def nyquist_wavelength(grid: Grid) -> float:
    """[m] the shortest wave that the mesh resolves on both axes."""
    return 2.0 * max(grid.dx, grid.dy)


def plane_height(percentile: float | np.ndarray, rms_height_m: float) -> np.ndarray:
    """h_p [m] that `percentile` per cent of the ensemble of Gaussian heights lie above; 50 is the median."""
    above = reals("a penetration percentile", percentile) / 100.0
    if not np.all((above > 0) & (above < 1)):
        raise ParameterError(f"a penetration percentile lies between 0 and 100, not {percentile}")
    return np.asarray(rms_height_m * ndtri(1.0 - above))


def _check_shape(owner: str, kind: str, name: str, value: float | None, low: float, high: float) -> None:
    if kind != owner and value is not None:
        raise ParameterError(f"a {kind} covariance has no {name}")
    if value is not None:
        real(f"the {name}", value)
    if kind == owner and not (value is not None and low <= value <= high):  # a NaN fails both comparisons
        raise ParameterError(f"the {name} of a {kind} covariance must lie in [{low:g}, {high:g}], not {value}")


def _direction(lay_rad: float) -> tuple[float, float]:
    """Cosine and sine of the lay, exact at quarter turns."""
    cos, sin = math.cos(lay_rad), math.sin(lay_rad)
    if min(abs(cos), abs(sin)) < 1e-12:
        return float(round(cos)), float(round(sin))
    return cos, sin


def _matern(u: np.ndarray, nu: float) -> np.ndarray:
    """2^(1-nu) / Gamma(nu) u^nu K_nu(u) through logarithms: the factors overflow long before their product."""
    positive = np.maximum(u, 1e-12)  # where the product is 1 within rounding unless nu is near zero
    log = (1 - nu) * math.log(2) - gammaln(nu) + nu * np.log(positive) + np.log(kve(nu, positive)) - positive
    return np.where(u > 0, np.exp(log), 1.0)


@lru_cache
def _matern_scale(nu: float) -> float:
    """s with a correlation of 1/e at u = s."""
    return float(
        scipy.optimize.brentq(lambda u: _matern(np.array(u), nu) - math.exp(-1), 1e-12, 100.0, xtol=1e-15, rtol=1e-15)
    )


@lru_cache
def _matern_reach(nu: float) -> float:
    end = scipy.optimize.brentq(lambda u: float(np.log(_matern(np.array(u), nu))) - math.log(NEGLIGIBLE), 1.0, 400.0)
    return float(end) / _matern_scale(nu)


def _self_affine_mass(hurst: float, bandwidth: float) -> float:
    """int k S(k) / S(0) dk over 0 ... Q, in units of q_r."""
    return 0.5 - math.expm1(-2 * hurst * math.log(bandwidth)) / (2 * hurst)


def _self_affine(u: np.ndarray, hurst: float, bandwidth: float) -> np.ndarray:
    """Correlation at u = q_r r: int_0^1 k J0(u k) dk + int_1^Q k^(-1-2H) J0(u k) dk over the mass of the spectrum.

    With G(z) = z^2H int_z^inf t^(-1-2H) J0(t) dt the second integral is G(u) - Q^(-2H) G(Q u).
    """
    plateau = np.where(u > 0, j1(u) / np.where(u > 0, u, 1.0), 0.5)
    slope = _tail_integral(u, hurst) - bandwidth ** (-2 * hurst) * _tail_integral(bandwidth * u, hurst)
    return (plateau + slope) / _self_affine_mass(hurst, bandwidth)


@lru_cache
def _self_affine_scale(hurst: float, bandwidth: float) -> float:
    """s = q_r l with a correlation of 1/e at u = s."""
    return float(
        scipy.optimize.brentq(
            lambda u: _self_affine(np.array(u), hurst, bandwidth) - math.exp(-1), 1e-12, 3.5, xtol=1e-14
        )
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
        result[middle] = chebyshev.chebval(_to_unit_interval(z[middle]), _tail_coefficients(hurst))
    if large.any():
        result[large] = _tail_asymptotics(z[large], hurst)
    return result


def _tail_series(z: np.ndarray, hurst: float) -> np.ndarray:
    """The series of J0 integrated term by term from z to SERIES_END, and G there.

    (c^p - z^p) / p is written with exprel, so that H = 1, where an exponent p = 2k - 2H vanishes, is no exception.
    """
    at_end = _tail_at_series_end(hurst)
    log = np.log(np.maximum(z, 1e-300) / SERIES_END)
    total = at_end * np.exp(2 * hurst * log) - np.expm1(2 * hurst * log) / (2 * hurst)
    coefficient = 1.0
    for k in range(1, 25):
        coefficient *= -(SERIES_END**2) / (4 * k**2)
        total -= coefficient * np.exp(2 * hurst * log) * log * exprel((2 * k - 2 * hurst) * log)
    return np.where(z > 0, total, 1 / (2 * hurst))  # z^2H vanishes too slowly for a cut near zero


@lru_cache
def _tail_at_series_end(hurst: float) -> float:
    return float(chebyshev.chebval(-1.0, _tail_coefficients(hurst)))


def _tail_asymptotics(z: np.ndarray, hurst: float) -> np.ndarray:
    """I_a = int_z^inf t^-a J0 = -z^-a J1 + (a + 1) z^(-a-1) J0 - (a + 1)^2 I_(a+2), twice by parts, repeated."""
    a, factor, total = 1 + 2 * hurst, 1 / z, np.zeros_like(z)
    first, zeroth = j1(z), j0(z)
    for _ in range(16):
        total += factor * ((a + 1) / z * zeroth - first)
        factor = -factor * ((a + 1) / z) ** 2
        a += 2
    return total


def _to_unit_interval(z: np.ndarray) -> np.ndarray:
    return (2 * z - SERIES_END - ASYMPTOTIC_START) / (ASYMPTOTIC_START - SERIES_END)


@lru_cache
def _tail_coefficients(hurst: float, degree: int = 80) -> np.ndarray:
    """Chebyshev coefficients of G on SERIES_END ... ASYMPTOTIC_START from Gauss-Legendre quadrature."""
    beyond = float(_tail_asymptotics(np.array([ASYMPTOTIC_START]), hurst)[0]) * ASYMPTOTIC_START ** (-2 * hurst)

    def tail(unit: np.ndarray) -> np.ndarray:
        z = SERIES_END + (unit + 1) / 2 * (ASYMPTOTIC_START - SERIES_END)
        half = (ASYMPTOTIC_START - z)[:, None] / 2
        t = z[:, None] + half * (GAUSS_NODES + 1)
        integral = np.sum(half * GAUSS_WEIGHTS * t ** (-1 - 2 * hurst) * j0(t), axis=1)
        return z ** (2 * hurst) * (beyond + integral)

    return chebyshev.chebinterpolate(tail, degree)
