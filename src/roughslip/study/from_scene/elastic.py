"""The contact of a scene: material, hardness, influence of pressure on displacement, and what its solves left out."""

import math
from collections import Counter

import numpy as np

from roughslip.contact.influence import DIRECT_SUM_LIMIT, Influence, Material
from roughslip.contact.solution import ContactSolution
from roughslip.grid import Grid
from roughslip.scene.types import Scene
from roughslip.study import skip_reasons


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


def empty_skip_counts() -> Counter[str]:
    """All counters at zero, so that a record also lists what did not occur."""
    return Counter(dict.fromkeys(skip_reasons.OF_SOLVES, 0))


def count_solve(counts: Counter[str], solution: ContactSolution) -> None:
    """Add what a solve left out to the counts of skip_reasons.OF_SOLVES."""
    if solution.method == "none":
        counts[skip_reasons.NO_CONTACT] += 1
        return
    left = solution.pressure.size - solution.nodes
    if solution.method == "dense":
        counts[skip_reasons.BELOW] += left
        counts[skip_reasons.SUMMED] += int(np.count_nonzero(solution.pressure)) <= DIRECT_SUM_LIMIT
    else:
        counts[skip_reasons.CROPPED] += left
        counts[skip_reasons.WARM] += solution.start == "given"
        counts[skip_reasons.NESTED] += solution.start == "nested"
