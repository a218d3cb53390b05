"""Contact of one surface under several loads."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from roughslip.contact.influence import Influence
from roughslip.contact.nested import COARSEST
from roughslip.contact.solution import ContactSolution, ContactSweep, curve_of
from roughslip.contact.solve import solve_load, sum_of_pressures
from roughslip.validation import Field, gate

# A start from the loads below takes 0.5 to 0.6 of the time of one from coarser meshes where loads grow by 12 %, as much
# where they grow by 47 %, and more on meshes of 512 x 512 nodes. Meshes that have no coarser ones always gain.
CLOSE = 1.25


@gate
def solve_loads(
    influence: Influence,
    heights: Field,
    mean_pressures_pa: Sequence[float] | np.ndarray,
    tolerance: float = 1e-10,
    hardness_pa: float = math.inf,
) -> ContactSweep:
    """Solve one surface under several loads, each solve starting from the loads below where these are close.

    influence : B of the mesh, a free half-space or a periodic cell
    heights : (nx, ny) [m] z
    mean_pressures_pa : (k,) [Pa] force per nominal area, in any order
    tolerance, hardness_pa : as in solve_load

    Returns the curve, with the k solutions in the order of the loads; they agree with single solves to the tolerance.
    Raises as solve_load, and before anything is solved where one of the loads is refused.
    """
    for load in mean_pressures_pa:
        sum_of_pressures(load, hardness_pa, influence)
    solutions: dict[float, ContactSolution] = {}
    for load in sorted({float(load) for load in mean_pressures_pa}):
        below = list(solutions)[-2:]
        start = None
        if below and (load <= CLOSE * below[-1] or heights.size <= COARSEST):
            start = _extrapolated([solutions[lower].pressure for lower in below], below, load)
        solutions[load] = solve_load(influence, heights, load, tolerance, start, hardness_pa)
    return curve_of([solutions[float(load)] for load in mean_pressures_pa])


def _extrapolated(pressures: list[np.ndarray], loads: list[float], load: float) -> np.ndarray:
    """Pressures (nx, ny) [Pa] linear in the load, from two loads below it or in proportion to one."""
    if len(loads) == 1:
        return pressures[0]
    share = (load - loads[1]) / (loads[1] - loads[0])
    return np.maximum(pressures[1] + share * (pressures[1] - pressures[0]), 0.0)
