"""Stage contact_strip: contact of a batch of strips with the plane, at every penetration of the scene."""

import numpy as np

from roughslip import store
from roughslip.contact.area import contact_shares
from roughslip.contact.solve import sweep
from roughslip.friction.bowden_tabor import window_sums
from roughslip.scene.declarations import Batches, Stage
from roughslip.stages.from_scene import elastic, geometry, surface_model
from roughslip.stages.runtime.command import Job, execute

STAGE = Stage(
    name="contact_strip",
    reads="seed material roughness "
    "strip.length_m strip.margin_m strip.width_m strip.cell_m strip.penetration_percentiles "
    "strip.window_m strip.window_spacing_m numerics.contact_area strip.training_samples numerics.contact_tolerance",
    optional={"scan": "scan"},
    result="contact/strip-{first}-{last}.nc",
    batches=Batches(size="batches.strip_samples", totals={"": "strip.samples"}),
    memory_mb=420,
    memory_doubles={"cells": 150, "batch windows": 8, "trained_strips levels cells": 1},
)


def work(job: Job) -> None:
    """Write contact area and normal force of every window, and whole training columns of the first strips."""
    scene, arguments = job.scene, job.arguments
    grid = geometry.strip_grid(scene)
    model = surface_model.surface_model(scene, arguments.scan)
    sample = model.sampler(grid)
    influence = elastic.influence(scene, grid)
    planes = model.plane_height(np.array(scene.strip.penetration_percentiles))
    tolerance, hardness = scene.numerics.contact_tolerance, elastic.hardness_pa(scene)
    windows = geometry.windows(scene)
    count, levels = arguments.last - arguments.first, len(planes)
    columns = geometry.training_columns(windows.middle)
    trained = max(0, min(scene.strip.training_samples, arguments.last) - arguments.first)
    area, force = np.empty((2, count, levels, windows.count))
    of_nodes, corrected = np.empty((2, count, levels))
    residual, effort = np.empty((count, levels)), np.empty((count, levels), dtype=np.int32)
    pressure, gap = np.empty((2, trained, levels, len(columns), grid.ny))
    skipped = elastic.empty_skip_counts()
    with job.usage.core():
        for row, number in enumerate(range(arguments.first, arguments.last)):
            field = sample(np.random.default_rng([scene.seed, geometry.STREAM_STRIP, number]))
            solutions = sweep(influence, model.heights(field), planes.tolist(), tolerance, hardness_pa=hardness)
            for level, solution in enumerate(solutions):
                elastic.count_solve(skipped, solution)
                pressed = solution.pressure[windows.middle]
                nodes = np.count_nonzero(pressed, axis=1).astype(float)
                shares = contact_shares(solution.pressure, hardness)[windows.middle].sum(axis=1)
                of_nodes[row, level] = grid.cell_area * nodes.sum()
                corrected[row, level] = grid.cell_area * shares.sum()
                cells = nodes if scene.numerics.contact_area == "nodes" else shares
                area[row, level] = grid.cell_area * window_sums(cells, windows.length, windows.spacing)
                column_force = grid.cell_area * pressed.sum(axis=1)
                force[row, level] = window_sums(column_force, windows.length, windows.spacing)
                residual[row, level], effort[row, level] = solution.residual, solution.work
                if row < trained:
                    pressure[row, level], gap[row, level] = solution.pressure[columns], solution.signed_gap[columns]
            job.usage.progress(row + 1, count)
    job.usage.count(solves=count * levels, convolutions=int(effort.sum()))
    job.usage.skip(skipped)
    shape, columns_of = ("sample", "level", "window"), ("training_sample", "level", "column", "y")
    variables = {
        "area": store.Variable(shape, area, "m2", "contact area of the window"),
        "force": store.Variable(shape, force, "N", "normal force on the window"),
        "area_of_nodes": store.Variable(shape[:2], of_nodes, "m2", "area of the nodes in contact, all windows"),
        "area_corrected": store.Variable(shape[:2], corrected, "m2", "the same, less the error of the mesh at edges"),
        "residual": store.Variable(shape[:2], residual, "1", "relative residual of the complementarity"),
        "work": store.Variable(shape[:2], effort, "1", "work of the solver, as its method counts it"),
    }
    if trained:
        variables["pressure"] = store.Variable(columns_of, pressure, "Pa", "contact pressure on the training columns")
        variables["gap"] = store.Variable(columns_of, gap, "m", "gap there, below zero the plastic displacement")
    store.write(arguments.output, variables, job.key, {"first": arguments.first})


if __name__ == "__main__":
    execute(STAGE, work)
