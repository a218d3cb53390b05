"""How well pressures and gaps fulfil the conditions of contact."""

from __future__ import annotations

import math

import numpy as np


def relative_residual(
    gap: np.ndarray,
    pressure: np.ndarray,
    diagonal: float,
    interference: np.ndarray,
    hardness_pa: float = math.inf,
) -> float:
    """||B_00 p - clip(B_00 p - w, 0, B_00 H)|| / ||max(u_bar, 0)||, zero at the solution and only there.

    gap : (nx, ny) [m] w = B p - u_bar, to which plastic displacement has not been added
    pressure : (nx, ny) [Pa]
    diagonal : B_00 [m/Pa]
    interference : (nx, ny) [m] u_bar
    hardness_pa : H [Pa]; without it the numerator is ||min(w, B_00 p)||

    Relative to B_00 ||p|| where that is more: so in a periodic cell, whose mean pressure has no displacement. On a free
    half-space it never is, since u_bar = B p + u_plastic >= B_00 p in contact.
    """
    lift, reach = diagonal * pressure, np.maximum(interference, 0.0)
    unmet = lift - np.clip(lift - gap, 0.0, diagonal * hardness_pa)
    scale = float(max(reach.max(), lift.max()))  # so that squares neither overflow nor vanish
    norm = np.linalg.norm
    return float(norm(unmet / scale) / max(norm(reach / scale), norm(lift / scale)))
