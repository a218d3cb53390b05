"""How well pressures and gaps fulfil p >= 0, gap >= 0, p gap = 0."""

from __future__ import annotations

import numpy as np


def relative_residual(gap: np.ndarray, pressure: np.ndarray, diagonal: float, interference: np.ndarray) -> float:
    """||min(gap, B_00 p)|| / ||max(u_bar, 0)||, zero at the solution and only there.

    gap : (nx, ny) [m] B p - u_bar
    pressure : (nx, ny) [Pa]
    diagonal : B_00 [m/Pa]
    interference : (nx, ny) [m] u_bar, positive somewhere
    """
    unmet, reach = np.minimum(gap, diagonal * pressure), np.maximum(interference, 0.0)
    return float(np.sqrt(inner(unmet, unmet) / inner(reach, reach)))


def inner(a: np.ndarray, b: np.ndarray) -> float:
    """Sum of a b. Not by BLAS, whose sum depends on the number of threads."""
    return float((a * b).sum())
