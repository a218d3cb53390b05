"""From a stage's slice of the scene to what the pressure expansion expands, and in which variables."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from roughslip.chaos.functionals import Stencil, local_functionals, orthonormal_directions
from roughslip.chaos.pressure import KINDS, Kind, PressureTarget, pressure_target, summit_curvature
from roughslip.grid import Grid
from roughslip.stages import elastic, geometry
from roughslip.surface.model import SurfaceModel

BEST = "best"  # in a scene: the target that scores best
APART = (
    0.5  # correlation lengths from the centre to the outer training nodes; of 0.5, 0.8 and 1.2 it has the least bias
)


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


def _central(n: int) -> list[int]:
    return sorted({n // 2, (n - 1) // 2}, reverse=True)


def _nodes(surface: SurfaceModel, grid: Grid, lines: list[list[int]]) -> Nodes:
    x, y = (part.ravel() for part in np.meshgrid(*map(np.array, lines), indexing="ij"))
    along, across = surface.lengths_m
    distance2 = ((x - (grid.nx - 1) / 2) * grid.dx / along) ** 2 + ((y - (grid.ny - 1) / 2) * grid.dy / across) ** 2
    order = np.argsort(distance2, kind="stable")
    return Nodes(x[order], y[order], (distance2 - distance2[0])[order])


def directions(surface: SurfaceModel, grid: Grid, modes: np.ndarray, nodes: Nodes, count: int) -> np.ndarray:
    """The variables of an expansion at each node, in terms of those of the modes.

    modes : (M, nx, ny) [m] scaled Karhunen-Loeve modes
    count : number of variables

    Returns directions : (nodes, count, M), orthonormal rows: directions @ xi are local functionals of the heights.
    """
    functionals = local_functionals(modes, stencil(surface, grid))[:, :, nodes.x, nodes.y]
    return np.stack([orthonormal_directions(functionals[:, :, node], count) for node in range(len(nodes.x))])


def targets(configuration: geometry.Configuration, surface: SurfaceModel, grid: Grid) -> tuple[PressureTarget, ...]:
    """The smooth variables that the square chooses from: the one that the scene names, or all of them."""
    named = configuration["expansion"]["target"]
    return tuple(_target(kind, configuration, surface, grid) for kind in (KINDS if named == BEST else (named,)))


def strip_target(configuration: geometry.Configuration, surface: SurfaceModel, grid: Grid) -> PressureTarget:
    """The smooth variable of the strip; the best is the squared pressure, on coarse meshes the trial pressure."""
    named = configuration["expansion"]["target"]
    return _target("squared_pressure" if named == BEST else named, configuration, surface, grid)


def _target(kind: Kind, configuration: geometry.Configuration, surface: SurfaceModel, grid: Grid) -> PressureTarget:
    return pressure_target(
        kind,
        influence_diagonal=elastic.influence(configuration, grid).diagonal,
        plane_strain_modulus_pa=elastic.material(configuration).plane_strain_modulus_pa,
        summit_curvature_per_m=summit_curvature(surface.rms_height_m, math.sqrt(math.prod(surface.lengths_m))),
    )


def stencil(surface: SurfaceModel, grid: Grid) -> Stencil:
    """Boxes of the near and far mean: half widths of 0.5 and 2 correlation lengths, at least 1 and 2 nodes."""
    axes = list(zip(surface.lengths_m, (grid.dx, grid.dy), strict=True))
    near = [max(1, round(0.5 * length / cell)) for length, cell in axes]
    far = [max(2, round(2.0 * length / cell)) for length, cell in axes]
    return Stencil((near[0], near[1]), (far[0], far[1]))
