"""How well pressures and gaps fulfil the conditions of contact."""

from __future__ import annotations

import math

import numpy as np

from roughslip.compilation import compiled


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
    return math.sqrt(_square_ratio(gap, pressure, diagonal, interference, hardness_pa))


@compiled(error_model="numpy")
def _square_ratio(
    gap: np.ndarray, pressure: np.ndarray, diagonal: float, interference: np.ndarray, hardness: float
) -> float:
    nx, ny = pressure.shape
    largest = 0.0  # scaled by it, squares neither overflow nor vanish
    for i in range(nx):
        for j in range(ny):
            largest = max(largest, interference[i, j], diagonal * pressure[i, j])
    unmet, reach, lifts = np.zeros(ny), np.zeros(ny), np.zeros(ny)
    for i in range(nx):
        for j in range(ny):
            lift = diagonal * pressure[i, j]
            step = (lift - min(max(lift - gap[i, j], 0.0), diagonal * hardness)) / largest
            height = max(interference[i, j], 0.0) / largest
            unmet[j] += step * step
            reach[j] += height * height
            lifts[j] += (lift / largest) ** 2
    return unmet.sum() / max(reach.sum(), lifts.sum())
