"""The mass on a moving belt: its parameters and their scaled form.

With tau = omega t, X = x and X' = dx/dtau, both in metres,

    X'' + 2 D X' + X = F mu sign(v_rel) + q cos(r tau),    v_rel = omega (V - X').
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from roughslip.errors import ParameterError, real
from roughslip.oscillator.law import FrictionLaw, SlidingLaw


@dataclass(frozen=True)
class Oscillator:
    """A mass on a belt, held by a spring and a damper, driven by Q cos(Omega t).

    mass_kg : [kg] m > 0
    natural_frequency_rad_per_s : [rad/s] omega > 0
    damping_ratio : [-] D = d_k / (2 m omega) >= 0
    belt_velocity_m_per_s : [m/s] v0 >= 0; 0 is a fixed base
    normal_force_n : [N] N > 0
    excitation_force_n : [N] Q >= 0
    excitation_frequency_rad_per_s : [rad/s] Omega >= 0
    """

    mass_kg: float
    natural_frequency_rad_per_s: float
    damping_ratio: float
    belt_velocity_m_per_s: float
    normal_force_n: float
    excitation_force_n: float = 0.0
    excitation_frequency_rad_per_s: float = 0.0

    def __post_init__(self) -> None:
        for name in ("mass_kg", "natural_frequency_rad_per_s", "normal_force_n"):
            value = real(f"Oscillator.{name}", getattr(self, name))
            if not (math.isfinite(value) and value > 0.0):
                raise ParameterError(f"Oscillator.{name} must be finite and positive, not {value}")
        for name in (
            *("damping_ratio", "belt_velocity_m_per_s", "excitation_force_n", "excitation_frequency_rad_per_s"),
        ):
            value = real(f"Oscillator.{name}", getattr(self, name))
            if not (math.isfinite(value) and value >= 0.0):
                raise ParameterError(f"Oscillator.{name} must be finite and not negative, not {value}")

    @property
    def stiffness_n_per_m(self) -> float:
        """c = m omega^2 [N/m]."""
        return self.mass_kg * self.natural_frequency_rad_per_s**2

    @property
    def F(self) -> float:
        """N / c [m]: the deflection under the normal force."""
        return self.normal_force_n / self.stiffness_n_per_m

    @property
    def V(self) -> float:
        """v0 / omega [m]: the scaled velocity of the belt."""
        return self.belt_velocity_m_per_s / self.natural_frequency_rad_per_s

    @property
    def q(self) -> float:
        """Q / c [m]: the deflection under the excitation."""
        return self.excitation_force_n / self.stiffness_n_per_m

    @property
    def r(self) -> float:
        """Omega / omega [-]."""
        return self.excitation_frequency_rad_per_s / self.natural_frequency_rad_per_s


class Coefficients(NamedTuple):
    """Oscillator and law as the compiled functions read them, in the symbols of the scaled equation.

    advance : [m or s] by which the coordinate of the friction path grows in a unit of tau; 0 where it is the slipped
        distance
    """

    F: float
    V: float
    D: float
    omega: float
    q: float
    r: float
    advance: float
    law: SlidingLaw


def coefficients(oscillator: Oscillator, law: FrictionLaw, friction_follows: str = "slip") -> Coefficients:
    """The coefficients of the scaled equation of motion.

    friction_follows : what mu_S is a function of: slip, the slipped distance [m]; belt, the travel v0 t of the belt
        [m]; time [s]

    Raises ParameterError for another word, and for a belt at rest that friction is to follow.
    """
    advances = {"slip": 0.0, "belt": oscillator.V, "time": 1.0 / oscillator.natural_frequency_rad_per_s}
    if friction_follows not in advances:
        raise ParameterError(f"friction follows one of {', '.join(advances)}, not {friction_follows!r}")
    if friction_follows == "belt" and oscillator.V == 0.0:
        raise ParameterError("friction cannot follow a belt at rest: let it follow slip or time")
    return Coefficients(
        F=float(oscillator.F),
        V=float(oscillator.V),
        D=float(oscillator.damping_ratio),
        omega=float(oscillator.natural_frequency_rad_per_s),
        q=float(oscillator.q),
        r=float(oscillator.r),
        advance=float(advances[friction_follows]),
        law=law.compiled(),
    )
