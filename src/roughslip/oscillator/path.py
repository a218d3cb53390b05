"""The stochastic part of friction along the belt: mu_S(s) between equidistant nodes.

Cubic Hermite pieces with central differences as tangents (Catmull & Rom 1974), one-sided at the two ends: continuous
with its first derivative. No nodes at all stands for mu_S = 0 on a path without end.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit


class Piece(NamedTuple):
    """mu_S = c0 + c1 t + c2 t^2 + c3 t^3 with t = (s - left) / spacing, between left and right [m]."""

    c0: float
    c1: float
    c2: float
    c3: float
    left: float
    right: float
    spacing: float


@njit(cache=True)
def piece_at(nodes: np.ndarray, spacing: float, s: float) -> Piece:
    """The piece that holds s; the last one for any s beyond it (the caller watches the end of the path)."""
    if nodes.size == 0:
        return Piece(0.0, 0.0, 0.0, 0.0, 0.0, np.inf, 1.0)
    k = min(int(s / spacing), nodes.size - 2)
    start, end = nodes[k], nodes[k + 1]
    rise = end - start
    out = 0.5 * (end - nodes[k - 1]) if k > 0 else rise
    into = 0.5 * (nodes[k + 2] - start) if k + 2 < nodes.size else rise
    return Piece(
        start, out, 3.0 * rise - 2.0 * out - into, out + into - 2.0 * rise, k * spacing, (k + 1) * spacing, spacing
    )


@njit(cache=True)
def offset(piece: Piece, s: float) -> float:
    """mu_S at the slipped distance s [m]."""
    t = (s - piece.left) / piece.spacing
    return piece.c0 + t * (piece.c1 + t * (piece.c2 + t * piece.c3))


@njit(cache=True)
def offset_slope(piece: Piece, s: float) -> float:
    """d mu_S / ds [1/m]."""
    t = (s - piece.left) / piece.spacing
    return (piece.c1 + t * (2.0 * piece.c2 + t * 3.0 * piece.c3)) / piece.spacing
