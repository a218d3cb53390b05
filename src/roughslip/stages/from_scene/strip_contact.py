"""Contact of strips with the plane, at every penetration of the scene."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from roughslip import store
from roughslip.contact.edge import contact_shares
from roughslip.contact.influence import Influence
from roughslip.contact.solve import ContactSolution, sweep
from roughslip.grid import Grid
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import elastic, geometry
from roughslip.stages.from_scene.surface_model import SurfaceModel, scan_warnings, strip_fields, surface_model
from roughslip.stages.runtime.command import Job

WINDOWS = {"area": ("m2", "contact area of the window"), "force": ("N", "normal force on the window")}
FINE = ""  # before the names of what the cells of the scene give
COARSE = "coarse_"  # of what cells of twice the edge give on the same strips
MESHES = {FINE: "", COARSE: ", cells of 2 times the edge"}


class Mesh(NamedTuple):
    """Every node of a strip, or every second one. step : between nodes; windows : on these nodes"""

    influence: Influence
    windows: geometry.Windows
    step: int

    def solve(
        self, scene: Scene, heights: np.ndarray, planes: list[float]
    ) -> Iterator[tuple[ContactSolution, np.ndarray]]:
        """Solutions at the planes, each with the share of contact of every cell. heights : (nx, ny) [m] of all nodes"""
        nodes, hardness = slice(self.step // 2, None, self.step), elastic.hardness_pa(scene)
        tolerance = scene.numerics.contact_tolerance
        for solution in sweep(self.influence, heights[nodes, nodes], planes, tolerance, hardness_pa=hardness):
            yield solution, contact_shares(solution.pressure, hardness)


def solve_strips(job: Job, numbers: range) -> None:
    """Write contact area and normal force of every window, and whole training columns of the first strips."""
    scene = job.scene
    grid = geometry.strip_grid(scene)
    model, heights_of = strips_of(job, grid)
    influence = elastic.influence(scene, grid)
    fine = Mesh(influence, geometry.windows(scene), 1)
    meshes = {FINE: fine}
    if scene.numerics.extrapolate_mesh:
        meshes[COARSE] = Mesh(influence.coarser, geometry.windows(scene, 2), 2)
    blocks = replace(fine.windows, length=fine.windows.spacing)
    planes = model.plane_height(np.array(scene.strip.penetration_percentiles)).tolist()
    middle = geometry.middle(scene)
    count, levels = len(numbers), len(planes)
    columns = geometry.training_columns(middle)
    trained = max(0, min(scene.strip.training_samples, numbers.stop) - numbers.start)
    shape = count, levels, fine.windows.count
    sums = {place + name: np.empty(shape) for place in meshes for name in WINDOWS}
    in_blocks = {name: np.empty((count, levels, blocks.count)) for name in WINDOWS}
    of_nodes, corrected = np.empty((2, count, levels))
    residual, effort = np.zeros((count, levels)), np.zeros((count, levels), dtype=np.int32)
    pressure, gap = np.empty((2, trained, levels, len(columns), grid.ny))
    skipped, products = elastic.empty_skip_counts(), 0
    with job.usage.core():
        for row, number in enumerate(numbers):
            heights = heights_of(number)
            for place, mesh in meshes.items():
                for level, (solution, shares) in enumerate(mesh.solve(scene, heights, planes)):
                    elastic.count_solve(skipped, solution)
                    cells = shares if elastic.counts_shares(scene) else solution.contact
                    for name, field in (("area", cells), ("force", solution.pressure)):
                        if place == FINE:
                            in_blocks[name][row, level] = grid.cell_area * blocks.sums(field)
                        sums[place + name][row, level] = mesh.influence.grid.cell_area * mesh.windows.sums(field)
                    products += solution.work
                    residual[row, level] = max(residual[row, level], solution.residual)
                    effort[row, level] += solution.work
                    if place == COARSE:
                        continue
                    of_nodes[row, level] = grid.cell_area * np.count_nonzero(solution.contact[middle])
                    corrected[row, level] = grid.cell_area * shares[middle].sum()
                    if row < trained:
                        pressure[row, level], gap[row, level] = solution.pressure[columns], solution.signed_gap[columns]
            job.usage.progress(row + 1, count)
    job.usage.count(solves=levels * count * len(meshes), convolutions=products)
    job.usage.skip(skipped)
    variables = geometry.window_coordinates(scene, numbers, fine.windows.count)
    variables |= solve_variables(of_nodes, corrected, residual, effort)
    variables |= window_variables(meshes, sums) | block_variables(in_blocks)
    if trained:
        columns_of = ("training_sample", "level", "column", "y")
        variables["pressure"] = store.Variable(columns_of, pressure, "Pa", "contact pressure on the training columns")
        variables["gap"] = store.Variable(columns_of, gap, "m", "gap there, below zero the plastic displacement")
    store.write(job.arguments.output, variables, job.key, {"first": numbers.start})


def strips_of(job: Job, grid: Grid) -> tuple[SurfaceModel, Callable[[int], np.ndarray]]:
    """The surface, and a function that gives the heights (nx, ny) [m] of a strip by its number."""
    scene, scan = job.scene, job.arguments.scan
    model = surface_model(scene, scan)
    if scan is not None:
        job.usage.warn(*scan_warnings(scene, model))
    fields = strip_fields(scene, model, grid)
    return model, lambda number: model.heights(fields(number))


def solve_variables(
    of_nodes: np.ndarray, corrected: np.ndarray, residual: np.ndarray, effort: np.ndarray
) -> dict[str, store.Variable]:
    """Contact area of all windows, residual and work, each (samples, levels)."""
    dimensions = ("sample", "level")
    return {
        "area_of_nodes": store.Variable(dimensions, of_nodes, "m2", "area of the nodes in contact, all windows"),
        "area_corrected": store.Variable(dimensions, corrected, "m2", "the same, less the mesh error at edges"),
        "residual": store.Variable(dimensions, residual, "1", "largest relative residual of the complementarity"),
        "work": store.Variable(dimensions, effort, "1", "work of the solver, as its method counts it"),
    }


def window_variables(places: Iterable[str], sums: dict[str, np.ndarray]) -> dict[str, store.Variable]:
    """Sums over windows, by mesh and name."""
    variables = {}
    for place in places:
        for name, (unit, title) in WINDOWS.items():
            dimensions = "sample", "level", "window"
            variables[place + name] = store.Variable(dimensions, sums[place + name], unit, title + MESHES[place])
    return variables


def block_variables(sums: dict[str, np.ndarray]) -> dict[str, store.Variable]:
    """Sums over blocks."""
    variables = {}
    for name, values in sums.items():
        unit, title = WINDOWS[name]
        of_block = title.replace("the window", "a block as long as the distance of two windows")
        variables[f"block_{name}"] = store.Variable(("sample", "level", "block"), values, unit, of_block)
    return variables
