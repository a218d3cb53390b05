"""From a stage's slice of the scene to the material, its hardness and the influence of pressure on displacement."""

from __future__ import annotations

import math

from roughslip.contact.influence import Influence, Material
from roughslip.grid import Grid
from roughslip.stages.from_scene.geometry import Configuration


def material(configuration: Configuration) -> Material:
    """Elastic constants."""
    return Material(configuration["material"]["young_modulus_pa"], configuration["material"]["poisson_ratio"])


def hardness_pa(configuration: Configuration) -> float:
    """Highest contact pressure H [Pa], infinite where the scene gives none: the contact is elastic then."""
    return float(configuration["material"].get("hardness_pa", math.inf))


def influence(configuration: Configuration, grid: Grid) -> Influence:
    """Influence coefficients of the material on a mesh."""
    return Influence(grid, material(configuration).plane_strain_modulus_pa)
