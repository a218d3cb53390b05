"""Contact of strips with the plane, at every penetration of the scene."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from roughslip import store
from roughslip.contact.area import contact_shares
from roughslip.contact.influence import Influence
from roughslip.contact.solve import sweep
from roughslip.grid import Grid
from roughslip.stages.from_scene import elastic, geometry, strip_coordinates
from roughslip.stages.from_scene.surface_model import SurfaceModel, scan_warnings, surface_model
from roughslip.stages.runtime.command import Job

WINDOWS = {"area": ("m2", "contact area of the window"), "force": ("N", "normal force on the window")}
COARSE = "coarse_"  # before the names of what cells of twice the edge give
OTHERS = "other_"  # the same of strips that are solved on these cells alone


def solve_strips(job: Job, numbers: range, others: range = range(0)) -> None:
    """Write contact area and normal force of every window, and whole training columns of the first strips.

    others : strips that are solved on cells of twice the edge alone
    """
    scene = job.scene
    grid = geometry.strip_grid(scene)
    model, heights_of = strips_of(job, grid)
    influence = elastic.influence(scene, grid)
    meshes = [("", influence, 1)] + scene.numerics.extrapolate_mesh * [(COARSE, influence.coarser, 2)]
    windows = [geometry.windows(scene, step) for *_, step in meshes]
    blocks = replace(windows[0], length=windows[0].spacing)
    light = len(scene.strip.light_percentiles or ())  # levels of which blocks alone are kept, the first ones
    percentiles = [*(scene.strip.light_percentiles or ()), *scene.strip.penetration_percentiles]
    planes = model.plane_height(np.array(percentiles)).tolist()
    tolerance, hardness = scene.numerics.contact_tolerance, elastic.hardness_pa(scene)
    middle = geometry.middle(scene)
    count, levels = len(numbers), len(planes) - light
    columns = geometry.training_columns(middle)
    trained = max(0, min(scene.strip.training_samples, numbers.stop) - numbers.start)
    shape = count, levels, windows[0].count
    sums = {mesh + name: np.empty(shape) for mesh, _, _ in meshes for name in WINDOWS}
    in_blocks = {name: np.empty((count, light + levels, blocks.count)) for name in WINDOWS}
    of_nodes, corrected = np.empty((2, count, levels))
    residual, effort = np.zeros((count, levels)), np.zeros((count, levels), dtype=np.int32)
    pressure, gap = np.empty((2, trained, levels, len(columns), grid.ny))
    skipped = elastic.empty_skip_counts()
    with job.usage.core():
        for row, number in enumerate(numbers):
            heights = heights_of(number)
            for (mesh, on, step), lie in zip(meshes, windows, strict=True):
                nodes = slice(step // 2, None, step)
                at = planes[light * (step - 1) :]
                solutions = sweep(on, heights[nodes, nodes], at, tolerance, hardness_pa=hardness)
                for level, solution in enumerate(solutions, levels - len(solutions)):
                    elastic.count_solve(skipped, solution)
                    shares = contact_shares(solution.pressure, hardness)
                    cells = solution.contact if scene.numerics.contact_area == "nodes" else shares
                    for name, field in (("area", cells), ("force", solution.pressure)):
                        if mesh != COARSE:
                            in_blocks[name][row, light + level] = grid.cell_area * blocks.sums(field)
                        if level >= 0:
                            sums[mesh + name][row, level] = on.grid.cell_area * lie.sums(field)
                    if level < 0:
                        continue
                    residual[row, level] = max(residual[row, level], solution.residual)
                    effort[row, level] += solution.work
                    if mesh == COARSE:
                        continue
                    of_nodes[row, level] = grid.cell_area * np.count_nonzero(solution.contact[middle])
                    corrected[row, level] = grid.cell_area * shares[middle].sum()
                    if row < trained:
                        pressure[row, level], gap[row, level] = solution.pressure[columns], solution.signed_gap[columns]
            job.usage.progress(row + 1, count)
    job.usage.count(solves=count * levels * len(meshes), convolutions=int(effort.sum()))
    job.usage.skip(skipped)
    dimensions, columns_of = ("sample", "level"), ("training_sample", "level", "column", "y")
    variables = strip_coordinates.of_windows(scene, numbers, windows[0].count) | {
        "area_of_nodes": store.Variable(dimensions, of_nodes, "m2", "area of the nodes in contact, all windows"),
        "area_corrected": store.Variable(dimensions, corrected, "m2", "the same, less the mesh error at edges"),
        "residual": store.Variable(dimensions, residual, "1", "largest relative residual of the complementarity"),
        "work": store.Variable(dimensions, effort, "1", "work of the solver, as its method counts it"),
    }
    variables |= sum_variables(sums, in_blocks) | coarse_sums(job, influence, planes[light:], heights_of, others)
    if trained:
        variables["pressure"] = store.Variable(columns_of, pressure, "Pa", "contact pressure on the training columns")
        variables["gap"] = store.Variable(columns_of, gap, "m", "gap there, below zero the plastic displacement")
    store.write(job.arguments.output, variables, job.key, {"first": numbers.start})


def strips_of(job: Job, grid: Grid) -> tuple[SurfaceModel, Callable[[int], np.ndarray]]:
    """The surface, and a function that gives the heights (nx, ny) [m] of a strip by its number."""
    scene, scan = job.scene, job.arguments.scan
    model = surface_model(scene, scan)
    if scan is not None:
        job.usage.warn(*scan_warnings(model, {"strip.cell_m": grid.dx}, scene.strip.window_m))
    sample = model.sampler(grid)
    return model, lambda number: model.heights(
        sample(np.random.default_rng([scene.seed, geometry.STREAM_STRIP, number]))
    )


def coarse_sums(
    job: Job, influence: Influence, planes: list[float], heights_of: Callable[[int], np.ndarray], numbers: range
) -> dict[str, store.Variable]:
    """Contact area and normal force of every window of strips that are solved on cells of twice the edge alone."""
    if not numbers:
        return {}
    scene, windows, on = job.scene, geometry.windows(job.scene, 2), influence.coarser
    hardness, on_nodes = elastic.hardness_pa(scene), scene.numerics.contact_area == "nodes"
    sums = np.empty((len(WINDOWS), len(numbers), len(planes), windows.count))
    skipped, products = elastic.empty_skip_counts(), 0
    with job.usage.core():
        for row, number in enumerate(numbers):
            heights = heights_of(number)[1::2, 1::2]
            solutions = sweep(on, heights, planes, scene.numerics.contact_tolerance, hardness_pa=hardness)
            for level, solution in enumerate(solutions):
                elastic.count_solve(skipped, solution)
                products += solution.work
                cells = solution.contact if on_nodes else contact_shares(solution.pressure, hardness)
                for kind, field in enumerate((cells, solution.pressure)):
                    sums[kind, row, level] = on.grid.cell_area * windows.sums(field)
            job.usage.progress(row + 1, len(numbers))
    job.usage.count(solves=sums[0, :, :, 0].size, convolutions=products)
    job.usage.skip(skipped)
    return {
        OTHERS + name: store.Variable(
            ("other_sample", "level", "window"), found, unit, f"{title}, strips on cells of 2 times the edge alone"
        )
        for found, (name, (unit, title)) in zip(sums, WINDOWS.items(), strict=True)
    }


def sum_variables(sums: dict[str, np.ndarray], in_blocks: dict[str, np.ndarray]) -> dict[str, store.Variable]:
    """Sums over windows, by mesh and name, and over blocks, of which the first levels are the light ones."""
    variables = {}
    for place, values in sums.items():
        unit, title = WINDOWS[place.removeprefix(COARSE)]
        on_mesh = title + (", cells of 2 times the edge" if place.startswith(COARSE) else "")
        variables[place] = store.Variable(("sample", "level", "window"), values, unit, on_mesh)
    for name, values in in_blocks.items():
        unit, title = WINDOWS[name]
        of_block = title.replace("the window", "a block as long as the distance of two windows")
        variables[f"block_{name}"] = store.Variable(("sample", "block_level", "block"), values, unit, of_block)
    return variables
