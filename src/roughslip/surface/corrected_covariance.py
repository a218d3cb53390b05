"""The covariance of the Gaussian field whose translated heights have the covariance asked for.

Translation maps a correlation rho of the Gaussian variables to rho_z(rho). Its inverse, lag by lag, gives the Gaussian
correlation, if the result is positive semidefinite. For smooth kernels it is not. Near lag zero
rho ~ rho_z / w_1 - (w_2 / w_1^3) rho_z^2, and the square of a Gaussian kernel has the wider spectrum. The difference
is then negative at short waves. Kernels whose spectra fall by a power (exponential, matern) allow the inversion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.probability import Translation
from roughslip.surface.covariance import StationaryCovariance
from roughslip.surface.embedding import circulant_lags

NODES, NODES_PER_LENGTH = 256, 8  # of the mesh, on each axis, on which the existence of the correction is tested
NEGATIVE_SHARE = 1e-6  # of the spectrum that may be cut


def corrected_correlation(translation: Translation, wanted: np.ndarray) -> np.ndarray:
    """The correlation of the Gaussian field on a torus that gives the heights the one wanted, inverted point by point.

    wanted : (tx, ty) [-] of the heights, by lag on a torus: 1 at lag zero, even

    Returns rho : (tx, ty) [-], positive semidefinite. Raises IllPosedError where no Gaussian field gives it, with the
    deviation of the nearest: raised to the least correlation possible, with its spectrum cut at zero.
    """
    minimum = translation.least_correlation
    gaussian = translation.gaussian_correlation(np.maximum(wanted, minimum))
    spectrum = np.fft.fftn(gaussian).real
    positive = np.maximum(spectrum, 0.0)
    nearest = np.fft.ifftn(positive * (wanted.size / np.sum(positive))).real
    reasons, below = [], minimum - float(np.min(wanted))
    if below > translation.least_error:
        reasons.append(f"it falls {below:.2g} below the least possible {minimum:.4g}")
    negative = float(np.sum(positive - spectrum) / np.sum(np.abs(spectrum)))
    if negative > NEGATIVE_SHARE:
        reasons.append(f"{negative:.2g} of the spectrum needed is negative (allowed {NEGATIVE_SHARE:.2g})")
    if reasons:
        deviation = float(np.max(np.abs(translation.correlation(nearest) - wanted)))
        raise IllPosedError(
            f"no Gaussian field gives the wanted correlation: {' and '.join(reasons)}; the nearest deviates by "
            f"{deviation:.2g}: leave the correlation uncorrected; scene key: roughness.correct_correlation"
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
