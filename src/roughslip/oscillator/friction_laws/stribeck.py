"""Stribeck's curve of eq. (13)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from roughslip.oscillator.base_law import FrictionLaw, check_static
from roughslip.validation import gate

NO_POLE = 0.5  # steps that end at the belt try speeds below 0, down to which the quotient may have its pole


class StribeckParameters(NamedTuple):
    """mu_D(v) = fit / (1 + decay v) + rest - fit + quadratic v^2; static, rest and least as in `FrictionLaw`."""

    static: float
    rest: float
    least: float
    fit: float
    decay: float
    quadratic: float


@gate
@dataclass(frozen=True)
class StribeckLaw(FrictionLaw, name="stribeck", parameters=StribeckParameters):
    """mu_D(v) = fit / (1 + decay |v|) + static - fit + quadratic v^2, eq. (13).

    fit : [-] part of the friction that decays with speed
    static : [-] coefficient at vanishing speed, and limit of stick
    decay_s_per_m : [s/m]
    quadratic_s2_per_m2 : [s^2/m^2]

    A friction coefficient is never negative: the motion uses max(mu_D + mu_S, 0), in slip and as the limit of stick.
    This matters with fit above static, or with a low stochastic part.
    """

    fit: float
    static: float = 0.4
    decay_s_per_m: float = 1.42
    quadratic_s2_per_m2: float = 0.01

    def __post_init__(self) -> None:
        self.check_not_negative("fit", "static", "decay_s_per_m", "quadratic_s2_per_m2")

    @classmethod
    def from_scene(cls, section: Any, mean: float) -> StribeckLaw:
        """Eq. (13) with the mean friction coefficient as mu_fit."""
        check_static(section.static_friction, mean, "eq. (13) turns negative at high speed")
        return cls(mean, section.static_friction, section.stribeck_decay_s_per_m, section.stribeck_quadratic_s2_per_m2)

    @gate
    def times(self, factor: float) -> StribeckLaw:
        """The limit of stick stays."""
        check_static(self.static, factor * self.fit, "eq. (13) turns negative at high speed")
        return replace(self, fit=factor * self.fit)

    @classmethod
    def example(cls, generator: np.random.Generator, static: float, speed: float) -> StribeckLaw:
        """Friction that decays within a tenth to ten of the speeds."""
        decay = 10.0 ** generator.uniform(-1.0, 1.0)
        fit = static * generator.random()
        return cls(fit, static, decay / speed, 10.0 ** generator.uniform(-4.0, -1.0) / speed**2)

    def parameters(self) -> StribeckParameters:
        rest, fit = float(self.static), float(self.fit)
        return StribeckParameters(
            rest, rest, rest - fit, fit, float(self.decay_s_per_m), float(self.quadratic_s2_per_m2)
        )

    @staticmethod
    def friction(speed: Any, law: StribeckParameters) -> Any:
        return law.fit / np.maximum(1.0 + law.decay * speed, NO_POLE) + (
            law.rest - law.fit + law.quadratic * speed * speed
        )

    @staticmethod
    def slope_of_friction(speed: Any, law: StribeckParameters) -> Any:
        return -law.fit * law.decay / (1.0 + law.decay * speed) ** 2 + 2.0 * law.quadratic * speed

    @staticmethod
    def curvature_of_friction(speed: Any, law: StribeckParameters) -> Any:
        return 2.0 * (law.fit * law.decay * law.decay / (1.0 + law.decay * speed) ** 3 + law.quadratic)

    @staticmethod
    def excess_force(normal: Any, speed: Any, more: Any, held: Any, law: StribeckParameters) -> Any:
        """normal (mu_D + more) - held, with the quotient last, when everything else is known."""
        others = normal * (law.rest - law.fit + more + law.quadratic * (speed * speed)) - held
        return normal * law.fit / np.maximum(1.0 + law.decay * speed, NO_POLE) + others
