"""Coulomb's law: one coefficient in stick and one in slip."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from roughslip.errors import ParameterError
from roughslip.oscillator.base_law import FrictionLaw, check_static
from roughslip.oscillator.friction_laws.stribeck import StribeckParameters
from roughslip.validation import gate


@gate
@dataclass(frozen=True)
class CoulombLaw(FrictionLaw, name="coulomb"):
    """One value at rest and one in slip: eq. (13) without decay, so compiled code needs no formula for it.

    kinetic : [-] mu_D at every speed
    static : [-] limit of stick, at least kinetic
    """

    kinetic: float
    static: float

    def __post_init__(self) -> None:
        self.check_not_negative("kinetic", "static")
        if self.static < self.kinetic:
            raise ParameterError(f"CoulombLaw.static must be at least kinetic = {self.kinetic}, not {self.static}")

    @classmethod
    def from_scene(cls, section: Any, mean: float) -> CoulombLaw:
        """The mean friction coefficient in slip."""
        check_static(section.static_friction, mean, "stick holds less than slip")
        return cls(kinetic=mean, static=section.static_friction)

    @gate
    def times(self, factor: float) -> CoulombLaw:
        """The limit of stick stays."""
        check_static(self.static, factor * self.kinetic, "stick holds less than slip")
        return replace(self, kinetic=factor * self.kinetic)

    @classmethod
    def example(cls, generator: np.random.Generator, static: float, speed: float) -> CoulombLaw:
        """Any kinetic coefficient up to the static one."""
        return cls(static * generator.random(), static)

    def parameters(self) -> StribeckParameters:
        kinetic = float(self.kinetic)
        return StribeckParameters(float(self.static), kinetic, kinetic, 0.0, 0.0, 0.0)
