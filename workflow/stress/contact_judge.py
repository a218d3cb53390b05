"""The judge of contact solutions: displacements by its own formulas in extended precision, and every condition.

Free half-space: Love's coefficients as in Johnson, Contact Mechanics, section 3.5, with logarithms at the corners of
the cell in long doubles, and from four long edges of a cell on, where these cancel, Gauss's quadrature of 1/r. Products
as a plain sum on small meshes, by a padded transform in long doubles on larger ones.

Periodic cell: Ewald's method (Ann. Phys. 369 (1921) 253), 1/r = erfc(s r)/r + erf(s r)/r: the first summed over the
images that it reaches, the second over the waves that it carries.

Where long doubles are doubles (some ARM and Windows machines) ROUNDING is too small for cells of large aspect.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import fft
from scipy.special import erf, erfc

from roughslip.contact.solve import ContactSolution
from roughslip.grid import Grid
from workflow.stress.contact_problem import Problem
from workflow.stress.outcomes import Verdict

# Displacements are right to so many units of rounding of a double at a node: coefficients and z - plane.
ROUNDING = 8 * np.finfo(np.float64).eps

# The load is a sum of at most 16384 doubles.
LOAD_ROUNDING = 1e-12

SUMMED = 1024  # nodes up to which the product is a plain sum
FAR = 4.0  # long edges of a cell, from which on quadrature takes over: 8 nodes an axis leave 16^-16
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
REACH = 6.2  # erfc(6.2) < 2e-18


def love(x: np.ndarray, y: np.ndarray, dx: float, dy: float) -> np.ndarray:
    """The integral of 1/r over a cell at the origin, seen from (x, y) >= 0 [same unit as x]; long doubles.

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
    """u = B p by the judge's own formulas.

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
            # The offset n, in the middle of the padding, is never used: any number will do.
            kernel = self.coefficients[np.minimum(k, grid.nx - 1)][:, np.minimum(m, grid.ny - 1)]
            self.symbol = fft.fft2(kernel).real

    def __call__(self, pressure: np.ndarray) -> np.ndarray:
        """(nx, ny) [m] long doubles, under pressures (nx, ny) [Pa]."""
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
    """(nx, ny) eigenvalues of the integrals of 1/r over the cells of a periodic mesh, zero for the mean."""
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
    problem: Problem, displacement: Displacement, solution: ContactSolution, plane: float | None, hardness: float
) -> Verdict:
    """Whether a solution is what it claims: the relative residual and the conditions of contact, node by node.

    plane : [m] where it was asked for; None under a load, where it is the solution's

    All lengths are compared with tolerance ||max(u_bar, 0)||, in a periodic cell with tolerance B_00 ||p|| where that
    is more, and the rounding of the judge.
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
    if displacement.periodic:  # a mean pressure has no displacement there, and u_bar may be nothing beside B_00 p
        reach = max(reach, _norm(lift))
    node_rounding = ROUNDING * (np.abs(lifted) + np.abs(u_bar) + (abs(height) if plane is None else 0.0))
    allowed = problem.tolerance * reach + _norm(np.where(unmet != 0, node_rounding, 0))
    size = _norm(unmet)
    residual = 0.0 if size == 0 else math.inf if reach == 0 else float(size / reach)
    met = {
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
        met["the load"] = (abs(p.astype(np.longdouble).mean() / problem.load - 1), LOAD_ROUNDING)
    broken = [(name, float(value), float(limit)) for name, (value, limit) in met.items() if not value <= limit]
    return Verdict(residual, tuple(f"{name}: {value:.3e} for {limit:.3e}" for name, value, limit in broken))


def _norm(field: np.ndarray) -> np.longdouble:
    return np.sqrt((field**2).sum())
