"""Stress campaign of contact: random problems, each solution judged by displacements in extended precision.

Free half-space: Love's coefficients as in Johnson, Contact Mechanics, section 3.5, with logarithms at the corners of
the cell in long doubles. Beyond four long edges of a cell, where these cancel, Gauss's quadrature of 1/r replaces them.
Products are plain sums on small meshes and padded transforms in long doubles on larger ones.

Periodic cell: Ewald's method (Ann. Phys. 369 (1921) 253), 1/r = erfc(s r)/r + erf(s r)/r. The first part is summed over
the images within its reach, the second over waves.

Where long doubles are doubles (some ARM and Windows machines) ROUNDING is too small for cells of large aspect.

`python -m workflow.stress.contact -j 2 --output results/stress/contact.json` runs the campaign; `--only 17` runs one
problem.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import fft
from scipy.special import erf, erfc

from roughslip.contact.influence import Influence
from roughslip.contact.solve import ContactSolution, solve, solve_load, sweep
from roughslip.grid import Grid
from workflow.evidence.rows import Row
from workflow.stress import runner
from workflow.stress.contact_problem import ContactProblem, random_problem
from workflow.stress.runner import Conditions, Verdict

STAGE = "contact"
LEAST_HARDNESS = 1.02  # mean pressures; at 1 all nodes yield
PROBLEMS = 10_000

ROUNDING = 8 * np.finfo(np.float64).eps  # of displacements at a node: coefficients and z - plane
LOAD_ROUNDING = 1e-12  # The load is a sum of at most 16384 doubles.
SUMMED = 1024  # nodes up to which the product is a plain sum
FAR = 4.0  # long edges of a cell beyond which quadrature replaces the closed form: 8 nodes an axis leave 16^-16
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
REACH = 6.2  # erfc(6.2) < 2e-18


def row_of(seed: int, number: int) -> Row:
    """Return the row of the problem of this number."""
    problem = random_problem(seed, number)
    return runner.problem_row(STAGE, runner.case_of(problem), lambda: judged(problem))


def judged(problem: ContactProblem) -> Verdict:
    """Solve a problem and judge every plane of it."""
    displacement = Displacement(problem.grid, problem.modulus, problem.periodic)
    hardness, found = solutions(problem)
    asked = problem.planes if problem.load is None else (None,)
    verdicts = [
        judge(problem, displacement, solution, plane, hardness) for plane, solution in zip(asked, found, strict=True)
    ]
    broken = (f"plane {k}: {what}" for k, verdict in enumerate(verdicts) for what in verdict.broken)
    return Verdict(max(verdict.residual for verdict in verdicts), tuple(broken))


def solutions(problem: ContactProblem) -> tuple[float, list[ContactSolution]]:
    """Return the hardness [Pa] and the solution for each plane."""
    influence = Influence(problem.grid, problem.modulus, periodic=problem.periodic)
    hardness = math.inf
    if math.isfinite(problem.cap):
        peak = max(float(elastic.pressure.max()) for elastic in solve_planes(problem, influence, 1e-3, math.inf))
        hardness = max(problem.cap * peak, LEAST_HARDNESS * (problem.load or 0.0)) or problem.modulus
    return hardness, list(solve_planes(problem, influence, problem.tolerance, hardness))


def solve_planes(
    problem: ContactProblem, influence: Influence, tolerance: float, hardness: float
) -> Iterator[ContactSolution]:
    if problem.load is not None:
        yield solve_load(influence, problem.heights, problem.load, tolerance, hardness_pa=hardness)
    elif problem.control == "sweep":
        yield from sweep(influence, problem.heights, problem.planes, tolerance, hardness)
    else:
        yield solve(influence, problem.heights - problem.planes[0], tolerance, hardness_pa=hardness)


def love(x: np.ndarray, y: np.ndarray, dx: float, dy: float) -> np.ndarray:
    """Return the integral of 1/r over a cell at the origin, at points (x, y) >= 0, in long doubles.

    x, y : (m, 1) and (1, n) long doubles
    """
    value = np.zeros(np.broadcast_shapes(x.shape, y.shape), dtype=np.longdouble)
    far = np.hypot(x, y) > FAR * max(dx, dy)
    if far.any():
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            for other, its in zip(NODES, WEIGHTS, strict=True):
                value += weight * its / 4 * dx * dy / np.hypot(x + node * dx / 2, y + other * dy / 2)
    near_x, near_y = (np.broadcast_to(array, value.shape)[~far] for array in (x, y))
    a, b = np.longdouble(dx) / 2, np.longdouble(dy) / 2
    value[~far] = 0
    for sign_x in (1, -1):
        for sign_y in (1, -1):
            u, v = near_x + sign_x * a, near_y + sign_y * b
            value[~far] += sign_x * sign_y * (u * np.arcsinh(v / np.abs(u)) + v * np.arcsinh(u / np.abs(v)))
    return value


class Displacement:
    """The displacement u = B p by the judge's own formulas.

    diagonal : B_00 [m/Pa]
    """

    def __init__(self, grid: Grid, modulus: float, periodic: bool) -> None:
        self.grid, self.periodic = grid, periodic
        unit = math.sqrt(grid.cell_area)
        dx, dy = grid.dx / unit, grid.dy / unit
        factor = np.longdouble(unit) / (np.longdouble(np.pi) * np.longdouble(modulus))
        if periodic:
            self.symbol = factor * _ewald(grid.shape, dx, dy)
            self.torus = grid.shape
            self.diagonal = self.symbol.mean()
            return
        i, j = (np.arange(n, dtype=np.longdouble) for n in grid.shape)
        self.coefficients = factor * love((i * dx)[:, None], (j * dy)[None, :], dx, dy)
        self.diagonal = self.coefficients[0, 0]
        self.torus = (2 * grid.nx, 2 * grid.ny)
        if grid.size > SUMMED:
            k, m = (np.minimum(np.arange(2 * n), 2 * n - np.arange(2 * n)) for n in grid.shape)
            # The offset n in the middle of the padding is never used, so its value does not matter.
            kernel = self.coefficients[np.minimum(k, grid.nx - 1)][:, np.minimum(m, grid.ny - 1)]
            self.symbol = fft.fft2(kernel).real

    def __call__(self, pressure: np.ndarray) -> np.ndarray:
        """Return displacements (nx, ny) [m] in long doubles under pressures (nx, ny) [Pa]."""
        nx, ny = self.grid.shape
        pressure = pressure.astype(np.longdouble)
        if self.periodic or self.grid.size > SUMMED:
            return fft.ifft2(fft.fft2(pressure, self.torus) * self.symbol).real[:nx, :ny]
        mirrored = np.concatenate((self.coefficients[:0:-1], self.coefficients))
        mirrored = np.concatenate((mirrored[:, :0:-1], mirrored), axis=1)
        windows = sliding_window_view(mirrored, self.grid.shape)[::-1, ::-1]  # [k, m] of the node (k, m) under load
        displacement = np.zeros(self.grid.shape, dtype=np.longdouble)
        for k, m in zip(*np.nonzero(pressure), strict=True):
            displacement += pressure[k, m] * windows[k, m]
        return displacement


def _ewald(shape: tuple[int, int], dx: float, dy: float) -> np.ndarray:
    """Return (nx, ny) eigenvalues of the integrals of 1/r over the cells of a periodic mesh, zero for the mean."""
    s = 1 / max(dx, dy)
    counts = [math.ceil(REACH / (s * d)) + 1 for d in (dx, dy)]
    i, j = (np.arange(count + 1, dtype=np.longdouble) for count in counts)
    x, y = (i * dx)[:, None], (j * dy)[None, :]
    short = love(x, y, dx, dy)
    for node, weight in zip(NODES, WEIGHTS, strict=True):
        for other, its in zip(NODES, WEIGHTS, strict=True):
            r = np.hypot(x + node * dx / 2, y + other * dy / 2)
            short -= weight * its / 4 * dx * dy * erf((s * r).astype(np.float64)) / r
    wrapped = np.zeros(shape, dtype=np.longdouble)
    all_i, all_j = (np.arange(-count, count + 1) for count in counts)
    np.add.at(wrapped, np.ix_(all_i % shape[0], all_j % shape[1]), short[np.ix_(np.abs(all_i), np.abs(all_j))])
    symbol = fft.fft2(wrapped).real

    waves = []
    for n, d in zip(shape, (dx, dy), strict=True):
        images = math.ceil(REACH * s * d / math.pi) + 1
        waves.append(2 * np.pi * (np.fft.fftfreq(n) + np.arange(-images, images + 1)[:, None]) / d)
    for qx in waves[0]:
        for qy in waves[1]:
            q = np.hypot(qx[:, None], qy)
            carried = np.outer(np.sinc(qx * dx / (2 * np.pi)), np.sinc(qy * dy / (2 * np.pi)))
            symbol += np.where(q > 0, 2 * np.pi / np.where(q > 0, q, 1.0) * carried * erfc(q / (2 * s)), 0.0)
    symbol[0, 0] = 0
    return symbol


def judge(
    problem: ContactProblem, displacement: Displacement, solution: ContactSolution, plane: float | None, hardness: float
) -> Verdict:
    """Return the relative residual of a solution and the conditions of contact that it breaks, node by node.

    plane : [m] the required one; None under a load, where the solution gives it

    All lengths are compared with tolerance ||max(u_bar, 0)|| plus the rounding of the judge. In a periodic cell
    B_00 ||p|| replaces the norm where it is larger.
    """
    height = solution.plane if plane is None else plane
    p, plastic = solution.pressure, solution.plastic_displacement
    fields_ = (p, solution.gap, plastic)
    if not all(f.shape == problem.grid.shape and f.dtype == np.float64 and np.isfinite(f).all() for f in fields_):
        return Verdict(math.inf, ("fields of another shape, or not finite",))
    lifted = displacement(p)
    u_bar = problem.heights.astype(np.longdouble) - np.longdouble(height)
    elastic = lifted - u_bar  # the gap without plastic displacement
    gap = elastic + plastic
    lift, highest = displacement.diagonal * p, displacement.diagonal * np.longdouble(hardness)
    unmet = lift - np.clip(lift - elastic, 0, highest)
    reach = _norm(np.maximum(u_bar, 0))
    if displacement.periodic:  # A mean pressure causes no displacement there, and u_bar may be far below B_00 p.
        reach = max(reach, _norm(lift))
    node_rounding = ROUNDING * (np.abs(lifted) + np.abs(u_bar) + (abs(height) if plane is None else 0.0))
    allowed = problem.tolerance * reach + _norm(np.where(unmet != 0, node_rounding, 0))
    size = _norm(unmet)
    residual = 0.0 if size == 0 else math.inf if reach == 0 else float(size / reach)
    conditions: Conditions = {
        "the residual": (size, allowed),
        "p >= 0": (-p.min(), 0),
        "p <= H": (p.max(), hardness),
        "gap >= 0": (-gap.min(), allowed),
        "gap = 0 where p > 0": (np.abs(gap[p > 0]).max(initial=0), allowed),
        "u_plastic >= 0": (-plastic.min(), 0),
        "u_plastic = 0 where p < H": (plastic[p < hardness].max(initial=0), 0),
        "its gap is B p - u_bar + u_plastic": (np.abs(solution.gap - gap).max(), allowed + node_rounding.max()),
        "its residual": (solution.residual, problem.tolerance),
    }
    if problem.load is not None:
        conditions["the load"] = (abs(p.astype(np.longdouble).mean() / problem.load - 1), LOAD_ROUNDING)
    return Verdict(residual, runner.broken_conditions(conditions))


def _norm(field: np.ndarray) -> np.longdouble:
    return np.sqrt((field**2).sum())


if __name__ == "__main__":
    sys.exit(runner.command(__doc__, STAGE, row_of, PROBLEMS))
