"""Stage contact_square: contact of a batch of samples of the square with the plane, at one penetration."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from roughslip import store
from roughslip.contact.at_nodes import NodePressures, solve_at
from roughslip.contact.dense_solver import SMALL
from roughslip.contact.edge import point_pressures
from roughslip.contact.influence import Influence
from roughslip.contact.solve import solve
from roughslip.grid import Grid
from roughslip.scene.types import Scene
from roughslip.study.from_scene import geometry, surface_model
from roughslip.study.from_scene.geometry import Nodes, latin_hypercubes, training_design, variables_of
from roughslip.study.job import Job
from roughslip.surface.model import GaussianModel
from roughslip.surface.modes import heights

PENETRATION = 50.0  # [%] of the heights are above the plane
PRECISION = 1e-3  # width of the bounds of a pressure over the pressure; errors are then a tenth of that
PRESSURE = "contact pressure at nodes around the centre"
POINT = f"{PRESSURE}, less the mesh error at edges"
GAP = "gap at nodes around the centre, below zero the plastic displacement"


@dataclass(frozen=True)
class Square:
    """The square and the plane.

    model, grid : surfaces, and the mesh of the square
    modes : (M, nx, ny) [m] scaled Karhunen-Loeve modes
    plane_m : [m] height of the plane
    influence : of a pressure on displacements
    tolerance : [-] of a solve
    hardness_pa : [Pa] highest pressure
    """

    model: GaussianModel
    grid: Grid
    modes: np.ndarray
    plane_m: float
    influence: Influence
    tolerance: float
    hardness_pa: float


def work(scene: Scene, job: Job) -> None:
    """Write the pressure around the centre of every sample, and of a design that trains the expansion the gap."""
    numbers, problem = job.numbers, square(job)
    modes, count, lengths = len(problem.modes), len(job.numbers), problem.model.lengths_m
    if job.design == "expansion":
        xi = training_design(scene, modes)[numbers]
        variables = solved(problem, xi, count, geometry.training_nodes(lengths, problem.grid), job)
    elif job.design == "latin_hypercube":
        xi = np.concatenate(list(latin_hypercubes(scene, modes)))[numbers]
        nodes = geometry.central_nodes(lengths, problem.grid)
        first = geometry.Nodes(*(part[:1] for part in nodes))  # a design is balanced at one node only
        variables = pressures_at(problem, xi, count, first, job)
    else:
        drawn = (variables_of(scene.seed, number, modes) for number in numbers)
        variables = pressures_at(problem, drawn, count, geometry.central_nodes(lengths, problem.grid), job)
    store.write(job.output, variables, job.key, {"first": job.numbers.start, "design": job.design})


def square(job: Job) -> Square:
    """The square of a stage that was given the modes as --surface."""
    scene = job.scene
    model, grid = surface_model.gaussian_model(scene, job.optional("scan")), geometry.square_grid(scene)
    return Square(
        model,
        grid,
        store.read(job.path("surface"))["modes"],
        float(model.plane_height(PENETRATION)),
        geometry.influence(scene, grid),
        scene.numerics.contact_tolerance,
        geometry.hardness_pa(scene),
    )


def solved(problem: Square, xi: Iterable[np.ndarray], count: int, nodes: Nodes, job: Job) -> dict[str, store.Variable]:
    """Pressure, with the mesh error at edges and without it, and gap at some nodes of every sample.

    xi : `count` samples (M,) of the variables of the modes
    """
    pressure, point, gap = np.empty((3, count, len(nodes.x)))
    kept = nodes.x, nodes.y
    for row, variables in enumerate(xi):
        rough = problem.model.heights(heights(problem.modes, variables)) - problem.plane_m
        solution = solve(problem.influence, rough, problem.tolerance, hardness_pa=problem.hardness_pa)
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
    problem: Square, xi: Iterable[np.ndarray], count: int, nodes: Nodes, job: Job
) -> dict[str, store.Variable]:
    """Pressure at some nodes of every sample, and no more than that takes.

    xi : `count` samples (M,) of the variables of the modes
    """
    points = geometry.counts_shares(job.scene)
    pressure, error = np.empty((2, count, len(nodes.x)))
    kept = nodes.x, nodes.y
    there = np.ascontiguousarray(problem.modes[:, *kept, None])
    is_small = problem.grid.size <= SMALL  # the whole surface is then as quick as these nodes
    nothing = np.zeros(len(nodes.x))
    solves = work = 0
    for row, variables in enumerate(xi):
        bounds = NodePressures(nothing, nothing, nothing, 0, "none")
        if is_small or (problem.model.heights(heights(there, variables)) > problem.plane_m).any():
            rough = problem.model.heights(heights(problem.modes, variables)) - problem.plane_m
            bounds = solve_at(
                problem.influence,
                rough,
                kept,
                PRECISION,
                problem.tolerance,
                hardness_pa=problem.hardness_pa,
                points=points,
            )
        pressure[row], error[row] = bounds.pressure, bounds.high - bounds.low
        solves += bounds.method != "none"
        work += bounds.work
        job.progress(row + 1, count)
    job.count(surfaces=count, solves=solves, products=work)
    return {
        "pressure": store.Variable(("sample", "node"), pressure, "Pa", POINT if points else PRESSURE),
        "pressure_error": store.Variable(("sample", "node"), error, "Pa", "width of the bounds of the cell's pressure"),
    }
