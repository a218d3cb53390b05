"""Contact problems with known solutions: judges of the solvers. E* = 1 unless a modulus is given.

Johnson is K. L. Johnson, Contact Mechanics, Cambridge University Press, 1985.
"""

import math
from dataclasses import dataclass

import numpy as np

# Force of a square flat punch over pi E* penetration edge: the capacitance of the unit square over 4 pi eps_0,
# Read, J. Comput. Phys. 133 (1997) 1.
SQUARE_CAPACITANCE = 0.3667874


# A paraboloid r^2 / 2 pressed in by 1 has the contact radius 1 (Hertz; Johnson, section 4.2).
HERTZ_FORCE, HERTZ_PEAK = 4 / 3, 2 / math.pi


def hertz_pressure(r: np.ndarray) -> np.ndarray:
    return HERTZ_PEAK * np.sqrt(np.maximum(1 - r**2, 0.0))


@dataclass(frozen=True)
class SineWave:
    """Heights D cos(2 pi x / l) under a share s of the pressure p* = pi E* D / l at which contact is full.

    amplitude : D; wavelength : l. Westergaard, J. Appl. Mech. 6 (1939) 49; Johnson, section 13.2.
    """

    amplitude: float
    wavelength: float
    load: float
    modulus: float = 1.0

    @property
    def full_pressure(self) -> float:
        return math.pi * self.modulus * self.amplitude / self.wavelength

    @property
    def mean_pressure(self) -> float:
        return self.load * self.full_pressure

    @property
    def area_fraction(self) -> float:
        return 2 / math.pi * math.asin(math.sqrt(self.load))

    @property
    def plane(self) -> float:
        """Height over the mean plane of the loaded surface, D (1 - s + s ln s)."""
        return self.amplitude * (1 - self.load + self.load * math.log(self.load))

    def heights(self, x: np.ndarray) -> np.ndarray:
        return self.amplitude * np.cos(2 * np.pi * x / self.wavelength)

    def pressure(self, x: np.ndarray) -> np.ndarray:
        """2 p* cos(pi x / l) sqrt(s - sin^2(pi x / l)) at positions x from a crest."""
        phase = np.pi * x / self.wavelength
        inside = np.maximum(self.load - np.sin(phase) ** 2, 0.0)
        return 2 * self.full_pressure * np.abs(np.cos(phase)) * np.sqrt(inside)


def light_area(load: float) -> float:
    """Area of D cos(2 pi x / l) cos(2 pi y / l) under a share of p* = sqrt(2) pi E* D / l, as it goes to 0.

    Every crest is a sphere of radius l^2 / (4 pi^2 D). Johnson, Greenwood and Higginson, Int. J. Mech. Sci. 27 (1985)
    383.
    """
    return math.pi * (3 * load / (8 * math.pi)) ** (2 / 3)


def open_area(load: float) -> float:
    """What is not in contact as the share goes to 1: every trough is a penny-shaped crack that closes."""
    return 3 / (2 * math.pi) * (1 - load)
