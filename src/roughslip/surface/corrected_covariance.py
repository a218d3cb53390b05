"""The covariance of the Gaussian field whose translated heights have the covariance asked for.

Translation maps a correlation rho of the Gaussian variables to rho_z(rho); its inverse, lag by lag, gives the Gaussian
correlation of a wanted one, where that is a correlation at all. Of smooth kernels it is not: near lag zero
rho ~ rho_z / w_1 - (w_2 / w_1^3) rho_z^2, and a Gaussian kernel squared has the wider spectrum, so that the difference
turns negative at short waves. Kernels whose spectra fall by a power (exponential, matern) allow it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roughslip.grid import Grid
from roughslip.surface.covariance import StationaryCovariance
from roughslip.surface.embedding import circulant_lags
from roughslip.surface.translation import Translation, corrected_correlation

NODES, NODES_PER_LENGTH = 256, 8  # of the mesh, on each axis, on which it is seen whether the correction exists


@dataclass(frozen=True, eq=False)
class CorrectedCovariance:
    """Made by `corrected`. wanted : covariance of the heights; translation : from the Gaussian variables to them."""

    wanted: StationaryCovariance
    translation: Translation

    @property
    def rms_height_m(self) -> float:
        """Sq [m]."""
        return self.wanted.rms_height_m

    @property
    def separable(self) -> bool:
        """A product of two correlations, inverted, is no product."""
        return False

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
