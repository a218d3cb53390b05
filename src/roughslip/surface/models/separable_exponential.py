"""The separable exponential covariance exp(-|a| - |b|)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roughslip.surface.covariance import Covariance, direction


@dataclass(frozen=True)
class SeparableExponential(Covariance):
    """exp(-|a| - |b|), a Markov process along each axis of the lay. Its lines of equal correlation are rhombi."""

    kind = "separable_exponential"
    is_product = True
    near_power = 2.0
    is_fitted_with_lay = False  # its axes are those of the mesh, else it would not be separable

    def correlation(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """C / Sq^2 : (broadcast of a and b) [-]."""
        return np.exp(-np.abs(a)) * np.exp(-np.abs(b))

    def density(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Spectrum of the correlation : (broadcast of a and b) [-]."""
        return 4.0 / ((1 + a**2) * (1 + b**2))

    @property
    def axis_lengths_m(self) -> tuple[float, float]:
        """[m] distances along x and y at which the autocorrelation is 1/e."""
        (along, across), (cos, sin) = self.lengths_m, direction(self.lay_rad)
        return 1 / (abs(cos) / along + abs(sin) / across), 1 / (abs(sin) / along + abs(cos) / across)

    @property
    def reach_m(self) -> tuple[float, float]:
        """[m] half edges of the box outside which the correlation is below 1e-15: vertices lie on the axes of lay."""
        (along, across), (cos, sin) = self.lengths_m, direction(self.lay_rad)
        x, y = max(along * abs(cos), across * abs(sin)), max(along * abs(sin), across * abs(cos))
        return 36.0 * x, 36.0 * y
