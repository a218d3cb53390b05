"""Random fields on meshes: covariances, lays and units, and what is computed of them.

Heights and cells are drawn from 1e-12 m to 1e3 m, each for itself. The problem is linear in the variance, and only
lengths over cells count.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from roughslip.grid import Grid
from roughslip.surface.covariance import Covariance
from roughslip.surface.models import KINDS, covariance_of
from workflow.stress.runner import choose, log_uniform

ENTRIES = ("expansion", "lanczos", "embedding")
ENTRY_SHARES = (0.5, 0.2, 0.3)
MOST_NODES = 24  # on an axis of a mesh
LONGEST_LINE = 200
MOST_EMBEDDED = 60_000  # nodes of a torus that holds the reach of the covariance on both sides
FURTHEST = 300.0  # correlation lengths across a mesh of a self-affine field, which the judge integrates wave by wave


@dataclass(frozen=True)
class FieldProblem:
    """A field on a mesh.

    number, entry : of the problem, of ENTRIES
    grid, covariance : of the field
    order, share : of the expansion, one of them; both None for an embedding
    """

    number: int
    entry: str
    grid: Grid
    covariance: Covariance
    order: int | None
    share: float | None


def random_problem(seed: int, number: int) -> FieldProblem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number])
    entry = choose(generator, ENTRIES, ENTRY_SHARES)
    while True:
        grid = _mesh(generator, 4 if entry == "lanczos" else 1)
        covariance = random_covariance(generator, grid)
        if entry != "embedding" or _torus(covariance, grid) <= MOST_EMBEDDED:
            break
    order = share = None
    if entry == "lanczos":
        order = int(generator.integers(1, grid.size // 4 + 1))
    elif entry == "expansion":
        if generator.random() < 0.35:
            share = choose(generator, (1.0, float(generator.uniform(1e-6, 1.0)), 1.0 - log_uniform(generator, -9, -1)))
        else:
            order = grid.size if generator.random() < 0.3 else int(generator.integers(1, grid.size + 1))
    return FieldProblem(number, entry, grid, covariance, order, share)


def random_covariance(generator: np.random.Generator, grid: Grid) -> Covariance:
    """Draw a covariance of any kind, from far shorter than a cell to far longer than the mesh."""
    kind = choose(generator, KINDS)
    cell = math.sqrt(grid.cell_area)
    length = cell * log_uniform(generator, -1, 2) if generator.random() < 0.9 else cell * log_uniform(generator, -3, 4)
    across = length * log_uniform(generator, -1.5, 1.5) if generator.random() < 0.4 else length
    if kind == "self_affine":
        least = max(grid.nx * grid.dx, grid.ny * grid.dy) / FURTHEST
        length, across = max(length, least), max(across, least)
    lay = choose(generator, (0.0, math.pi / 2, math.pi / 4, float(generator.uniform(-4, 4))), (0.4, 0.1, 0.1, 0.4))
    smoothness = (
        choose(generator, (0.05, 0.5, 1.5, 20.0, log_uniform(generator, -1.3, 1.3))) if kind == "matern" else None
    )
    hurst = bandwidth = None
    if kind == "self_affine":
        hurst = choose(generator, (0.01, 0.5, 1.0, float(generator.uniform(0.01, 1.0))), (0.1, 0.1, 0.1, 0.7))
        bandwidth = 1.0 + (
            log_uniform(generator, -5, -1) if generator.random() < 0.05 else log_uniform(generator, -1, 2)
        )
    return covariance_of(
        kind,
        log_uniform(generator, -12, 3),
        length,
        across,
        lay,
        smoothness=smoothness,
        hurst=hurst,
        bandwidth=bandwidth,
    )


def _mesh(generator: np.random.Generator, least: int) -> Grid:
    """Draw rectangles, lines and squares; cells of aspect 1/30 to 30, of 1e-12 to 1e3 m."""
    nx = ny = 0
    while nx * ny < least:
        kind = generator.random()
        nx, ny = (round(MOST_NODES ** generator.random()) for _ in range(2))
        if kind < 0.2:
            line = round(LONGEST_LINE ** generator.random())
            nx, ny = (1, line) if generator.random() < 0.5 else (line, 1)
        elif kind < 0.45:
            ny = nx
    edge = log_uniform(generator, -12, 3)
    aspect = 1.0 if generator.random() < 0.5 else log_uniform(generator, -1.5, 1.5)
    return Grid(nx, ny, edge * max(aspect, 1.0), edge * max(1 / aspect, 1.0))


def _torus(covariance: Covariance, grid: Grid) -> float:
    """Return about the number of nodes of the largest torus that an embedding may reach."""
    if covariance.kind == "self_affine":
        return (
            10.0
            * grid.size
            * max(1.0, max(covariance.rolloff_wavelengths_m) / min(grid.nx * grid.dx, grid.ny * grid.dy)) ** 2
        )
    reach = covariance.reach_m
    return (grid.nx + 2 * reach[0] / grid.dx) * (grid.ny + 2 * reach[1] / grid.dy)
