"""Samples of the square, and their contact with the plane at one penetration."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from roughslip import store
from roughslip.chaos.variables import latin_hypercube
from roughslip.contact.at_nodes import NodePressures, solve_at
from roughslip.contact.edge import point_pressures
from roughslip.contact.influence import Influence
from roughslip.contact.solve import SMALL, solve
from roughslip.grid import Grid
from roughslip.limits import designs_of
from roughslip.scene.types import Scene
from roughslip.study import skip_reasons
from roughslip.study.from_scene import elastic, geometry, surface_model
from roughslip.study.from_scene.geometry import Nodes
from roughslip.study.from_scene.streams import Stream
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


def variables_of(seed: int, number: int, modes: int) -> np.ndarray:
    """xi : (modes,) of a Monte Carlo sample by its number."""
    return np.random.default_rng([seed, Stream.MONTE_CARLO, number]).standard_normal(modes)


def latin_hypercubes(scene: Scene, modes: int) -> Iterator[np.ndarray]:
    """xi : (samples, modes) of each of the designs that the paper's equations are fitted to, the first as if alone."""
    seed = [scene.seed, Stream.LATIN_HYPERCUBE]
    for number, part in enumerate(designs_of(scene.square.latin_hypercube_samples)):
        generator = np.random.default_rng([*seed, number] if number else seed)
        yield latin_hypercube(generator, part.stop - part.start, modes)


def training_design(scene: Scene, modes: int) -> np.ndarray:
    """xi : (samples, modes) of the design that our expansion is fitted to."""
    generator = np.random.default_rng([scene.seed, Stream.EXPANSION_DESIGN])
    return latin_hypercube(generator, scene.expansion.samples, modes)


def square(job: Job) -> Square:
    """The square of a stage that was given the modes as --surface."""
    scene = job.scene
    model, grid = surface_model.gaussian_model(scene, job.optional("scan")), geometry.square_grid(scene)
    return Square(
        model,
        grid,
        store.read(job.path("surface"))["modes"],
        float(model.plane_height(PENETRATION)),
        elastic.influence(scene, grid),
        scene.numerics.contact_tolerance,
        elastic.hardness_pa(scene),
    )


def solved(problem: Square, xi: Iterable[np.ndarray], count: int, nodes: Nodes, job: Job) -> dict[str, store.Variable]:
    """Pressure, with the mesh error at edges and without it, and gap at some nodes of every sample.

    xi : `count` samples (M,) of the variables of the modes
    """
    pressure, point, gap = np.empty((3, count, len(nodes.x)))
    kept, apart = (nodes.x, nodes.y), 0
    for row, variables in enumerate(xi):
        rough = problem.model.heights(heights(problem.modes, variables)) - problem.plane_m
        solution = solve(problem.influence, rough, problem.tolerance, hardness_pa=problem.hardness_pa)
        apart += solution.method == "none"
        pressure[row], gap[row] = solution.pressure[kept], solution.signed_gap[kept]
        point[row] = point_pressures(solution.pressure, kept)
        job.progress(row + 1, count)
    job.count(solves=count)
    job.skip({skip_reasons.NO_CONTACT: apart})
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
    points = elastic.counts_shares(job.scene)
    pressure, error = np.empty((2, count, len(nodes.x)))
    kept = nodes.x, nodes.y
    there = np.ascontiguousarray(problem.modes[:, *kept, None])
    is_small = problem.grid.size <= SMALL  # the whole surface is then as quick as these nodes
    nothing = np.zeros(len(nodes.x))
    methods: Counter[str] = Counter()
    work = 0
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
        methods[bounds.method] += 1
        work += bounds.work
        job.progress(row + 1, count)
    job.count(surfaces=count, solves=count - methods["none"], products=work)
    job.skip({skip_reasons.NODES_BELOW: methods["none"], skip_reasons.NODES_KNOWN: methods["bounded"]})
    return {
        "pressure": store.Variable(("sample", "node"), pressure, "Pa", POINT if points else PRESSURE),
        "pressure_error": store.Variable(("sample", "node"), error, "Pa", "width of the bounds of the cell's pressure"),
    }
