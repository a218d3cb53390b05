"""Campaign of contact: random problems, each solution judged by displacements in extended precision.

Meshes, surfaces, planes, loads and hardnesses have units far apart: heights over cells go from 1e-12 / 1e3 to
1e3 / 1e-9. The problem is linear in heights and modulus, so that a solver with a fixed length or pressure fails here.

Free half-space: Love's coefficients as in Johnson, Contact Mechanics, section 3.5, with logarithms at the corners of
the cell, and padded transforms, all in long doubles. Beyond four long edges of a cell, where the logarithms cancel,
Gauss's quadrature of 1/r replaces them. Periodic cell: Ewald's method (Ann. Phys. 369 (1921) 253),
1/r = erfc(s r)/r + erf(s r)/r. The first part is summed over the images within its reach, the second over waves.

Where long doubles are doubles (some ARM and Windows machines) ROUNDING is too small for cells of large aspect.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from scipy import fft
from scipy.special import erf, erfc

from roughslip.contact.influence import Influence
from roughslip.contact.solve import ContactSolution, solve, solve_load, sweep
from roughslip.errors import ConvergenceError, RoughslipError
from roughslip.grid import Grid
from workflow.stress.runner import Conditions, Problem, Verdict, choose, log_uniform, verdict_of

DEMANDED = 1e-10  # Every problem must reach this residual. Short of a tighter tolerance, an error is an answer.
LEAST_HARDNESS = 1.02  # mean pressures; at 1 all nodes yield

ROUNDING = 8 * np.finfo(np.float64).eps  # of displacements at a node: coefficients and z - plane
LOAD_ROUNDING = 1e-12  # The load is a sum of at most 16384 doubles.
FAR = 4.0  # long edges of a cell beyond which quadrature replaces the closed form: 8 nodes an axis leave 16^-16
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
REACH = 6.2  # erfc(6.2) < 2e-18

MOST_NODES = 128  # on an axis
TOLERANCES = (1e-10, 1e-3, 1e-6, 1e-12)
TOLERANCE_SHARES = (0.7, 0.1, 0.1, 0.1)

RANDOM = ("gaussian", "exponential", "white")
ADVERSARIAL = ("ties", "constant", "checkerboard", "spike", "one-node", "step", "tilted", "touching")
SURFACES = (*RANDOM, *ADVERSARIAL)
SURFACE_SHARES = np.array([5.0, 5.0, 4.0, *[0.75] * len(ADVERSARIAL)])

CONTROLS = ("plane", "load", "periodic-load", "sweep")
CONTROL_SHARES = (0.55, 0.2, 0.15, 0.1)


def problem(seed: int, number: int) -> Problem:
    """Return the problem of this number. Only tolerances below DEMANDED may be missed, if DEMANDED is reached."""
    generator = np.random.default_rng([seed, number])
    control = choose(generator, CONTROLS, CONTROL_SHARES)
    surface = choose(generator, SURFACES, SURFACE_SHARES / SURFACE_SHARES.sum())
    grid = _mesh(generator)
    if grid.size == 1 and control == "periodic-load":  # The package refuses one node in a periodic cell.
        control = "load"
    scale, modulus = log_uniform(generator, -12, 3), log_uniform(generator, -3, 15)
    tolerance = choose(generator, TOLERANCES, TOLERANCE_SHARES)
    length = log_uniform(generator, -0.5, math.log10(2 * max(grid.shape)))  # in the shorter edge of a cell
    torus = grid.shape if control == "periodic-load" and generator.random() < 0.5 else None
    heights = _heights(generator, surface, grid, length, torus)
    if generator.random() < 0.15:  # another zero of the heights
        heights += generator.choice((-1.0, 1.0)) * log_uniform(generator, -1, 2)
    heights *= scale
    planes: tuple[float | None, ...] = (None,)
    load = None
    if control.endswith("load"):  # E* times the range of heights over the edge of the mesh, times 1e-4 to 1e3
        rise = (float(np.ptp(heights)) or scale) / math.sqrt(grid.size * grid.cell_area)
        load = log_uniform(generator, -4, 3) * modulus * rise
    else:
        count = generator.integers(2, 7) if control == "sweep" else 1
        planes = tuple(_plane(generator, surface, heights, scale) for _ in range(count))
    cap = log_uniform(generator, -2, 1) if generator.random() < 0.4 else math.inf
    periodic = control == "periodic-load"

    def solve_at(tolerance: float, hardness: float) -> list[ContactSolution]:
        on = Influence(grid, modulus, periodic=periodic)
        if load is not None:
            return [solve_load(on, heights, load, tolerance, hardness_pa=hardness)]
        if control == "sweep":
            return list(sweep(on, heights, planes, tolerance, hardness))
        return [solve(on, heights - planes[0], tolerance, hardness_pa=hardness)]

    def solved() -> tuple[list[ContactSolution], float]:
        """Return a solution for each plane, and the hardness [Pa]: `cap` times the elastic peak pressure."""
        hardness = math.inf
        if math.isfinite(cap):
            peak = max(float(elastic.pressure.max()) for elastic in solve_at(1e-3, math.inf))
            hardness = max(cap * peak, LEAST_HARDNESS * (load or 0.0)) or modulus
        return solve_at(tolerance, hardness), hardness

    def judged(found: tuple[list[ContactSolution], float]) -> Verdict:
        solutions, hardness = found
        judge_one = partial(judge, Displacement(grid, modulus, periodic), heights, load, tolerance, hardness)
        verdicts = list(map(judge_one, solutions, planes))
        broken = (f"plane {k}: {what}" for k, verdict in enumerate(verdicts) for what in verdict.broken)
        return Verdict(max(verdict.residual for verdict in verdicts), tuple(broken))

    case = {"tolerance": tolerance, "control": control, "surface": surface, "nx": grid.nx, "ny": grid.ny, "cap": cap}

    def is_answer(error: RoughslipError) -> bool:
        return isinstance(error, ConvergenceError) and tolerance < DEMANDED and error.residual <= DEMANDED

    return Problem(case, solved, judged, is_answer)


def _mesh(generator: np.random.Generator) -> Grid:
    """Draw rectangles, rows of nodes, squares and large meshes; cells of aspect 1/100 to 100."""
    kind = generator.random()
    nx, ny = (round(MOST_NODES ** generator.random()) for _ in range(2))
    if kind < 0.15:
        nx, ny = (1, ny) if generator.random() < 0.5 else (nx, 1)
    elif kind < 0.35:
        ny = nx
    elif kind < 0.55:
        nx, ny = (int(n) for n in generator.integers(MOST_NODES // 2, MOST_NODES + 1, 2))
    edge = log_uniform(generator, -9, 3)
    aspect = 1.0 if generator.random() < 0.4 else log_uniform(generator, -2, 2)
    return Grid(int(nx), int(ny), edge * max(aspect, 1.0), edge * max(1 / aspect, 1.0))


def _heights(
    generator: np.random.Generator, surface: str, grid: Grid, length: float, torus: tuple[int, int] | None
) -> np.ndarray:
    """Draw (nx, ny) heights of order one."""
    i, j = np.meshgrid(*(np.arange(n, dtype=np.float64) for n in grid.shape), indexing="ij")
    some = tuple(int(generator.integers(n)) for n in grid.shape)
    match surface:
        case "white":
            return generator.standard_normal(grid.shape)
        case "gaussian" | "exponential" | "touching":
            return _correlated(generator, surface, grid, length, torus)
        case "ties":
            levels = generator.integers(1, 5)
            return np.round(levels * _correlated(generator, "gaussian", grid, length, torus)) / levels
        case "constant":
            return np.full(grid.shape, generator.choice((-1.0, 0.0, 1.0, 1 / 3)))
        case "checkerboard":
            period = int(generator.integers(1, 4))
            return np.where((i // period + j // period) % 2 == 0, 1.0, -1.0)
        case "spike" | "one-node":
            low = 0.0 if surface == "spike" else 1e-3 * generator.standard_normal(grid.shape)
            return np.where((i == some[0]) & (j == some[1]), 1.0, low)
        case "step":
            return np.where(i + (j if generator.random() < 0.5 else 0) < some[0] + 1, 1.0, 0.0)
        case _:
            return generator.standard_normal() * i / grid.nx + generator.standard_normal() * j / grid.ny


def _correlated(
    generator: np.random.Generator, kind: str, grid: Grid, length: float, torus: tuple[int, int] | None
) -> np.ndarray:
    """Filter white noise on a torus of twice the mesh, or of the mesh itself."""
    m, n = torus or (2 * grid.nx, 2 * grid.ny)
    edge = length * min(grid.dx, grid.dy)
    x, y = (np.minimum(np.arange(k), k - np.arange(k)) * d / edge for k, d in ((m, grid.dx), (n, grid.dy)))
    r = np.hypot(x[:, None], y)
    spectrum = fft.rfft2(np.exp(-r) if kind == "exponential" else np.exp(-(r**2))).real
    root = np.sqrt(np.maximum(spectrum, 0.0))
    return fft.irfft2(fft.rfft2(generator.standard_normal((m, n))) * root, (m, n))[: grid.nx, : grid.ny].copy()


def _plane(generator: np.random.Generator, surface: str, heights: np.ndarray, scale: float) -> float:
    """Draw a plane: among the heights by their share above it, or below all of them."""
    if surface == "touching":
        return float(heights.max())
    if surface == "one-node" and heights.size > 1:
        second, highest = np.sort(heights, axis=None)[-2:]
        return float(second + generator.random() * (highest - second))
    if generator.random() < 0.15 or (surface == "constant" and generator.random() < 0.7):
        return float(heights.min() - log_uniform(generator, -3, 3) * (float(np.ptp(heights)) or scale))
    limit = math.log(0.9999 / 0.0001)
    return float(np.percentile(heights, 100 - 100 / (1 + math.exp(generator.uniform(-limit, limit)))))


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
            self.torus = grid.shape
            self.symbol = factor * _ewald(grid.shape, dx, dy)
            self.diagonal = self.symbol.mean()
            return
        i, j = (np.arange(n, dtype=np.longdouble) for n in grid.shape)
        quadrant = factor * love((i * dx)[:, None], (j * dy)[None, :], dx, dy)
        # The offset n in the middle of the padding is never used, so its value does not matter.
        k, m = (np.minimum(n - 1, np.minimum(np.arange(2 * n), 2 * n - np.arange(2 * n))) for n in grid.shape)
        self.torus = (2 * grid.nx, 2 * grid.ny)
        self.symbol = fft.fft2(quadrant[k][:, m]).real
        self.diagonal = quadrant[0, 0]

    def __call__(self, pressure: np.ndarray) -> np.ndarray:
        """Return displacements (nx, ny) [m] in long doubles under pressures (nx, ny) [Pa]."""
        transform = fft.fft2(pressure.astype(np.longdouble), self.torus)
        return fft.ifft2(transform * self.symbol).real[: self.grid.nx, : self.grid.ny]


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
    displacement: Displacement,
    heights: np.ndarray,
    load: float | None,
    tolerance: float,
    hardness: float,
    solution: ContactSolution,
    plane: float | None,
) -> Verdict:
    """Return the relative residual of a solution and the conditions of contact that it breaks, node by node.

    plane : [m] the required one; None under a load [Pa], where the solution gives it

    All lengths are compared with tolerance ||max(u_bar, 0)|| plus the rounding of the judge. In a periodic cell
    B_00 ||p|| replaces the norm where it is larger.
    """
    height = solution.plane if plane is None else plane
    p, plastic = solution.pressure, solution.plastic_displacement
    fields_ = (p, solution.gap, plastic)
    if not all(f.shape == displacement.grid.shape and f.dtype == np.float64 and np.isfinite(f).all() for f in fields_):
        return Verdict(math.inf, ("fields of another shape, or not finite",))
    lifted = displacement(p)
    u_bar = heights.astype(np.longdouble) - np.longdouble(height)
    elastic = lifted - u_bar  # the gap without plastic displacement
    gap = elastic + plastic
    lift, highest = displacement.diagonal * p, displacement.diagonal * np.longdouble(hardness)
    unmet = lift - np.clip(lift - elastic, 0, highest)
    reach = _norm(np.maximum(u_bar, 0))
    if displacement.periodic:  # A mean pressure causes no displacement there, and u_bar may be far below B_00 p.
        reach = max(reach, _norm(lift))
    node_rounding = ROUNDING * (np.abs(lifted) + np.abs(u_bar) + (abs(height) if plane is None else 0.0))
    allowed = tolerance * reach + _norm(np.where(unmet != 0, node_rounding, 0))
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
        "its residual": (solution.residual, tolerance),
    }
    if load is not None:
        conditions["the load"] = (abs(p.astype(np.longdouble).mean() / load - 1), LOAD_ROUNDING)
    return verdict_of(conditions, residual)


def _norm(field: np.ndarray) -> np.longdouble:
    return np.sqrt((field**2).sum())
