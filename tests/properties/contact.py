"""Contact: random problems, each solution judged by displacements in extended precision.

Heights over cells go from 1e-12 / 1e3 to 1e3 / 1e-9, so that a solver with a fixed length or pressure fails here.

Free half-space: Love's coefficients (Johnson, Contact Mechanics, section 3.5) and padded transforms in long doubles.
Beyond four long edges of a cell the logarithms cancel, and Gauss's quadrature of 1/r replaces them. Periodic cell:
Ewald's method (Ann. Phys. 369 (1921) 253), 1/r = erfc(s r)/r + erf(s r)/r, the first part summed over images, the
second over waves. Where long doubles are doubles ROUNDING is too small for cells of large aspect.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product

import numpy as np
from scipy import fft
from scipy.special import erf, erfc

from roughslip.contact.influence import Influence
from roughslip.contact.solve import ContactSolution, solve, solve_load, sweep
from roughslip.errors import ConvergenceError
from roughslip.grid import Grid
from tests.properties.campaign import Trial, choose, log_uniform

DEMANDED = 1e-10  # Every problem must reach this residual. Short of a tighter tolerance, an error is an answer.
LEAST_HARDNESS = 1.02  # mean pressures; at 1 all nodes yield
ROUNDING = 8 * np.finfo(np.float64).eps  # of displacements at a node: coefficients and z - plane
LOAD_ROUNDING = 1e-12  # The load is a sum of at most 16384 doubles.
FAR = 4.0  # long edges of a cell beyond which quadrature replaces the closed form: 8 nodes an axis leave 16^-16
GAUSS = list(zip(*np.polynomial.legendre.leggauss(8), strict=True))
REACH = 6.2  # erfc(6.2) < 2e-18

MOST_NODES = 128  # on an axis
TOLERANCES, TOLERANCE_SHARES = (1e-10, 1e-3, 1e-6, 1e-12), (0.7, 0.1, 0.1, 0.1)
RANDOM = ("gaussian", "exponential", "white")
ADVERSARIAL = ("ties", "constant", "one-node", "step", "tilted", "touching")
SURFACE_SHARES = [5.0, 5.0, 4.0, *[1.0] * len(ADVERSARIAL)]
CONTROLS, CONTROL_SHARES = ("plane", "load", "periodic-load", "sweep"), (0.55, 0.2, 0.15, 0.1)


def attempt(trial: Trial) -> None:
    """Draw, solve and judge a problem under planes or a load, elastic or with a hardness."""
    rng = trial.rng
    control, surface = choose(rng, CONTROLS, CONTROL_SHARES), choose(rng, (*RANDOM, *ADVERSARIAL), SURFACE_SHARES)
    grid = draw_mesh(rng)
    if grid.size == 1 and control == "periodic-load":  # The package refuses one node in a periodic cell.
        control = "load"
    periodic = control == "periodic-load"
    scale, modulus = log_uniform(rng, -12, 3), log_uniform(rng, -3, 15)
    tolerance = choose(rng, TOLERANCES, TOLERANCE_SHARES)
    length = log_uniform(rng, -0.5, math.log10(2 * max(grid.shape)))  # in the shorter edge of a cell
    torus = grid.shape if periodic and rng.random() < 0.5 else (2 * grid.nx, 2 * grid.ny)
    heights = draw_heights(rng, surface, grid, length, torus)
    if rng.random() < 0.15:  # another zero of the heights
        heights += rng.choice((-1.0, 1.0)) * log_uniform(rng, -1, 2)
    heights *= scale
    planes, load = [], 0.0
    if control.endswith("load"):  # E* times the range of heights over the edge of the mesh, times 1e-4 to 1e3
        rise = (float(np.ptp(heights)) or scale) / math.sqrt(grid.size * grid.cell_area)
        load = log_uniform(rng, -4, 3) * modulus * rise
    else:
        count = rng.integers(2, 7) if control == "sweep" else 1
        planes = [draw_plane(rng, surface, heights, scale) for _ in range(count)]
    cap = log_uniform(rng, -2, 1) if rng.random() < 0.4 else math.inf
    trial.case |= {"tolerance": tolerance, "control": control, "surface": surface, "nx": grid.nx, "ny": grid.ny}
    trial.case["cap"] = cap

    def solve_at(tolerance: float, hardness: float) -> list[ContactSolution]:
        on = Influence(grid, modulus, periodic=periodic)
        if load:
            return [solve_load(on, heights, load, tolerance, hardness_pa=hardness)]
        if control == "sweep":
            return list(sweep(on, heights, planes, tolerance, hardness))
        return [solve(on, heights - planes[0], tolerance, hardness_pa=hardness)]

    hardness, trial.answers = math.inf, (ConvergenceError,) if tolerance < DEMANDED else ()
    try:
        if math.isfinite(cap):  # times the elastic peak pressure
            peak = max(float(elastic.pressure.max()) for elastic in solve_at(1e-3, math.inf))
            hardness = max(cap * peak, LEAST_HARDNESS * load) or modulus
        solutions = solve_at(tolerance, hardness)
    except ConvergenceError as error:
        trial.check("the residual of the error", error.residual, DEMANDED)
        raise
    symbol = symbol_of(grid, modulus, periodic)
    for solution, plane in zip(solutions, planes or [solutions[0].plane], strict=True):
        slack = ROUNDING * abs(plane) * (not planes)  # The solution gives this plane.
        judge(trial, symbol, heights.astype(np.longdouble) - np.longdouble(plane), tolerance, hardness, solution, slack)
        if load:
            p = solution.pressure.astype(np.longdouble)
            trial.check("the load", abs(p.mean() / load - 1), LOAD_ROUNDING)


def draw_mesh(rng: np.random.Generator) -> Grid:
    """Draw rectangles, rows of nodes, squares and large meshes; cells of aspect 1/100 to 100."""
    kind = rng.random()
    nx, ny = (round(MOST_NODES ** rng.random()) for _ in range(2))
    if kind < 0.15:
        nx, ny = (1, ny) if rng.random() < 0.5 else (nx, 1)
    elif kind < 0.35:
        ny = nx
    elif kind < 0.55:
        nx, ny = (int(n) for n in rng.integers(MOST_NODES // 2, MOST_NODES + 1, 2))
    edge = log_uniform(rng, -9, 3)
    aspect = 1.0 if rng.random() < 0.4 else log_uniform(rng, -2, 2)
    return Grid(nx, ny, edge * max(aspect, 1.0), edge * max(1 / aspect, 1.0))


def draw_heights(
    rng: np.random.Generator, surface: str, grid: Grid, length: float, torus: tuple[int, int]
) -> np.ndarray:
    """Draw (nx, ny) heights of order one; random ones are filtered noise on a torus."""
    i, j = np.meshgrid(*(np.arange(n, dtype=np.float64) for n in grid.shape), indexing="ij")
    some = tuple(int(rng.integers(n)) for n in grid.shape)

    def correlated(torus: tuple[int, int]) -> np.ndarray:
        cell, edge = (grid.dx, grid.dy), length * min(grid.dx, grid.dy)
        x, y = (np.minimum(np.arange(k), k - np.arange(k)) * d / edge for k, d in zip(torus, cell, strict=True))
        r = np.hypot(x[:, None], y)
        root = np.sqrt(np.maximum(fft.rfft2(np.exp(-r if surface == "exponential" else -(r**2))).real, 0.0))
        return fft.irfft2(fft.rfft2(rng.standard_normal(torus)) * root, torus)[: grid.nx, : grid.ny].copy()

    match surface:
        case "white":
            return rng.standard_normal(grid.shape)
        case "gaussian" | "exponential" | "touching":
            return correlated(torus)
        case "ties":
            levels = rng.integers(1, 5)
            return np.round(levels * correlated(torus)) / levels
        case "constant":
            return np.full(grid.shape, rng.choice((-1.0, 0.0, 1.0, 1 / 3)))
        case "one-node":
            return np.where((i == some[0]) & (j == some[1]), 1.0, 1e-3 * rng.standard_normal(grid.shape))
        case "step":
            return np.where(i + (j if rng.random() < 0.5 else 0) < some[0] + 1, 1.0, 0.0)
        case _:
            return rng.standard_normal() * i / grid.nx + rng.standard_normal() * j / grid.ny


def draw_plane(rng: np.random.Generator, surface: str, heights: np.ndarray, scale: float) -> float:
    """Draw a plane: among the heights by their share above it, or below all of them."""
    if surface == "touching":
        return float(heights.max())
    if surface == "one-node" and heights.size > 1:
        second, highest = np.sort(heights, axis=None)[-2:]
        return float(second + rng.random() * (highest - second))
    if rng.random() < 0.15 or (surface == "constant" and rng.random() < 0.7):
        return float(heights.min() - log_uniform(rng, -3, 3) * (float(np.ptp(heights)) or scale))
    limit = math.log(0.9999 / 0.0001)
    return float(np.percentile(heights, 100 - 100 / (1 + math.exp(rng.uniform(-limit, limit)))))


def over_cell(kernel: Callable, x: np.ndarray, y: np.ndarray, dx: float, dy: float) -> np.ndarray:
    """Return the integral of kernel(r) over a cell at the origin, at points (x, y), by Gauss's quadrature."""
    places = product(GAUSS, GAUSS)
    return sum(v * w / 4 * dx * dy * kernel(np.hypot(x + s * dx / 2, y + t * dy / 2)) for (s, v), (t, w) in places)


