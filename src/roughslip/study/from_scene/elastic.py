"""The elastic half-space of a scene: its material and influence coefficients, and what counts as contact."""

import math

from roughslip.contact.influence import Influence, Material
from roughslip.grid import Grid
from roughslip.scene.part import Scene


def material(scene: Scene) -> Material:
    """Elastic constants."""
    return Material(scene.material.young_modulus_pa, scene.material.poisson_ratio)


def hardness_pa(scene: Scene) -> float:
    """Highest contact pressure H [Pa], infinite where the scene gives none: the contact is elastic then."""
    return math.inf if scene.material.hardness_pa is None else scene.material.hardness_pa


def counts_shares(scene: Scene) -> bool:
    """Whether a cell at the edge of a contact counts by its covered share, and not as a whole."""
    return bool(scene.numerics.contact_area == "corrected")


def influence(scene: Scene, grid: Grid) -> Influence:
    """Influence coefficients of the material on a mesh."""
    return Influence(grid, material(scene).plane_strain_modulus_pa)
