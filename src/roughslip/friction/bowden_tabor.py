"""Friction coefficient of windows that slide along a strip, from their contact area and normal force.

Bowden and Tabor, The Friction and Lubrication of Solids, 1950: junctions shear at the strength tau of the softer body,
so mu = tau A / N. As A / N of a vanishing contact grows without bound (Hertz: A / N ~ 1 / a), windows below a least
contact area have no mu; they are marked, never averaged.
"""

from __future__ import annotations

import numpy as np

from roughslip.errors import ParameterError, whole
from roughslip.validation import finite, gate, positive

Windows = tuple[np.ndarray, np.ndarray]  # mu and valid, or area and force, each (..., S, W)


@gate
def window_sums(column_sums: np.ndarray, window_nodes: int, stride_nodes: int) -> np.ndarray:
    """Sums over windows of `window_nodes` columns that start every `stride_nodes` columns.

    column_sums : (..., nx) a quantity summed across the strip, a column a node along it
    window_nodes, stride_nodes : length of a window and distance of two starts [columns]

    Returns (..., W) with W = (nx - window_nodes) // stride_nodes + 1.

    Differences of one running sum a strip. Both ends of a window share the roundings made before it, so the error is at
    most (window_nodes + 1) 2^-53 sum|column_sums| of the strip. Terms >= 0 give sums >= 0, and windows of zeros exactly
    0. A strip's result does not depend on the other strips.
    """
    columns = finite("column_sums", column_sums)
    nx = columns.shape[-1] if columns.ndim else 0
    if whole("a stride", stride_nodes) < 1 or not 1 <= whole("a window", window_nodes) <= nx:
        raise ParameterError(
            f"a window of {window_nodes} columns every {stride_nodes} does not fit a strip of {nx} columns: "
            "1 <= window <= strip and stride >= 1"
        )
    running = np.zeros((*columns.shape[:-1], nx + 1))
    np.cumsum(columns, axis=-1, out=running[..., 1:])
    start = np.arange(0, nx - window_nodes + 1, stride_nodes)
    return running[..., start + window_nodes] - running[..., start]


@gate
def friction_coefficient(
    area: np.ndarray, force: np.ndarray, shear_strength_pa: float, least_area_m2: float
) -> tuple[np.ndarray, np.ndarray]:
    """mu = tau A / N of every window with at least the least contact area.

    area : (...) [m^2] real area of contact of a window
    force : (...) [N] normal force of a window
    shear_strength_pa : [Pa] shear strength tau of the junctions
    least_area_m2 : [m^2] contact area, positive, below which a window has no mu

    Returns (mu, valid): mu (...) [-], 0 where a window has none, and valid (...) bool.
    Raises ParameterError where a contact carries no force: area and force then do not belong together.
    """
    force = finite("force", force)
    area = finite("area", area)
    if area.shape != force.shape:
        raise ParameterError(f"area {area.shape} and force {force.shape} must have one shape")
    if (area < 0.0).any() or (force < 0.0).any():
        raise ParameterError("contact area and normal force of a window must not be negative")
    positive("the shear strength", shear_strength_pa, "Pa")
    positive("the least contact area", least_area_m2, "m^2")
    valid = area >= least_area_m2
    if (force[valid] <= 0.0).any():
        raise ParameterError("a window in contact carries no normal force: area and force do not belong together")
    return shear_strength_pa * np.divide(area, force, out=np.zeros_like(area), where=valid), valid
