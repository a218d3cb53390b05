"""Contact of a sphere with an elastic half-space in closed form, next to which solves are shown."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from roughslip.validation import gate, positive


@gate
@dataclass(frozen=True)
class HertzSphere:
    """A sphere, taken as its paraboloid r^2 / (2 R), pressed on a half-space (Hertz; K. L. Johnson, Contact
    Mechanics, 1985, section 4.2).

    radius_m : R
    penetration_m : d, approach of distant points
    plane_strain_modulus_pa : E*
    """

    radius_m: float
    penetration_m: float
    plane_strain_modulus_pa: float

    def __post_init__(self) -> None:
        for name in ("radius_m", "penetration_m", "plane_strain_modulus_pa"):
            positive(name, getattr(self, name))

    @property
    def contact_radius_m(self) -> float:
        """a = sqrt(R d)."""
        return math.sqrt(self.radius_m * self.penetration_m)

    @property
    def force_n(self) -> float:
        """F = 4/3 E* sqrt(R) d^(3/2)."""
        return 4 / 3 * self.plane_strain_modulus_pa * self.contact_radius_m * self.penetration_m

    @property
    def peak_pressure_pa(self) -> float:
        """p0 = 2 E* a / (pi R)."""
        return 2 / math.pi * self.plane_strain_modulus_pa * self.contact_radius_m / self.radius_m

    @gate
    def pressure_pa(self, r: np.ndarray) -> np.ndarray:
        """p0 sqrt(1 - (r/a)^2), at distances r [m] from the axis."""
        return self.peak_pressure_pa * np.sqrt(np.maximum(1 - (r / self.contact_radius_m) ** 2, 0.0))
