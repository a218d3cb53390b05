"""Stage contact_square: contact of a batch of samples of the square with the plane, at one penetration."""

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np

from roughslip import store
from roughslip.contact.at_nodes import solve_at
from roughslip.contact.edge import point_pressures
from roughslip.contact.solve import solve
from roughslip.grid import Grid
from roughslip.scene.part import Scene
from roughslip.study.from_scene import elastic, geometry, surface_model
from roughslip.study.from_scene.geometry import Nodes, latin_hypercubes, training_design, variables_of
from roughslip.study.job import Job
from roughslip.surface.modes import heights

PENETRATION = 50.0  # [%] of the heights are above the plane
PRECISION = 1e-3  # width of the bounds of a pressure over the pressure; errors are then a tenth of that
AT_ONCE = 64  # samples; no result depends on it
PRESSURE = "contact pressure at nodes around the centre"
POINT = f"{PRESSURE}, less the mesh error at edges"
GAP = "gap at nodes around the centre, below zero the plastic displacement"


def work(scene: Scene, job: Job) -> None:
    """Write the pressure around the centre of every sample, and of a design that trains the expansion the gap."""
    model, grid = surface_model.gaussian_model(scene, job.optional("scan")), geometry.square_grid(scene)
    modes, plane = store.read(job.path("surface"))["modes"], float(model.plane_height(PENETRATION))

    def above(xi: np.ndarray, modes: np.ndarray) -> np.ndarray:
        """Heights (k, nx, ny) [m] above the plane, of samples (k, M) of the variables of the modes (M, nx, ny) [m]."""
        return np.asarray(model.heights(heights(modes, xi)) - plane)

    central, count = geometry.central_nodes(model.lengths_m, grid), len(modes)
    if job.design == "expansion":
        rough = (above(xi[None], modes)[0] for xi in training_design(scene, count)[job.numbers])
        variables = solved(job, grid, rough, geometry.training_nodes(model.lengths_m, grid))
    elif job.design == "latin_hypercube":
        first = geometry.Nodes(*(part[:1] for part in central))  # a design is balanced at one node only
        designs = np.concatenate(list(latin_hypercubes(scene, count)))
        variables = pressures_at(job, grid, modes, above, lambda numbers: designs[numbers], first)
    else:
        drawn = partial(variables_of, scene.seed, modes=count)
        variables = pressures_at(job, grid, modes, above, drawn, central)
    store.write(job.output, variables, job.key, {"first": job.numbers.start, "design": job.design})


def solved(job: Job, grid: Grid, rough: Iterable[np.ndarray], nodes: Nodes) -> dict[str, store.Variable]:
    """Pressure, with the mesh error at edges and without it, and gap at some nodes of every sample.

    rough : heights (nx, ny) [m] of each above the plane
    """
    scene, kept, count = job.scene, (nodes.x, nodes.y), len(job.numbers)
    influence, hardness = elastic.influence(scene, grid), elastic.hardness_pa(scene)
    pressure, point, gap = np.empty((3, count, len(nodes.x)))
    for row, above in enumerate(rough):
        solution = solve(influence, above, scene.numerics.contact_tolerance, hardness_pa=hardness)
        pressure[row], gap[row] = solution.pressure[kept], solution.signed_gap[kept]
        point[row] = point_pressures(solution.pressure, kept)
        job.progress(row + 1, count)
    job.count(solves=count)
    gap[(pressure == 0) & (gap < 0)] = 0.0  # within the tolerance of a solve a gap may lie below zero
    return {
        "pressure": store.Variable(("sample", "node"), pressure, "Pa", PRESSURE),
        "point_pressure": store.Variable(("sample", "node"), point, "Pa", POINT),
        "gap": store.Variable(("sample", "node"), gap, "m", GAP),
    }


def pressures_at(
    job: Job,
    grid: Grid,
    modes: np.ndarray,
    above: Callable[[np.ndarray, np.ndarray], np.ndarray],
    drawn: Callable[[range], np.ndarray],
    nodes: Nodes,
) -> dict[str, store.Variable]:
    """Pressure at some nodes of every sample, and no more than that takes.

    above : heights [m] above the plane, by variables and modes; drawn : variables (k, M) of samples by their numbers
    """
    scene, kept, count = job.scene, (nodes.x, nodes.y), len(job.numbers)
    influence, points = elastic.influence(scene, grid), elastic.counts_shares(scene)
    options: Any = {"hardness_pa": elastic.hardness_pa(scene), "points": points}
    pressure, error = np.zeros((2, count, len(nodes.x)))
    there = np.ascontiguousarray(modes[:, *kept, None])
    solves = work = 0
    for first in range(0, count, AT_ONCE):
        xi = drawn(job.numbers[first : first + AT_ONCE])
        touching = np.flatnonzero((above(xi, there) > 0.0).any(axis=(1, 2)))
        bounds = solve_at(
            influence, above(xi[touching], modes), kept, PRECISION, scene.numerics.contact_tolerance, **options
        )
        pressure[first + touching], error[first + touching] = bounds.pressure, bounds.high - bounds.low
        solves, work = solves + len(touching), work + int(bounds.work.sum())
        job.progress(first + len(xi), count)
    job.count(surfaces=count, solves=solves, products=work)
    title = "width of the bounds of the cell's pressure"
    return {
        "pressure": store.Variable(("sample", "node"), pressure, "Pa", POINT if points else PRESSURE),
        "pressure_error": store.Variable(("sample", "node"), error, "Pa", title),
    }