def love(x: np.ndarray, y: np.ndarray, dx: float, dy: float) -> np.ndarray:
    """Return the integral of 1/r over a cell at the origin, at points x (m, 1) and y (1, n) >= 0, in long doubles."""
    closed, unit = np.longdouble(0), np.longdouble(1)
    for a, b in product((unit * dx / 2, -unit * dx / 2), (unit * dy / 2, -unit * dy / 2)):
        u, v = x + a, y + b
        closed = closed + np.sign(a * b) * (u * np.arcsinh(v / np.abs(u)) + v * np.arcsinh(u / np.abs(v)))
    return np.where(np.hypot(x, y) > FAR * max(dx, dy), over_cell(lambda r: 1 / r, x, y, dx, dy), closed)


def ewald(grid: Grid, dx: float, dy: float) -> np.ndarray:
    """Return (nx, ny) eigenvalues of the integrals of 1/r over the cells of a periodic mesh, zero for the mean."""
    s, shape = 1 / max(dx, dy), grid.shape
    counts = [math.ceil(REACH / (s * d)) + 1 for d in (dx, dy)]
    i, j = (np.arange(count + 1, dtype=np.longdouble) for count in counts)
    x, y = (i * dx)[:, None], (j * dy)[None, :]
    short = love(x, y, dx, dy) - over_cell(lambda r: erf((s * r).astype(np.float64)) / r, x, y, dx, dy)
    wrapped = np.zeros(shape, dtype=np.longdouble)
    all_i, all_j = (np.arange(-count, count + 1) for count in counts)
    np.add.at(wrapped, np.ix_(all_i % shape[0], all_j % shape[1]), short[np.ix_(np.abs(all_i), np.abs(all_j))])
    symbol, waves = fft.fft2(wrapped).real, []
    for n, d in zip(shape, (dx, dy), strict=True):
        images = math.ceil(REACH * s * d / math.pi) + 1
        waves.append(2 * np.pi * (np.fft.fftfreq(n) + np.arange(-images, images + 1)[:, None]) / d)
    for qx, qy in product(*waves):
        q = np.hypot(qx[:, None], qy)
        carried = np.outer(np.sinc(qx * dx / (2 * np.pi)), np.sinc(qy * dy / (2 * np.pi)))
        symbol += np.where(q > 0, 2 * np.pi / np.where(q > 0, q, 1.0) * carried * erfc(q / (2 * s)), 0.0)
    symbol[0, 0] = 0
    return symbol


