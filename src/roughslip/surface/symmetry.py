"""Fields on a mesh in classes that its covariance matrix does not mix: even and odd under reflections."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from roughslip.grid import Grid
from roughslip.surface.covariance import StationaryCovariance

HALF = math.sqrt(0.5)

Operator = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class SymmetryClass:
    """size : of its vectors; fold : of a field (nx, ny) to its part (size,); unfold : the transpose, an isometry."""

    size: int
    fold: Operator
    unfold: Operator


def symmetry_classes(covariance: StationaryCovariance, grid: Grid) -> list[SymmetryClass]:
    """Two classes of fields on the mesh, or four where C(-x, y) = C(x, y); together they are all fields."""
    nx, ny = grid.shape
    classes = []
    if covariance.mirror_symmetric:
        for sx, sy in product((1, -1), repeat=2):
            part = _folded_length(nx, sx), _folded_length(ny, sy)

            def fold(field: np.ndarray, sx: int = sx, sy: int = sy) -> np.ndarray:
                return _fold(_fold(field, sx).T, sy).T.ravel()

            def unfold(vector: np.ndarray, sx: int = sx, sy: int = sy, part: tuple[int, int] = part) -> np.ndarray:
                return _unfold(_unfold(vector.reshape(part), nx, sx).T, ny, sy).T

            classes.append(SymmetryClass(math.prod(part), fold, unfold))
    else:
        for sign in (1, -1):

            def fold_centre(field: np.ndarray, sign: int = sign) -> np.ndarray:
                return _fold(field.ravel(), sign)

            def unfold_centre(vector: np.ndarray, sign: int = sign) -> np.ndarray:
                return _unfold(vector, grid.size, sign).reshape(grid.shape)

            classes.append(SymmetryClass(_folded_length(grid.size, sign), fold_centre, unfold_centre))
    return [entry for entry in classes if entry.size]


def _folded_length(nodes: int, sign: int) -> int:
    return (nodes + (sign > 0)) // 2


def _fold(field: np.ndarray, sign: int) -> np.ndarray:
    """Even (sign 1) or odd (-1) part along the first axis, on the first half of its nodes and the middle one."""
    half = len(field) // 2
    part = HALF * (field[:half] + sign * field[::-1][:half])
    return np.concatenate((part, field[half : half + 1])) if len(field) % 2 and sign > 0 else part


def _unfold(part: np.ndarray, nodes: int, sign: int) -> np.ndarray:
    half = nodes // 2
    field = np.zeros((nodes, *part.shape[1:]))
    field[:half] = HALF * part[:half]
    field[nodes - half :] = sign * field[:half][::-1]
    if nodes % 2 and sign > 0:
        field[half] = part[half]
    return field
