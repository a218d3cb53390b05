"""Contact problems with known solutions, for the verification of solvers.

A rigid body meets an elastic half-space of plane-strain modulus E* = E / (1 - nu^2); friction and adhesion are absent.
Johnson below is K. L. Johnson, Contact Mechanics, Cambridge University Press, 1985.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from roughslip.errors import ParameterError
from roughslip.validation import gate, positive

# Force of a square flat punch over pi E* penetration edge: the capacitance of the unit square over 4 pi eps_0,
# Read, J. Comput. Phys. 133 (1997) 1.
SQUARE_CAPACITANCE = 0.3667874


@dataclass(frozen=True)
class _Problem:
    """Parameters of a problem, all positive and finite."""

    def __post_init__(self) -> None:
        for field in fields(self):
            positive(field.name, getattr(self, field.name))


@gate
@dataclass(frozen=True)
class HertzSphere(_Problem):
    """A sphere, taken as its paraboloid r^2 / (2 R), pressed on a half-space (Hertz; Johnson, section 4.2).

    radius_m : R
    penetration_m : d, approach of distant points
    plane_strain_modulus_pa : E*
    """

    radius_m: float
    penetration_m: float
    plane_strain_modulus_pa: float

    @classmethod
    @gate
    def under_force(cls, radius_m: float, force_n: float, plane_strain_modulus_pa: float) -> HertzSphere:
        """The sphere under a force F: d = (9 F^2 / (16 R E*^2))^(1/3)."""
        penetration = (0.75 * force_n / (plane_strain_modulus_pa * math.sqrt(radius_m))) ** (2 / 3)
        return cls(radius_m, penetration, plane_strain_modulus_pa)

    @classmethod
    @gate
    def at_yield(cls, radius_m: float, hardness_pa: float, plane_strain_modulus_pa: float) -> HertzSphere:
        """The sphere whose peak pressure just reaches a cap H: d = R (pi H / (2 E*))^2."""
        penetration = radius_m * (math.pi * hardness_pa / (2 * plane_strain_modulus_pa)) ** 2
        return cls(radius_m, penetration, plane_strain_modulus_pa)

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

    @property
    def elastic_energy_j(self) -> float:
        """U = 8/15 E* sqrt(R) d^(5/2), whose derivative by d is the force."""
        return 0.4 * self.force_n * self.penetration_m

    @gate
    def pressure_pa(self, r: np.ndarray) -> np.ndarray:
        """p0 sqrt(1 - (r/a)^2), at distances r [m] from the axis."""
        return self.peak_pressure_pa * np.sqrt(np.maximum(1 - (r / self.contact_radius_m) ** 2, 0.0))


@gate
@dataclass(frozen=True)
class CircularPunch(_Problem):
    """A flat circular punch pressed on a half-space (Boussinesq; Johnson, section 3.4).

    radius_m : a
    penetration_m : d
    plane_strain_modulus_pa : E*
    """

    radius_m: float
    penetration_m: float
    plane_strain_modulus_pa: float

    @property
    def force_n(self) -> float:
        """F = 2 E* a d."""
        return 2 * self.plane_strain_modulus_pa * self.radius_m * self.penetration_m

    @gate
    def pressure_pa(self, r: np.ndarray) -> np.ndarray:
        """F / (2 pi a sqrt(a^2 - r^2)) at distances r < a [m] from the axis, unbounded at the edge, zero outside."""
        inside = r < self.radius_m
        root = np.sqrt(np.where(inside, self.radius_m**2 - r**2, 1.0))
        return np.where(inside, self.force_n / (2 * math.pi * self.radius_m) / root, 0.0)


@gate
def square_punch_force_n(edge_m: float, penetration_m: float, plane_strain_modulus_pa: float) -> float:
    """Force [N] of a flat square punch, pi C E* penetration edge with the capacitance C of the square.

    The ratio of pressure to penetration under a flat punch is that of charge to potential on a conducting plate.
    """
    return math.pi * SQUARE_CAPACITANCE * plane_strain_modulus_pa * penetration_m * edge_m


@gate
@dataclass(frozen=True)
class SineWave(_Problem):
    """Heights D cos(2 pi x / l) against a plane (Westergaard, J. Appl. Mech. 6 (1939) 49; Johnson, section 13.2).

    amplitude_m : D, half the height from trough to crest
    wavelength_m : l
    plane_strain_modulus_pa : E*
    mean_pressure_pa : p, at most p* = pi E* D / l, at which contact is full

    With s = p / p*, contact covers |x| < b, sin^2(pi b / l) = s. Raises ParameterError for p > p*.
    """

    amplitude_m: float
    wavelength_m: float
    plane_strain_modulus_pa: float
    mean_pressure_pa: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.mean_pressure_pa > self.full_contact_pressure_pa:
            raise ParameterError(
                f"a mean pressure of {self.mean_pressure_pa} Pa is beyond full contact at"
                f" {self.full_contact_pressure_pa} Pa"
            )

    @property
    def full_contact_pressure_pa(self) -> float:
        """p* = pi E* D / l."""
        return math.pi * self.plane_strain_modulus_pa * self.amplitude_m / self.wavelength_m

    @property
    def load(self) -> float:
        """s = p / p*."""
        return self.mean_pressure_pa / self.full_contact_pressure_pa

    @property
    def area_fraction(self) -> float:
        """2 b / l = (2 / pi) arcsin sqrt(s)."""
        return 2 / math.pi * math.asin(math.sqrt(self.load))

    @property
    def plane_m(self) -> float:
        """Height of the plane over the mean plane of the loaded surface, D (1 - s + s ln s).

        In full contact it stands at 0. A further load dp moves it like a row of flat punches::

            d(plane) = (2 l / (pi E*)) ln sin(pi b / l) dp

        This follows from the logarithmic capacity of an arc.
        """
        return self.amplitude_m * (1 - self.load + self.load * math.log(self.load))

    @property
    def elastic_energy_j_m2(self) -> float:
        """Energy per nominal area, the integral of p d(-plane): p* D (s^2 / 4 - s^2 ln(s) / 2) [J/m^2]."""
        shape = self.load**2 * (0.25 - 0.5 * math.log(self.load))
        return self.full_contact_pressure_pa * self.amplitude_m * shape

    @gate
    def pressure_pa(self, x: np.ndarray) -> np.ndarray:
        """2 p* cos(pi x / l) sqrt(s - sin^2(pi x / l)) at positions x [m] from a crest."""
        phase = np.pi * x / self.wavelength_m
        inside = np.maximum(self.load - np.sin(phase) ** 2, 0.0)
        return 2 * self.full_contact_pressure_pa * np.abs(np.cos(phase)) * np.sqrt(inside)


@gate
@dataclass(frozen=True)
class CrossedWaves(_Problem):
    """Heights D cos(2 pi x / l) cos(2 pi y / l) against a plane: limits of light and of nearly full contact.

    amplitude_m : D, half the height from trough to crest
    wavelength_m : l, edge of the square cell, which holds two crests and two troughs
    plane_strain_modulus_pa : E*

    Turned by 45 degrees it is D/2 (cos(2 pi x / l') + cos(2 pi y / l')) with l' = l / sqrt(2), one crest a cell.
    Source: Johnson, Greenwood and Higginson, Int. J. Mech. Sci. 27 (1985) 383.
    """

    amplitude_m: float
    wavelength_m: float
    plane_strain_modulus_pa: float

    @property
    def full_contact_pressure_pa(self) -> float:
        """p* = sqrt(2) pi E* D / l, since the wave number is sqrt(2) 2 pi / l."""
        return math.sqrt(2) * math.pi * self.plane_strain_modulus_pa * self.amplitude_m / self.wavelength_m

    @gate
    def light_area_fraction(self, mean_pressure_pa: float) -> float:
        """A / l^2 = pi (3 p / (8 pi p*))^(2/3) as p goes to 0: every crest a sphere of radius l^2 / (4 pi^2 D)."""
        return math.pi * (3 * mean_pressure_pa / (8 * math.pi * self.full_contact_pressure_pa)) ** (2 / 3)

    @gate
    def open_fraction(self, mean_pressure_pa: float) -> float:
        """1 - A / l^2 = 3 / (2 pi) (1 - p / p*) as p goes to p*: every trough a penny-shaped crack that closes."""
        return 3 / (2 * math.pi) * (1 - mean_pressure_pa / self.full_contact_pressure_pa)
