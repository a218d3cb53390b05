"""Friction against relative velocity: the Stribeck law of eq. (13) and its derivative."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba.extending import register_jitable

from roughslip.errors import ParameterError


@register_jitable
def stribeck(speed: Any, fit: float, static: float, decay: float, quadratic: float) -> Any:
    """mu_D at a speed |v_rel| >= 0; scalars and arrays, also inside compiled code."""
    return fit / (1.0 + decay * speed) + static - fit + quadratic * speed * speed


@register_jitable
def stribeck_slope(speed: Any, fit: float, decay: float, quadratic: float) -> Any:
    """d mu_D / d|v_rel| [s/m] at a speed |v_rel| >= 0."""
    return -fit * decay / (1.0 + decay * speed) ** 2 + 2.0 * quadratic * speed


@dataclass(frozen=True)
class StribeckLaw:
    """mu_D(v) = fit / (1 + decay |v|) + static - fit + quadratic v^2, eq. (13).

    fit : [-] part of the friction that decays with speed
    static : [-] coefficient at vanishing speed, and limit of stick
    decay_s_per_m : [s/m]
    quadratic_s2_per_m2 : [s^2/m^2]

    A friction coefficient is never negative: with fit above static, or with a low stochastic part, the motion uses
    max(mu_D + mu_S, 0), in slip and as the limit of stick alike.
    """

    fit: float
    static: float = 0.4
    decay_s_per_m: float = 1.42
    quadratic_s2_per_m2: float = 0.01

    def __post_init__(self) -> None:
        for name in ("fit", "static", "decay_s_per_m", "quadratic_s2_per_m2"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ParameterError(f"StribeckLaw.{name} must be finite and not negative, not {value}")

    def mu(self, velocity_m_per_s: float | np.ndarray) -> np.ndarray:
        """mu_D at a relative velocity [m/s] of either sign."""
        speed = np.abs(velocity_m_per_s)
        return stribeck(speed, self.fit, self.static, self.decay_s_per_m, self.quadratic_s2_per_m2)

    def slope(self, velocity_m_per_s: float | np.ndarray) -> np.ndarray:
        """d mu_D / d|v| [s/m] at a relative velocity [m/s] of either sign."""
        return stribeck_slope(np.abs(velocity_m_per_s), self.fit, self.decay_s_per_m, self.quadratic_s2_per_m2)