def symbol_of(grid: Grid, modulus: float, periodic: bool) -> np.ndarray:
    """Return eigenvalues [m/Pa] of B by the judge's own formulas, on the mesh if periodic, else on one of twice it."""
    unit = math.sqrt(grid.cell_area)
    dx, dy = grid.dx / unit, grid.dy / unit
    factor = np.longdouble(unit) / (np.longdouble(np.pi) * np.longdouble(modulus))
    if periodic:
        return factor * ewald(grid, dx, dy)
    # The offset n in the middle of the padding is never used, so its value does not matter.
    i, j = (np.minimum(n - 1, np.minimum(np.arange(2 * n), 2 * n - np.arange(2 * n))) for n in grid.shape)
    x, y = (np.arange(n, dtype=np.longdouble) * d for n, d in zip(grid.shape, (dx, dy), strict=True))
    return fft.fft2(factor * love(x[:, None], y[None, :], dx, dy)[i][:, j]).real


def judge(
    trial: Trial,
    symbol: np.ndarray,
    u_bar: np.ndarray,
    tolerance: float,
    hardness: float,
    solution: ContactSolution,
    slack: float,
) -> None:
    """Check the conditions of contact node by node.

    Lengths are compared with tolerance ||max(u_bar, 0)|| plus the rounding of the judge. In a periodic cell B_00 ||p||
    replaces the norm where it is larger: a mean pressure causes no displacement there. slack : [m] more rounding
    """
    p, plastic, (nx, ny) = solution.pressure, solution.plastic_displacement, u_bar.shape
    for field in (p, solution.gap, plastic):
        assert field.shape == u_bar.shape, "fields of another shape"
        assert field.dtype == np.float64, "fields of another type"
        assert np.isfinite(field).all(), "fields that are not finite"
    lifted = fft.ifft2(fft.fft2(p.astype(np.longdouble), symbol.shape) * symbol).real[:nx, :ny]
    elastic, lift = lifted - u_bar, symbol.mean() * p  # the gap without plastic displacement, and B_00 p
    gap = elastic + plastic
    unmet = lift - np.clip(lift - elastic, 0, symbol.mean() * np.longdouble(hardness))
    reach = max(norm(np.maximum(u_bar, 0)), norm(lift) if symbol.shape == u_bar.shape else 0)
    rounding = ROUNDING * (np.abs(lifted) + np.abs(u_bar)) + slack
    allowed = tolerance * reach + norm(np.where(unmet != 0, rounding, 0))
    trial.check("the residual", norm(unmet), allowed)
    trial.check("p >= 0", -p.min())
    trial.check("p <= H", p.max() - hardness)
    trial.check("gap >= 0", -gap.min(), allowed)
    trial.check("gap = 0 where p > 0", np.abs(gap[p > 0]).max(initial=0), allowed)
    trial.check("u_plastic >= 0", -plastic.min())
    trial.check("u_plastic = 0 where p < H", plastic[p < hardness].max(initial=0))
    trial.check("its gap is B p - u_bar + u_plastic", np.abs(solution.gap - gap).max(), allowed + rounding.max())
    trial.check("its residual", solution.residual, tolerance)


def norm(field: np.ndarray) -> np.longdouble:
    """Return the norm in long doubles; that of numpy is in doubles."""
    return np.sqrt((field**2).sum())
