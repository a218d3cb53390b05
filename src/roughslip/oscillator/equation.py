"""The mass on a moving belt: its parameters, the scaled equation of motion, and the state in slip.

With tau = omega t, X = x and X' = dx/dtau, both in metres,

    X'' + 2 D X' + X = F mu sign(v_rel) + q cos(r tau),    v_rel = omega (V - X').

The stochastic part mu_S of the path is added, mu = mu_D + mu_S, or multiplies, mu = mu_D (1 + mu_S), which is how the
area over the force of a rough pad enters.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from roughslip.compilation.cache import compiled
from roughslip.oscillator.laws import CONTRACTED, FrictionLaw, friction, friction_slope
from roughslip.oscillator.path import Piece, mu_s_at, mu_s_slope
from roughslip.validation import gate, not_negative, positive


@gate
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
        above_zero = ("mass_kg", "natural_frequency_rad_per_s", "normal_force_n")
        for name, value in vars(self).items():
            (positive if name in above_zero else not_negative)(f"Oscillator.{name}", value)

    @property
    def stiffness_n_per_m(self) -> float:
        """c = m omega^2 [N/m]."""
        return self.mass_kg * self.natural_frequency_rad_per_s**2

    @property
    def damper_kg_per_s(self) -> float:
        """d_k = 2 D m omega [kg/s]."""
        return 2.0 * self.damping_ratio * self.mass_kg * self.natural_frequency_rad_per_s

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


SCATTERS = ("additive", "multiplicative")


class Coefficients(NamedTuple):
    """Oscillator and law for compiled functions, in the symbols of the scaled equation.

    excited : True with an excitation, else None: a type of its own, so that the other code is left out
    multiplies : True where mu_S multiplies mu_D, else None, in the same way
    law : parameters of the friction law
    """

    F: float
    V: float
    D: float
    omega: float
    q: float
    r: float
    excited: bool | None
    multiplies: bool | None
    law: Any


def coefficients(oscillator: Oscillator, law: FrictionLaw, scatter: str = "additive") -> Coefficients:
    """The coefficients of the scaled equation of motion.

    scatter : additive, mu = mu_D + mu_S; or multiplicative, mu = mu_D (1 + mu_S)
    """
    return Coefficients(
        F=float(oscillator.F),
        V=float(oscillator.V),
        D=float(oscillator.damping_ratio),
        omega=float(oscillator.natural_frequency_rad_per_s),
        q=float(oscillator.q),
        r=float(oscillator.r),
        excited=True if oscillator.q > 0.0 else None,
        multiplies=True if scatter == "multiplicative" else None,
        law=law.parameters(),
    )


class State(NamedTuple):
    """tau [-], X, X', slipped distance s, X'' and X''' [m]."""

    tau: float
    x: float
    u: float
    s: float
    a: float
    j: float


@compiled(error_model="numpy")
def gain(speed: float, p: Coefficients) -> float:
    """d mu / d mu_S at a speed |v_rel| [m/s]."""
    return friction(speed, p.law) if p.multiplies is not None else 1.0


@compiled(error_model="numpy", fastmath=CONTRACTED)
def scattered(mean: float, mu_s: float, p: Coefficients) -> float:
    """Friction mean + mu_S, or mean (1 + mu_S), never below zero."""
    return max(mean * (1.0 + mu_s) if p.multiplies is not None else mean + mu_s, 0.0)


@compiled(error_model="numpy", fastmath=CONTRACTED)
def total_friction(speed: float, mu_s: float, p: Coefficients) -> float:
    """Friction with its scatter at a speed |v_rel| [m/s]."""
    return scattered(friction(speed, p.law), mu_s, p)


@compiled(error_model="numpy", fastmath=CONTRACTED)
def acceleration(tau: float, x: float, u: float, sigma: float, mu_s: float, p: Coefficients) -> float:
    """X'' [m] in slip of sign sigma, continued smoothly through v_rel = 0."""
    drive = p.q * math.cos(p.r * tau) if p.excited is not None else 0.0
    mu = total_friction(sigma * p.omega * (p.V - u), mu_s, p)
    return sigma * p.F * mu - (2.0 * p.D * u + x - drive)


@compiled(error_model="numpy", fastmath=CONTRACTED)
def jerk(tau: float, u: float, s: float, a: float, sigma: float, piece: Piece, p: Coefficients) -> float:
    """X''' [m] in slip of sign sigma, continued in the same way."""
    speed, along, mu_s = sigma * p.omega * (p.V - u), sigma * (p.V - u), mu_s_at(piece, s)
    slope = -friction_slope(speed, p.law) * sigma * p.omega * a
    mu_rate = mu_s_slope(piece, s) * along * gain(speed, p)
    mu_rate += slope * (1.0 + mu_s) if p.multiplies is not None else slope
    if total_friction(speed, mu_s, p) == 0.0:
        mu_rate = 0.0
    drive = p.q * p.r * math.sin(p.r * tau) if p.excited is not None else 0.0
    return sigma * p.F * mu_rate - 2.0 * p.D * a - u - drive


@compiled()
def slip_state(tau: float, x: float, u: float, s: float, sigma: float, piece: Piece, p: Coefficients) -> State:
    """The state in slip with its acceleration and jerk."""
    a = acceleration(tau, x, u, sigma, mu_s_at(piece, s), p)
    return State(tau, x, u, s, a, jerk(tau, u, s, a, sigma, piece, p))


@compiled()
def with_jerk(y: State, sigma: float, piece: Piece, p: Coefficients) -> State:
    """A state in slip whose acceleration is known, with its jerk."""
    return State(y.tau, y.x, y.u, y.s, y.a, jerk(y.tau, y.u, y.s, y.a, sigma, piece, p))
