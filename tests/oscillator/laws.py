"""Laws of friction with closed-form or published cycles, in the words of StribeckLaw."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Coulomb:
    """A kinetic coefficient whatever the speed, and a static one."""

    kinetic: float
    static: float

    def mu(self, velocity):
        return np.float64(self.kinetic)

    def slope(self, velocity):
        return np.float64(0.0)


@dataclass(frozen=True)
class Cubic:
    """mu = middle + first t + third t^3 with t = 1 - |v| / v0, odd about the belt's velocity v0."""

    middle: float
    first: float
    third: float
    belt: float

    @property
    def static(self):
        return self.middle + self.first + self.third

    def mu(self, velocity):
        t = 1.0 - np.abs(velocity) / self.belt
        return self.middle + self.first * t + self.third * t**3

    def slope(self, velocity):
        t = 1.0 - np.abs(velocity) / self.belt
        return -(self.first + 3.0 * self.third * t**2) / self.belt
