"""Nodes at which stages keep the pressure: around the centre of the square, and on training columns of the strip."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from roughslip.grid import Grid
from roughslip.limits import TRAINING_SPACING
from roughslip.surface.model import SurfaceModel

APART = 0.5  # correlation lengths from the central nodes to the outer ones; of 0.5, 1 and 1.5 it has the least bias


class Nodes(NamedTuple):
    """Nodes of a mesh at which the pressure is kept, the centre first.

    x, y : (n,) their numbers
    distance2 : (n,) [-] squared distance from the centre of the mesh in correlation lengths, less that of the first
    """

    x: np.ndarray
    y: np.ndarray
    distance2: np.ndarray


def central_nodes(surface: SurfaceModel, grid: Grid) -> Nodes:
    """The centre, and on an even mesh the three nodes that are its mirror images."""
    return _nodes(surface, grid, [_central(n) for n in grid.shape])


def training_nodes(surface: SurfaceModel, grid: Grid) -> Nodes:
    """The central nodes, and such as lie half a correlation length from them where the mesh resolves that."""
    lines = []
    for n, cell, length in zip(grid.shape, (grid.dx, grid.dy), surface.lengths_m, strict=True):
        central, far = _central(n), round(APART * length / cell)
        outer = [central[0] + far, central[-1] - far]
        lines.append(central + outer if far >= 2 and outer[1] >= 1 else central)
    return _nodes(surface, grid, lines)


def training_columns(middle: slice) -> np.ndarray:
    """Columns of a strip whose pressure and gap train the expansion, all of them on its stationary middle."""
    return np.arange(middle.start + TRAINING_SPACING // 2, middle.stop, TRAINING_SPACING)


def _central(n: int) -> list[int]:
    return sorted({n // 2, (n - 1) // 2}, reverse=True)


def _nodes(surface: SurfaceModel, grid: Grid, lines: list[list[int]]) -> Nodes:
    x, y = (part.ravel() for part in np.meshgrid(*map(np.array, lines), indexing="ij"))
    along, across = surface.lengths_m
    distance2 = ((x - (grid.nx - 1) / 2) * grid.dx / along) ** 2 + ((y - (grid.ny - 1) / 2) * grid.dy / across) ** 2
    order = np.argsort(distance2, kind="stable")
    return Nodes(x[order], y[order], (distance2 - distance2[0])[order])
