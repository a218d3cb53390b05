"""A friction law with a memory: contacts age at rest, and a distance of slip renews them (rate and state friction).

    mu = mu_D(|v|) + a ln((|v| + v_r) / v*) + b (psi - psi*),    d psi / dt = ((|v| + v_c) exp(-psi) - |v|) / D_c,

where psi = ln(1 + theta v_c / D_c) with the age theta of the contacts, d theta / dt = 1 - |v| theta / D_c. Steady
sliding at v* has psi* = ln(1 + v_c / v*), so that mu_D(v*) is its friction, but for v_r.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.errors import ParameterError
from roughslip.oscillator.laws import FrictionLaw, friction, friction_slope
from roughslip.validation import gate, not_negative, positive

NO_POLE = 0.5  # of v_r: steps that end at the belt try speeds below 0, and friction is constant from there down
SLOWEST = 1e-300  # [m/s] in place of 0, at which steady friction has no bound


class MemoryParameters(NamedTuple):
    """Parameters of the curve mu_D, a, b, D_c [m], v*, v_c and v_r [m/s], and psi*."""

    curve: Any
    direct: float
    ageing: float
    length: float
    reference: float
    cutoff: float
    rest: float
    level: float


@gate
@dataclass(frozen=True)
class MemoryLaw(FrictionLaw, parameters=MemoryParameters):
    """Rate and state friction with the ageing law, added to a mean curve; `mu` and `slope` are of steady sliding.

    curve : mu_D with the level of friction; its limit of stick is its value at rest
    direct_effect : [-] a, rise of friction at once with ln(speed); usually 0.003 to 0.02
    ageing_effect : [-] b, rise with ln(age); usually 0.003 to 0.03
    memory_length_m : [m] D_c, slip that renews the contacts; usually 0.3 to 20 µm
    reference_speed_m_per_s : [m/s] v*, at which mu_D was measured: both effects add nothing to steady sliding there
    cutoff_speed_m_per_s : [m/s] v_c, above which contacts have no time to age; usually 1 mm/s to 1 m/s
    rest_speed_m_per_s : [m/s] v_r, below which the direct effect ends; usually 1 nm/s to 1 µm/s

    Raises ParameterError for a parameter out of range, a curve with a limit of stick of its own, or negative friction.

    Sources: J. H. Dieterich, J. Geophys. Res. 84 (1979) 2161; A. Ruina, J. Geophys. Res. 88 (1983) 10359; sizes by C.
    Marone, Annu. Rev. Earth Planet. Sci. 26 (1998) 643, and T. Baumberger & C. Caroli, Adv. Phys. 55 (2006) 279.
    """

    curve: FrictionLaw
    direct_effect: float
    ageing_effect: float
    memory_length_m: float
    reference_speed_m_per_s: float
    cutoff_speed_m_per_s: float
    rest_speed_m_per_s: float

    def __post_init__(self) -> None:
        for name, value in list(vars(self).items())[1:]:
            (not_negative if name.endswith("effect") else positive)(f"MemoryLaw.{name}", value)
        if isinstance(self.curve, MemoryLaw) or self.curve.static > self.curve.parameters().rest:
            raise ParameterError("MemoryLaw.curve must have no static friction above slow slip: the age gives it")
        if not self.static_friction(0.0) > 0.0:
            raise ParameterError("MemoryLaw.rest_speed_m_per_s must be larger: friction of fresh contacts is negative")
        for name in ("fastest_known", "slowest_known"):
            object.__setattr__(self, name, getattr(self.curve, name))

    @property
    def static(self) -> float:  # type: ignore[override]
        """No number: raises ParameterError."""
        raise ParameterError("the limit of stick of a law with memory is no number: ask static_friction(hold_s)")

    @gate
    def static_friction(self, hold_s: float, age_s: float = 0.0) -> float:
        """The limit of stick after a stick : [s] that begins at an age : [s] of the contacts; linear in ln(hold_s)."""
        law, age = self.parameters(), not_negative("hold_s", hold_s) + not_negative("age_s", age_s)
        return max(float(friction_of(0.0, aged(0.0, age, law), law)), 0.0)

    @gate
    def times(self, factor: float) -> Self:
        """The curve and both effects are this factor larger."""
        a, b = factor * self.direct_effect, factor * self.ageing_effect
        return replace(self, curve=self.curve.times(factor), direct_effect=a, ageing_effect=b)

    def parameters(self) -> MemoryParameters:
        effects, length = (self.direct_effect, self.ageing_effect), self.memory_length_m
        speeds = self.reference_speed_m_per_s, self.cutoff_speed_m_per_s, self.rest_speed_m_per_s
        level = math.log1p(self.cutoff_speed_m_per_s / self.reference_speed_m_per_s)
        return MemoryParameters(self.curve.parameters(), *map(float, (*effects, length, *speeds, level)))

    @staticmethod
    def friction(speed: float, law: MemoryParameters) -> float:
        return friction_of(speed, steady_psi(speed, law), law)

    @staticmethod
    def slope_of_friction(speed: float, law: MemoryParameters) -> float:
        slow = max(speed, SLOWEST)
        return direct_slope(speed, law) - law.ageing * law.cutoff / (slow * (slow + law.cutoff))


@compiled()
def friction_of(speed: float, psi: float, law: MemoryParameters) -> float:
    """mu at a speed [m/s] and psi."""
    speed = max(speed, -NO_POLE * law.rest)  # below it nothing is meant: a step that ends there is tried shorter
    rate = (speed + law.rest) / law.reference
    return friction(speed, law.curve) + law.direct * np.log(rate) + law.ageing * (psi - law.level)


@compiled()
def direct_slope(speed: float, law: MemoryParameters) -> float:
    """d mu / d|v| [s/m] at constant age."""
    return friction_slope(speed, law.curve) + law.direct / max(speed + law.rest, NO_POLE * law.rest)


@compiled()
def steady_psi(speed: float, law: MemoryParameters) -> float:
    """Psi of steady sliding at a speed [m/s]."""
    return np.log1p(law.cutoff / max(speed, SLOWEST))


@compiled()
def aged(psi: float, time: float, law: MemoryParameters) -> float:
    """Psi after a time [s] of stick."""
    return psi + np.log1p(time * law.cutoff / law.length * np.exp(-psi))
