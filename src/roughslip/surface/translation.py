"""Isoprobabilistic transformation of a Gaussian field, z = F^-1(Phi(g)), and what it does to the correlation.

With normalised Hermite polynomials h_n the transformation is z(g) = sum_n c_n h_n(g), and by Mehler's formula heights
whose Gaussian variables have correlation rho have the correlation rho_z = sum_n w_n rho^n, w_n = c_n^2 / Sq^2
(M. Grigoriu, J. Eng. Mech. 110 (1984) 610). It increases from rho_z(-1), the least that the marginal allows, to 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.fft

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.surface.marginal import HeightMarginal
from roughslip.validation import reals

TABLE_EDGE, TABLE_NODES = 8.5, 2**13 + 1  # normal scores; beyond the edge lies a probability of 2e-17
BOUNDED_EDGE = 6.0  # up to which the error of the table is bounded; beyond lies 2e-9
MOST_TERMS = 120
ENOUGH = 1e-12  # share of the variance at which the series ends
LEFT_OUT = 1e-4  # share that 120 terms may leave out at most
CORRELATION_NODES = 4097
CORRELATION_ERROR = 1e-12  # of the inverse, in rho_z
MOST_STEPS = 50
SMALLEST_SLOPE = 1e-9  # keeps Newton finite where rho_z is flat, near rho = -1
NEGATIVE_SHARE = 1e-6


@dataclass(frozen=True, eq=False)
class Translation:
    """The transformation, as a table, and its Hermite series.

    normal, heights : (nodes,) [-] standard normal g, equally spaced, and [m] z(g)
    table_error_m : [m] bound of the error of linear interpolation for |g| < 6
    coefficients : (N,) [m] c_1, c_2, ...
    shares : (N + 1,) [-] w_1, w_2, ... and what the series leaves out, taken as w_{N+1}, so that they sum to one
    left_out : [-] that remainder; rho_z errs by no more than twice as much
    quadrature_error : [-] largest change of a share from the quadrature with half the nodes
    """

    normal: np.ndarray
    heights: np.ndarray
    table_error_m: float
    coefficients: np.ndarray
    shares: np.ndarray
    left_out: float
    quadrature_error: float

    def apply(self, gaussian: np.ndarray) -> np.ndarray:
        """z : (as gaussian) [m] heights of a field of standard normal variables [-]."""
        if not np.isfinite(reals("the Gaussian field", gaussian)).all():
            raise ParameterError("the Gaussian field must be finite")
        first, last = self.normal[[0, -1]]
        position = (np.clip(gaussian, first, last) - first) * ((self.normal.size - 1) / (last - first))
        cell = np.minimum(position.astype(np.intp), self.normal.size - 2)
        return self.heights[cell] + (position - cell) * (self.heights[cell + 1] - self.heights[cell])

    def correlation(self, gaussian_correlation: float | np.ndarray) -> np.ndarray:
        """rho_z : (as the argument) [-] of heights whose Gaussian variables have that correlation."""
        rho = _correlations(gaussian_correlation)
        return rho * np.polynomial.polynomial.polyval(rho, self.shares)

    @property
    def least_correlation(self) -> float:
        """rho_z(-1) [-], below which no two heights of this marginal can be correlated by a Gaussian field."""
        return float(self.correlation(-1.0))

    @property
    def least_error(self) -> float:
        """Bound of the error of the least correlation [-]."""
        return 1e-9 + 2.0 * abs(self.left_out)

    @property
    def correlation_change(self) -> float:
        """Largest |rho_z - rho| [-] for rho from 0 to 1, on 4097 nodes."""
        rho = np.linspace(0.0, 1.0, CORRELATION_NODES)
        return float(np.max(np.abs(self.correlation(rho) - rho)))

    def gaussian_correlation(self, correlation: float | np.ndarray) -> np.ndarray:
        """rho : (as the argument) [-] of the Gaussian variables such that the heights have the correlation given.

        Newton within the cells of a table of 4097 nodes, to 1e-12 of rho_z. Raises IllPosedError below the least
        correlation.
        """
        wanted = _correlations(correlation)
        least = self.least_correlation
        if np.any(wanted < least - self.least_error):
            raise IllPosedError(
                f"correlation {float(np.min(wanted)):.4g} is wanted, but this marginal allows none below {least:.4g}; "
                f"use a less skewed marginal or the nearest correlation"
            )
        wanted = np.maximum(wanted, least)
        nodes = np.linspace(-1.0, 1.0, CORRELATION_NODES)
        table = self.correlation(nodes)
        cell = np.clip(np.searchsorted(table, wanted), 1, nodes.size - 1)
        rho = np.interp(wanted, table, nodes)
        slope = np.polynomial.Polynomial(np.concatenate(([0.0], self.shares))).deriv()
        for _ in range(MOST_STEPS):
            excess = self.correlation(rho) - wanted
            residual = float(np.max(np.abs(excess), initial=0.0))
            if residual < CORRELATION_ERROR:
                return rho
            rho = np.clip(rho - excess / np.maximum(slope(rho), SMALLEST_SLOPE), nodes[cell - 1], nodes[cell])
        raise ConvergenceError("no Gaussian correlation was found; use a less skewed marginal", residual, MOST_STEPS)


def translate(marginal: HeightMarginal) -> Translation:
    """The transformation to a marginal, its Hermite series and their errors.

    Coefficients by the trapezoidal rule on the table: with the normal weight it converges faster than any power
    for smooth z, and faster than Gauss-Hermite for others, whose nodes lie mostly where the weight is nil
    (L. N. Trefethen, SIAM Review 64 (2022) 132). Raises IllPosedError where 120 terms leave out 1e-4 of the variance.
    """
    normal = np.linspace(-TABLE_EDGE, TABLE_EDGE, TABLE_NODES)
    heights = marginal.from_gaussian(normal)
    if not (np.isfinite(heights).all() and (np.diff(heights) >= 0.0).all()):
        raise ParameterError("the quantile function of the marginal must be finite and increase")
    fine = _series(normal, heights, marginal.rms_height_m)
    coarse = _series(normal[::2], heights[::2], marginal.rms_height_m)
    common = min(fine.size, coarse.size)
    shares = (fine / marginal.rms_height_m) ** 2
    quadrature_error = float(np.max(np.abs(shares[:common] - (coarse[:common] / marginal.rms_height_m) ** 2)))
    left_out = 1.0 - float(np.sum(shares))
    if not abs(left_out) < LEFT_OUT:
        raise IllPosedError(
            f"{fine.size} Hermite polynomials leave out {left_out:.1e} of the variance of the heights: the marginal "
            f"is too close to steps or its tail too long; use a smoother one"
        )
    bends = np.abs(np.diff(heights, 2))[np.abs(normal[1:-1]) < BOUNDED_EDGE]
    return Translation(
        normal=normal,
        heights=heights,
        table_error_m=float(np.max(bends)) / 8.0,
        coefficients=fine,
        shares=np.append(shares, left_out) if left_out > 0.0 else shares / np.sum(shares),
        left_out=left_out,
        quadrature_error=quadrature_error,
    )


def _series(normal: np.ndarray, heights: np.ndarray, rms_height_m: float) -> np.ndarray:
    """c_1, c_2, ... [m], until they carry the variance to 1e-12 or 120 are reached."""
    weight = np.exp(-0.5 * normal**2) / math.sqrt(2.0 * math.pi) * (normal[1] - normal[0]) * heights
    before, now = np.ones_like(normal), normal.copy()
    coefficients: list[float] = []
    variance = 0.0
    for n in range(1, MOST_TERMS + 1):
        coefficients.append(float(np.sum(weight * now)))
        variance += (coefficients[-1] / rms_height_m) ** 2
        if variance > 1.0 - ENOUGH:
            break
        before, now = now, (normal * now - math.sqrt(n) * before) / math.sqrt(n + 1.0)
    return np.array(coefficients)


def _correlations(values: float | np.ndarray) -> np.ndarray:
    rho = reals("correlations", values)
    if not np.all(np.abs(rho) <= 1.0 + 1e-9):
        raise ParameterError("correlations lie between -1 and 1")
    return np.clip(rho, -1.0, 1.0)


@dataclass(frozen=True, eq=False)
class TorusCorrelation:
    """The correlation of a Gaussian field on a torus such that the translated field has one close to that wanted.

    gaussian : (tx,) or (tx, ty) [-] positive semidefinite correlation by lag, lag zero first, negative lags at the end
    translated : (as gaussian) [-] correlation of the heights
    deviation : [-] largest |translated - wanted|
    below_least : [-] by how much the wanted correlation lies below the least one possible, 0 where it does not
    negative_share : [-] of the spectrum, in negative values that were set to zero
    """

    gaussian: np.ndarray
    translated: np.ndarray
    deviation: float
    below_least: float
    negative_share: float


def nearest_correlation(translation: Translation, correlation: np.ndarray) -> TorusCorrelation:
    """The correlation wanted, raised to the least one possible, inverted point by point, its spectrum cut at zero.

    correlation : (tx,) or (tx, ty) [-] of the heights, by lag on a torus: 1 at lag zero, even

    The spectrum left is scaled so that lag zero keeps 1. Raises ParameterError for what is no correlation on a torus.
    """
    wanted = _correlations(correlation)
    if wanted.ndim not in (1, 2) or wanted.size < 2 or abs(float(wanted.flat[0]) - 1.0) > 1e-9:
        raise ParameterError("a correlation on a torus is a row or a table of lags with 1 at lag zero")
    mirror = np.roll(np.flip(wanted), 1, axis=tuple(range(wanted.ndim)))
    if np.max(np.abs(wanted - mirror)) > 1e-9:
        raise ParameterError("a correlation on a torus is even: the same at opposite lags, negative lags at the end")
    below_least = translation.least_correlation - float(np.min(wanted))
    gaussian = translation.gaussian_correlation(np.maximum(wanted, translation.least_correlation))
    spectrum = scipy.fft.fftn(gaussian).real
    positive = np.maximum(spectrum, 0.0)
    negative_share = float(np.sum(positive - spectrum) / np.sum(np.abs(spectrum)))
    gaussian = scipy.fft.ifftn(positive * (wanted.size / np.sum(positive))).real
    translated = translation.correlation(gaussian)
    deviation = float(np.max(np.abs(translated - wanted)))
    below_least = below_least if below_least > translation.least_error else 0.0
    return TorusCorrelation(gaussian, translated, deviation, below_least, negative_share)


def corrected_correlation(
    translation: Translation, correlation: np.ndarray, negative_share: float = NEGATIVE_SHARE
) -> TorusCorrelation:
    """The correlation of the Gaussian field that gives the heights the one wanted, on a torus.

    Arguments as in `nearest_correlation`; negative_share : [-] of the spectrum that may be cut.
    Raises IllPosedError where no Gaussian field gives it, with the deviation of the nearest one.
    """
    nearest = nearest_correlation(translation, correlation)
    reasons = []
    if nearest.below_least > 0.0:
        least = translation.least_correlation
        reasons.append(f"it falls {nearest.below_least:.2g} below the least possible {least:.4g}")
    if nearest.negative_share > negative_share:
        reasons.append(
            f"{nearest.negative_share:.2g} of the spectrum needed is negative (allowed {negative_share:.2g})"
        )
    if reasons:
        raise IllPosedError(
            f"no Gaussian field gives the wanted correlation: {' and '.join(reasons)}; the nearest deviates by "
            f"{nearest.deviation:.2g} (nearest_correlation returns it); a larger torus may also help"
        )
    return nearest
