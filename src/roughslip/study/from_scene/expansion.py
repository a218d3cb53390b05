"""From a stage's slice of the scene to what the pressure expansion expands, and in which variables."""

import math

import numpy as np

from roughslip.chaos.pressure import PressureTarget, pressure_target
from roughslip.chaos.variables import (
    MIRRORED,
    Stencil,
    local_functionals,
    orthonormal_directions,
)
from roughslip.grid import Grid
from roughslip.scene.part import Scene
from roughslip.study.from_scene import elastic
from roughslip.study.from_scene.geometry import Nodes
from roughslip.surface.model import GaussianModel, SurfaceModel


def directions(
    surface: GaussianModel, grid: Grid, modes: np.ndarray, nodes: Nodes, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """The variables of an expansion at each node, in terms of those of the modes.

    modes : (M, nx, ny) [m] scaled Karhunen-Loeve modes
    count : number of variables

    Returns directions : (nodes, count, M), orthonormal rows: directions @ xi are local functionals of the heights; and
    odd : (count, symmetries) what the symmetries of the surface do to each, as in `SolvedSurfaces`.
    """
    functionals = local_functionals(modes, stencil(surface, grid))[:count, :, nodes.x, nodes.y]
    chosen = np.stack([orthonormal_directions(functionals[:, :, node]) for node in range(len(nodes.x))])
    odd = MIRRORED if surface.mirror_symmetric else MIRRORED.sum(axis=1, keepdims=True) % 2  # half a turn keeps any law
    return chosen, odd[:count]


def target(scene: Scene, surface: SurfaceModel, grid: Grid) -> PressureTarget:
    """The smooth variable that the scene names, for the mesh of the square or of the strip."""
    return pressure_target(
        scene.expansion.target,
        influence_diagonal=elastic.influence(scene, grid).diagonal,
        plane_strain_modulus_pa=elastic.material(scene).plane_strain_modulus_pa,
        rms_height_m=surface.rms_height_m,
        correlation_length_m=math.sqrt(math.prod(surface.lengths_m)),
        hardness_pa=elastic.hardness_pa(scene),
    )


def stencil(surface: SurfaceModel, grid: Grid) -> Stencil:
    """Boxes of the near and far mean: half widths of 0.5 and 2 correlation lengths, at least 1 and 2 nodes."""
    axes = list(zip(surface.lengths_m, (grid.dx, grid.dy), strict=True))
    near = [max(1, round(0.5 * length / cell)) for length, cell in axes]
    far = [max(2, round(2.0 * length / cell)) for length, cell in axes]
    return Stencil((near[0], near[1]), (far[0], far[1]))
