"""The covariance of the Gaussian field whose translated heights have the covariance asked for.

Translation maps a correlation rho of the Gaussian variables to rho_z(rho). Its inverse, lag by lag, gives the Gaussian
correlation, if the result is positive semidefinite. For smooth kernels it is not. Near lag zero
rho ~ rho_z / w_1 - (w_2 / w_1^3) rho_z^2, and the square of a Gaussian kernel has the wider spectrum. The difference
is then negative at short waves. Kernels whose spectra fall by a power (exponential, matern) allow the inversion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roughslip.errors import IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.probability import Translation
from roughslip.probability.translation import checked_correlations
from roughslip.surface.covariance import StationaryCovariance
from roughslip.surface.embedding import circulant_lags

NODES, NODES_PER_LENGTH = 256, 8  # of the mesh, on each axis, on which the existence of the correction is tested
NEGATIVE_SHARE = 1e-6  # of the spectrum that may be cut


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
    wanted = checked_correlations(correlation)
    if wanted.ndim not in (1, 2) or wanted.size < 2 or abs(float(wanted.flat[0]) - 1.0) > 1e-9:
        raise ParameterError(
            f"a correlation on a torus is a row or a table of lags with 1 at lag zero, not of the shape {wanted.shape}"
            + (f" with {float(wanted.flat[0])}" if wanted.size else "")
        )
    mirror = np.roll(np.flip(wanted), 1, axis=tuple(range(wanted.ndim)))
    if np.max(np.abs(wanted - mirror)) > 1e-9:
        raise ParameterError("a correlation on a torus is even: the same at opposite lags, negative lags at the end")
    below_least = translation.least_correlation - float(np.min(wanted))
    gaussian = translation.gaussian_correlation(np.maximum(wanted, translation.least_correlation))
    spectrum = np.fft.fftn(gaussian).real
    positive = np.maximum(spectrum, 0.0)
    negative_share = float(np.sum(positive - spectrum) / np.sum(np.abs(spectrum)))
    gaussian = np.fft.ifftn(positive * (wanted.size / np.sum(positive))).real
    translated = translation.correlation(gaussian)
    deviation = float(np.max(np.abs(translated - wanted)))
    below_least = below_least if below_least > translation.least_error else 0.0
    return TorusCorrelation(gaussian, translated, deviation, below_least, negative_share)


def corrected_correlation(translation: Translation, correlation: np.ndarray) -> TorusCorrelation:
    """The correlation of the Gaussian field that gives the heights the one wanted, on a torus.

    Arguments as in `nearest_correlation`. Raises IllPosedError, with the deviation of the nearest correlation, where no
    Gaussian field gives it.
    """
    nearest = nearest_correlation(translation, correlation)
    reasons = []
    if nearest.below_least > 0.0:
        minimum = translation.least_correlation
        reasons.append(f"it falls {nearest.below_least:.2g} below the least possible {minimum:.4g}")
    if nearest.negative_share > NEGATIVE_SHARE:
        reasons.append(
            f"{nearest.negative_share:.2g} of the spectrum needed is negative (allowed {NEGATIVE_SHARE:.2g})"
        )
    if reasons:
        raise IllPosedError(
            f"no Gaussian field gives the wanted correlation: {' and '.join(reasons)}; the nearest deviates by "
            f"{nearest.deviation:.2g}: take it from nearest_correlation, or leave the correlation uncorrected; scene "
            "keys: roughness.marginal.correct_correlation, roughness.scan.correct_correlation"
        )
    return nearest


@dataclass(frozen=True, eq=False)
class CorrectedCovariance:
    """Made by `corrected`. wanted : covariance of the heights; translation : from the Gaussian variables to them."""

    wanted: StationaryCovariance
    translation: Translation
    separable = False  # a product of two correlations, inverted, is no product

    @property
    def rms_height_m(self) -> float:
        """Sq [m]."""
        return self.wanted.rms_height_m

    @property
    def mirror_symmetric(self) -> bool:
        """Whether C(-x, y) = C(x, y)."""
        return self.wanted.mirror_symmetric

    @property
    def reach_m(self) -> tuple[float, float]:
        """[m] half edges of the box outside which the correlation is negligible."""
        return self.wanted.reach_m

    def __call__(self, x: np.ndarray, y: np.ndarray | float = 0.0) -> np.ndarray:
        """C : (broadcast of x and y) [m^2] covariance of the Gaussian field at lags x [m] and y [m]."""
        variance = self.rms_height_m**2
        return variance * self.translation.gaussian_correlation(self.wanted(x, y) / variance)


def corrected(
    wanted: StationaryCovariance, translation: Translation, lengths_m: tuple[float, float]
) -> CorrectedCovariance:
    """The correction, once it is seen on a torus that a Gaussian field can have it.

    lengths_m : 1/e lengths along x and y [m], for the cells of the torus

    Raises IllPosedError, with the deviation of the nearest correlation, where none can.
    """
    cells = lengths_m[0] / NODES_PER_LENGTH, lengths_m[1] / NODES_PER_LENGTH
    lags = circulant_lags(wanted, Grid(NODES, NODES, *cells), (2 * NODES, 2 * NODES))
    corrected_correlation(translation, lags / wanted.rms_height_m**2)
    return CorrectedCovariance(wanted, translation)
