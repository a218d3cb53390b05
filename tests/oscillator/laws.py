"""A law of friction with a published cycle."""

from dataclasses import dataclass

import numpy as np

from roughslip.oscillator.law import Cubics


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

    def compiled(self):
        """A table of one row, which goes on for ever."""
        first, second, third = -(self.first + 3 * self.third), 3 * self.third, -self.third
        row = [0.0, self.static, first / self.belt, second / self.belt**2, third / self.belt**3]
        return Cubics(self.static, self.static, 0.0, np.array([row]))
