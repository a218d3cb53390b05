"""The Gaussian covariance exp(-r^2)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from roughslip.surface.covariance import IsotropicCovariance


@dataclass(frozen=True)
class Gaussian(IsotropicCovariance):
    """exp(-r^2): infinitely smooth, and a product of functions of x and of y."""

    kind = "gaussian"
    is_product = True
    near_power = 1.0
    scale, reach = 1.0, 6.0

    def profile(self, u: np.ndarray) -> np.ndarray:
        """C / Sq^2 : (as u) [-]."""
        return np.exp(-(u**2))

    def correlation(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """C / Sq^2 : (broadcast of a and b) [-]."""
        return np.exp(-(a**2) - b**2)

    def transform(self, k: np.ndarray) -> np.ndarray:
        """Spectrum of the profile : (as k) [-]."""
        return math.pi * np.exp(-(k**2) / 4)
