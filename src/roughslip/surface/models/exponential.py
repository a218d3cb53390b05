"""The exponential covariance exp(-r)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from roughslip.surface.covariance import IsotropicCovariance


@dataclass(frozen=True)
class Exponential(IsotropicCovariance):
    """exp(-r): heights have no slope."""

    kind = "exponential"
    near_power = 2.0
    scale, reach = 1.0, 36.0

    def profile(self, u: np.ndarray) -> np.ndarray:
        """C / Sq^2 : (as u) [-]."""
        return np.exp(-u)

    def transform(self, k: np.ndarray) -> np.ndarray:
        """Spectrum of the profile : (as k) [-]."""
        return 2 * math.pi * (1 + k**2) ** -1.5
