"""From a stage's slice of the scene to the material, its hardness and the influence of pressure on displacement."""

from __future__ import annotations

import math

from roughslip.contact.influence import Influence, Material
from roughslip.grid import Grid
from roughslip.scene.types import Scene


def material(scene: Scene) -> Material:
    """Elastic constants."""
    return Material(scene.material.young_modulus_pa, scene.material.poisson_ratio)


def hardness_pa(scene: Scene) -> float:
    """Highest contact pressure H [Pa], infinite where the scene gives none: the contact is elastic then."""
    return math.inf if scene.material.hardness_pa is None else scene.material.hardness_pa


def influence(scene: Scene, grid: Grid) -> Influence:
    """Influence coefficients of the material on a mesh."""
    return Influence(grid, material(scene).plane_strain_modulus_pa)
