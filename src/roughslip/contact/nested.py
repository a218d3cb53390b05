"""Initial pressures on a large mesh: the solution on cells of twice the edge, which starts in the same way."""

from __future__ import annotations

import numpy as np

from roughslip.contact.conjugate_gradients import Problem, approximate
from roughslip.errors import ConvergenceError

# Meshes up to COARSEST nodes start from zero, because coarser meshes would cost more than they save.
COARSEST = 64 * 64

# Residual on the coarser meshes. A smaller one gains nothing, because the error of the mesh dominates.
TOLERANCE = 1e-3


def guess(problem: Problem) -> np.ndarray | None:
    """Pressures (nx, ny) [Pa] to start from, or None where zero is the better start."""
    u_bar, influence = problem.interference, problem.influence
    if u_bar.size <= COARSEST:
        return None
    coarser = influence.coarser
    coarse_u_bar = u_bar
    for axis in (0, 1):
        if coarser.grid.shape[axis] < u_bar.shape[axis]:
            coarse_u_bar = _pair_means(coarse_u_bar, axis)
    pressure_sum = None if problem.pressure_sum is None else problem.pressure_sum * coarse_u_bar.size / u_bar.size
    if pressure_sum is None and not (coarse_u_bar > 0).any():
        return None
    coarse = Problem(coarser, coarse_u_bar, problem.cap, pressure_sum)
    try:
        pressure = approximate(coarse, TOLERANCE, guess(coarse))
    except ConvergenceError:  # the solve on the fine mesh may still succeed
        return None
    for axis in (0, 1):
        if coarser.grid.shape[axis] < u_bar.shape[axis]:
            pressure = np.repeat(pressure, 2, axis).take(range(u_bar.shape[axis]), axis)
    return pressure if pressure_sum is not None else np.where(u_bar > 0, pressure, 0.0)


def _pair_means(field: np.ndarray, axis: int) -> np.ndarray:
    """Means of neighbours, first and second, third and fourth; an odd one at the end stays as it is."""
    first, second = (np.take(field, range(start, field.shape[axis], 2), axis) for start in (0, 1))
    if first.shape != second.shape:
        second = np.concatenate((second, np.take(first, [-1], axis)), axis)
    return (first + second) / 2
