"""Pressures at a few nodes, from a solve that stops as soon as these are known.

The inverse K of B is an M-matrix: no entry off its diagonal is positive. The gap of the contact problem is then the
least of all gaps w >= 0 with K (w + u_bar) >= 0, so that solutions can be compared. See Cottle, Pang and Stone,
The Linear Complementarity Problem, 1992, section 3.11. For any 0 <= p <= H with w = B p - u_bar, let

    up = largest -w where p < H,      down = largest w where p > 0,      neither negative.

Pressures K 1 >= 0 lift every node by one metre, so w + up is above the gap of the solution and w - down below it. At a
node i one row of K then gives bounds of its pressure:

    p_i - K_ii (w_i + up) <= pressure <= p_i - K_ii (w_i - down),      and 0 <= pressure <= H.

A node is in contact where the lower bound is positive, and out of contact where the upper one is not. The bounds are as
wide at every node, so those of a node in contact hold for its neighbours, which `edge_pressure` takes.
"""

from __future__ import annotations

import math

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.contact import conjugate_gradients, dense_solver, kernels
from roughslip.contact.edge import at_points
from roughslip.contact.influence import Influence
from roughslip.contact.problem import Problem
from roughslip.contact.solve import dense_pays, solve
from roughslip.results import described, result

# K_ii on a mesh of any size over that on the patch of Influence.approximate_inverse: at most 1.0003 for square cells
# and 1.016 for cells of ten to one.
LARGER_MESH = 1.02


@result
class NodePressures:
    """Pressures at n nodes of k surfaces."""

    pressure: np.ndarray = described("contact pressure, exactly zero off contact", "Pa", "k n")
    low: np.ndarray = described(
        "lower bound of the pressures of the cells, positive at every cell in contact", "Pa", "k n"
    )
    high: np.ndarray = described("upper bound of the pressures of the cells", "Pa", "k n")
    work: np.ndarray = described("products with B, or Cholesky factors", "1", "k")
    method: np.ndarray = described(
        '"none" (the nodes lie below the plane), "dense", "fft", or "bounded" where the bounds ended the solve',
        "1",
        "k",
    )


def solve_at(
    influence: Influence,
    interferences: np.ndarray,
    nodes: tuple[np.ndarray, np.ndarray],
    precision: float = 1e-3,
    tolerance: float = 1e-10,
    hardness_pa: float = math.inf,
    *,
    points: bool = False,
) -> NodePressures:
    """Solve the contact of surfaces with a plane at a given height, for the pressures at some nodes.

    influence : B of the mesh, a free half-space
    interferences : (k, nx, ny) [m] u_bar, heights of each surface over the plane
    nodes : indices (n,), (n,) of the nodes
    precision : [-] width of the bounds of a pressure over the pressure
    tolerance, hardness_pa : as in `solve`, where the bounds cannot decide
    points : the pressures of `point_pressures` at the nodes, in place of the means of their cells

    Returns pressures that differ from those of `solve` by less than the bounds, with the same nodes in contact. Those
    of a surface do not depend on the others. Raises as `solve`.
    """
    pressure, low, high = np.zeros((3, len(interferences), len(nodes[0])))
    work, method = np.zeros(len(interferences), dtype=np.int64), np.full(len(interferences), "none", dtype="U7")
    left = np.flatnonzero((interferences[:, *nodes] > 0).any(axis=1))
    if influence.grid.size <= dense_solver.SMALL and not influence.periodic:
        fields, _, residuals, factors = dense_solver.solve_each(influence, interferences[left])
        solved = (residuals <= tolerance) & (fields.max(axis=(1, 2)) <= hardness_pa)
        done, left = left[solved], left[~solved]
        low[done] = high[done] = pressure[done] = fields[solved][:, *nodes]
        work[done], method[done] = factors[solved], "dense"
        for row, field in zip(done, fields[solved] if points else (), strict=points):
            pressure[row] = at_points(field, nodes)
    for row in left:
        bounds = low[row], high[row]
        fields, work[row], method[row] = _solved(
            influence, interferences[row], nodes, precision, tolerance, hardness_pa, bounds
        )
        pressure[row] = np.where(high[row] > 0, at_points(fields, nodes) if points else fields[nodes], 0.0)
    return NodePressures(pressure, low, high, work, method)


def _solved(
    influence: Influence,
    interference: np.ndarray,
    nodes: tuple[np.ndarray, np.ndarray],
    precision: float,
    tolerance: float,
    hardness_pa: float,
    bounds: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, int, str]:
    """Pressures (nx, ny) of one surface, work and method; writes the bounds at the nodes, two arrays (n,)."""
    if influence.periodic or dense_pays(int(np.count_nonzero(interference > 0)), interference.size):
        solution = solve(influence, interference, tolerance, hardness_pa=hardness_pa)
        bounds[0][:] = bounds[1][:] = solution.pressure[nodes]
        return solution.pressure, solution.work, solution.method
    stiffness = LARGER_MESH * influence.approximate_inverse.max()
    at = np.ravel_multi_index(nodes, influence.grid.shape)

    def enough(pressure: np.ndarray, gap: np.ndarray) -> bool:
        return _bounded(pressure, gap, hardness_pa, stiffness, at, precision, *bounds)

    problem = Problem(influence, interference, hardness_pa)
    iterate = conjugate_gradients.solve(problem, tolerance, conjugate_gradients.guess(problem), enough)
    decided = enough(iterate.pressure, iterate.gap)
    return iterate.pressure, iterate.products, "bounded" if decided else "fft"


@compiled()
def _bounded(
    pressure: np.ndarray,
    gap: np.ndarray,
    cap: float,
    stiffness: float,
    at: np.ndarray,
    precision: float,
    low: np.ndarray,
    high: np.ndarray,
) -> bool:
    """Write the bounds at the nodes of these numbers, and whether they decide contact and are narrow enough."""
    up, down = kernels.gap_errors(pressure, gap, cap)
    p, w, known = pressure.reshape(-1), gap.reshape(-1), True
    for n in range(at.size):
        minimum = p[at[n]] - stiffness * (w[at[n]] + up)
        low[n] = min(max(minimum, 0.0), cap)
        high[n] = min(max(minimum + stiffness * (up + down), 0.0), cap)
        known &= ((low[n] > 0) | (high[n] == 0)) & (high[n] - low[n] <= precision * high[n])
    return known
