"""Elastic constants of the rough half-space."""

from __future__ import annotations

import math
from dataclasses import dataclass

from roughslip.errors import ParameterError, real


@dataclass(frozen=True)
class Material:
    """An isotropic, linearly elastic material.

    young_modulus_pa : Young's modulus E [Pa], positive
    poisson_ratio : Poisson's ratio nu, in (-1, 0.5]

    Raises ParameterError outside these ranges.
    """

    young_modulus_pa: float
    poisson_ratio: float

    def __post_init__(self) -> None:
        real("Young's modulus", self.young_modulus_pa)
        real("Poisson's ratio", self.poisson_ratio)
        if not (math.isfinite(self.young_modulus_pa) and self.young_modulus_pa > 0):
            raise ParameterError(f"Young's modulus must be positive and finite, not {self.young_modulus_pa} Pa")
        if not -1 < self.poisson_ratio <= 0.5:
            raise ParameterError(f"Poisson's ratio must lie in (-1, 0.5], not {self.poisson_ratio}")

    @property
    def plane_strain_modulus_pa(self) -> float:
        """Plane-strain modulus E* = E / (1 - nu^2) [Pa] of contact with a rigid body."""
        return self.young_modulus_pa / (1 - self.poisson_ratio**2)
