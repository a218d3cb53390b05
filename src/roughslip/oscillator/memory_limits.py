"""Steady sliding with a memory of the contact: growth of small motions, and the stiffness below which it is unstable.

Let alpha = N dmu/d|v| + d at constant age, with the damper d, and r = v0 / D_c. Motions exp(lambda t) about steady
sliding, after which psi follows at the rate r, have

    (m lambda^2 + alpha lambda + k) (lambda + r) = kappa lambda,    kappa = N b v_c / ((v0 + v_c) D_c).

By Routh and Hurwitz they grow for any k where alpha <= 0 < kappa, and else below

    k_c = (kappa - alpha r) (1 + m r / alpha),    there with    omega^2 = k_c r / (m r + alpha).
"""

from __future__ import annotations

import math

import numpy as np

from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.memory_law import MemoryLaw, direct_slope
from roughslip.oscillator.slip_orbit import check_free
from roughslip.validation import gate


def _alpha_r_kappa(oscillator: Oscillator, law: MemoryLaw) -> tuple[float, float, float]:
    """alpha [kg/s], r [1/s], kappa [N/m]."""
    check_free(oscillator)
    v0, load, p = oscillator.belt_velocity_m_per_s, oscillator.normal_force_n, law.parameters()
    alpha = load * float(direct_slope(v0, p)) + oscillator.damper_kg_per_s
    return alpha, v0 / p.length, load * p.ageing * p.cutoff / ((v0 + p.cutoff) * p.length)


@gate
def growth_rates(oscillator: Oscillator, law: MemoryLaw) -> np.ndarray:
    """(3,) [1/s] lambda of small motions about steady sliding, that which grows fastest first.

    Raises ParameterError with excitation or a belt at rest.
    """
    alpha, r, kappa = _alpha_r_kappa(oscillator, law)
    m, k, unit = oscillator.mass_kg, oscillator.stiffness_n_per_m, oscillator.natural_frequency_rad_per_s
    roots = unit * np.roots([1.0, (r + alpha / m) / unit, (k + alpha * r - kappa) / k, r / unit])
    return roots[np.argsort(-roots.real, kind="stable")]


@gate
def critical_stiffness(oscillator: Oscillator, law: MemoryLaw) -> tuple[float, float]:
    """k_c [N/m], the stiffness below which steady sliding is unstable, and omega [rad/s] there; mass and damper held.

    0 and NaN where every spring holds it, infinite where none does. Raises ParameterError as `growth_rates`.

    Source: J. R. Rice & A. L. Ruina, J. Appl. Mech. 50 (1983) 343.
    """
    alpha, r, kappa = _alpha_r_kappa(oscillator, law)
    if alpha <= 0.0:
        return math.inf, math.inf
    k = (kappa - alpha * r) * (1.0 + oscillator.mass_kg * r / alpha)
    return (k, math.sqrt(k * r / (oscillator.mass_kg * r + alpha))) if k > 0.0 else (0.0, math.nan)
