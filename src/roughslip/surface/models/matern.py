"""The Matern covariance 2^(1-nu) / Gamma(nu) u^nu K_nu(u)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.special import gammaln, kve

from roughslip.surface.covariance import FittedShape, IsotropicCovariance

# At the largest it is within 0.01 of the Gaussian, and no Bessel function overflows.
SHAPES = {"smoothness": (0.05, 20.0)}


@dataclass(frozen=True)
class Matern(IsotropicCovariance):
    """2^(1-nu) / Gamma(nu) u^nu K_nu(u), exponential at nu = 1/2 and Gaussian for nu to infinity.

    smoothness : nu [-]
    """

    kind = "matern"
    shapes = SHAPES
    fitted_shape = FittedShape("smoothness", 1.0, logarithmic=True)

    smoothness: float = field(kw_only=True)

    def profile(self, u: np.ndarray) -> np.ndarray:
        """C / Sq^2 : (as u) [-] through logarithms: the factors overflow long before their product."""
        nu = self.smoothness
        positive = np.maximum(u, 1e-12)  # where the product is 1 within rounding unless nu is near zero
        log = (1 - nu) * math.log(2) - gammaln(nu) + nu * np.log(positive) + np.log(kve(nu, positive)) - positive
        return np.where(u > 0, np.exp(log), 1.0)

    def transform(self, k: np.ndarray) -> np.ndarray:
        """Spectrum of the profile : (as k) [-]."""
        return 4 * math.pi * self.smoothness * (1 + k**2) ** (-self.smoothness - 1)
