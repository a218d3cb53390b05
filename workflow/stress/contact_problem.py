"""Random contact problems: meshes, surfaces, planes, loads and hardnesses.

Heights, cells and moduli have units far apart: heights over cells go from 1e-12 / 1e3 to 1e3 / 1e-9. The problem is
linear in the heights and in the modulus, so that a solver that compares with a fixed length or pressure fails here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import fft

from roughslip.grid import Grid
from workflow.stress.runner import choose, log_uniform

MOST_NODES = 128  # on an axis
TOLERANCES = (1e-10, 1e-3, 1e-6, 1e-12)
TOLERANCE_SHARES = (0.7, 0.1, 0.1, 0.1)

RANDOM = ("gaussian", "exponential", "white")
ADVERSARIAL = ("ties", "constant", "checkerboard", "spike", "one-node", "step", "tilted", "touching")
SURFACES = (*RANDOM, *ADVERSARIAL)
SURFACE_SHARES = np.array([5.0, 5.0, 4.0, *[0.75] * len(ADVERSARIAL)])

CONTROLS = ("plane", "load", "periodic-load", "sweep")
CONTROL_SHARES = (0.55, 0.2, 0.15, 0.1)


@dataclass(frozen=True)
class ContactProblem:
    """A rough surface pressed to a plane or by a load.

    number : of the problem
    grid : the mesh
    modulus : E* [Pa]
    heights : (nx, ny) [m]
    surface, control : of SURFACES and CONTROLS
    planes : [m] heights of the plane: several for a sweep, one without, and no plane under a load
    load : mean pressure [Pa], or None
    cap : the hardness over the elastic peak pressure, or infinity
    tolerance : of the residual
    labels : what else names the case
    """

    number: int
    grid: Grid
    modulus: float
    heights: np.ndarray
    surface: str
    control: str
    planes: tuple[float, ...]
    load: float | None
    cap: float
    tolerance: float
    labels: dict[str, str]

    @property
    def periodic(self) -> bool:
        return self.control == "periodic-load"


def random_problem(seed: int, number: int) -> ContactProblem:
    """Return the problem of this number."""
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
    labels = {"length": f"{length:.3g}", "scale": f"{scale:.3g}"}
    planes: tuple[float, ...] = ()
    load = None
    if control.endswith("load"):
        load, labels["level"] = _load(generator, grid, modulus, heights, scale)
    else:
        count = generator.integers(2, 7) if control == "sweep" else 1
        found = [_plane(generator, surface, heights, scale) for _ in range(count)]
        planes, labels["level"] = tuple(plane for plane, _ in found), ",".join(level for _, level in found)
    cap = log_uniform(generator, -2, 1) if generator.random() < 0.4 else math.inf
    return ContactProblem(number, grid, modulus, heights, surface, control, planes, load, cap, tolerance, labels)


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


def _plane(generator: np.random.Generator, surface: str, heights: np.ndarray, scale: float) -> tuple[float, str]:
    """Draw a plane, with the share of the heights above it, or its depth below all of them, as its name."""
    if surface == "touching":
        return float(heights.max()), "touching"
    if surface == "one-node" and heights.size > 1:
        second, highest = np.sort(heights, axis=None)[-2:]
        return float(second + generator.random() * (highest - second)), "one-node"
    if generator.random() < 0.15 or (surface == "constant" and generator.random() < 0.7):
        depth = log_uniform(generator, -3, 3)
        return float(heights.min() - depth * (float(np.ptp(heights)) or scale)), f"full-{depth:.2g}"
    limit = math.log(0.9999 / 0.0001)
    above = 100 / (1 + math.exp(generator.uniform(-limit, limit)))
    return float(np.percentile(heights, 100 - above)), f"{above:.3g}"


def _load(
    generator: np.random.Generator, grid: Grid, modulus: float, heights: np.ndarray, scale: float
) -> tuple[float, str]:
    """Draw a mean pressure, with its ratio to E* times the range of heights over the edge of the mesh."""
    level = log_uniform(generator, -4, 3)
    edge = math.sqrt(grid.size * grid.cell_area)
    return level * modulus * (float(np.ptp(heights)) or scale) / edge, f"{level:.2g}"
