"""Contact of samples of the square with the plane, at one penetration."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from roughslip import store
from roughslip.contact.influence import Influence
from roughslip.contact.solve import ContactSolution, solve
from roughslip.grid import Grid
from roughslip.stages.from_scene import elastic, geometry, surface_model
from roughslip.stages.from_scene.geometry import Nodes
from roughslip.stages.runtime.command import Job
from roughslip.surface.karhunen_loeve import heights
from roughslip.surface.model import GaussianModel

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


def square(job: Job) -> Square:
    """The square of a stage that was given the modes as --surface."""
    scene = job.scene
    model, grid = surface_model.gaussian_model(scene, job.arguments.scan), geometry.square_grid(scene)
    return Square(
        model,
        grid,
        store.read(job.arguments.surface)["modes"],
        float(model.plane_height(scene.square.penetration_percentile)),
        elastic.influence(scene, grid),
        scene.numerics.contact_tolerance,
        elastic.hardness_pa(scene),
    )


def solutions(problem: Square, xi: Iterable[np.ndarray], count: int, job: Job) -> Iterator[ContactSolution]:
    """The contact of every sample with the plane.

    xi : `count` samples (M,) of the variables of the modes
    """
    skipped = elastic.empty_skip_counts()
    for number, one in enumerate(xi):
        rough = problem.model.heights(heights(problem.modes, one)) - problem.plane_m
        solution = solve(problem.influence, rough, problem.tolerance, hardness_pa=problem.hardness_pa)
        elastic.count_solve(skipped, solution)
        yield solution
        job.usage.progress(number + 1, count)
    job.usage.count(solves=count)
    job.usage.skip(skipped)


def solved(problem: Square, xi: Iterable[np.ndarray], count: int, nodes: Nodes, job: Job) -> dict[str, store.Variable]:
    """Pressure and gap at some nodes, area fraction, mean pressure and residual of every sample.

    xi : `count` samples (M,) of the variables of the modes
    """
    pressure, gap = np.empty((count, len(nodes.x))), np.empty((count, len(nodes.x)))
    area, mean_pressure, residual = np.empty(count), np.empty(count), np.empty(count)
    effort = np.empty(count, dtype=np.int32)
    kept = nodes.x, nodes.y
    for row, solution in enumerate(solutions(problem, xi, count, job)):
        pressure[row], gap[row] = solution.pressure[kept], solution.signed_gap[kept]
        area[row] = np.count_nonzero(solution.pressure) / problem.grid.size
        mean_pressure[row], residual[row] = solution.pressure.mean(), solution.residual
        effort[row] = solution.work
    return {
        "pressure": store.Variable(("sample", "node"), pressure, "Pa", "contact pressure at nodes around the centre"),
        "gap": store.Variable(("sample", "node"), gap, "m", GAP),
        "area_fraction": store.Variable(("sample",), area, "1", "share of the nodes in contact"),
        "mean_pressure": store.Variable(("sample",), mean_pressure, "Pa", "mean pressure on the square"),
        "residual": store.Variable(("sample",), residual, "1", "relative residual of the complementarity"),
        "work": store.Variable(("sample",), effort, "1", "work of the solver, as its method counts it"),
    }
