"""From a stage's slice of the scene to what the pressure expansion expands, and in which variables."""

from __future__ import annotations

import math

import numpy as np

from roughslip.chaos.functionals import Stencil, local_functionals, orthonormal_directions
from roughslip.chaos.pressure import KINDS, Kind, PressureTarget, pressure_target, summit_curvature
from roughslip.grid import Grid
from roughslip.stages import elastic, geometry
from roughslip.stages.nodes import Nodes
from roughslip.surface.model import SurfaceModel

BEST = "best"  # in a scene: the target that scores best


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
    kinds = KINDS if named == BEST else (named,)
    if math.isfinite(elastic.hardness_pa(configuration)):
        kinds = tuple(kind for kind in kinds if kind != "censored")
    return tuple(_target(kind, configuration, surface, grid) for kind in kinds)


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
        hardness_pa=elastic.hardness_pa(configuration),
    )


def stencil(surface: SurfaceModel, grid: Grid) -> Stencil:
    """Boxes of the near and far mean: half widths of 0.5 and 2 correlation lengths, at least 1 and 2 nodes."""
    axes = list(zip(surface.lengths_m, (grid.dx, grid.dy), strict=True))
    near = [max(1, round(0.5 * length / cell)) for length, cell in axes]
    far = [max(2, round(2.0 * length / cell)) for length, cell in axes]
    return Stencil((near[0], near[1]), (far[0], far[1]))
