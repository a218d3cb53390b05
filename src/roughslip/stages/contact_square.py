"""Stage contact_square: contact of a batch of samples of the square with the plane, at one penetration."""

from __future__ import annotations

import numpy as np

from roughslip import store
from roughslip.chaos.designs import monte_carlo
from roughslip.contact.solve import solve
from roughslip.stages import elastic, geometry, surfaces
from roughslip.stages.command import Job, execute
from roughslip.stages.nodes import central_nodes, training_nodes
from roughslip.surface.karhunen_loeve import heights


def work(job: Job) -> None:
    """Write pressure and gap around the centre, area fraction, mean pressure and residual of every sample."""
    configuration, arguments = job.configuration, job.arguments
    square = configuration["square"]
    grid = geometry.square_grid(configuration)
    modes = store.read(arguments.surface)["modes"]
    design = None if arguments.design_name == "monte_carlo" else store.read(arguments.design)[arguments.design_name]
    model = surfaces.gaussian_model(configuration, arguments.scan)
    plane = float(model.plane_height(square["penetration_percentile"]))
    influence = elastic.influence(configuration, grid)
    tolerance = configuration["numerics"]["contact_tolerance"]
    wanted = training_nodes if arguments.design_name == "expansion" else central_nodes
    nodes = wanted(model, grid)
    kept = nodes.x, nodes.y
    count = arguments.last - arguments.first
    pressure, gap = np.empty((count, len(nodes.x))), np.empty((count, len(nodes.x)))
    area, mean_pressure, residual = np.empty(count), np.empty(count), np.empty(count)
    effort = np.empty(count, dtype=np.int32)
    with job.usage.core():
        for row, number in enumerate(range(arguments.first, arguments.last)):
            if design is None:
                xi = monte_carlo([configuration["seed"], geometry.STREAM_MONTE_CARLO, number], len(modes))
            else:
                xi = design[number]
            solution = solve(influence, model.heights(heights(modes, xi)) - plane, tolerance)
            pressure[row], gap[row] = solution.pressure[kept], solution.gap[kept]
            area[row] = np.count_nonzero(solution.pressure) / grid.size
            mean_pressure[row], residual[row] = solution.pressure.mean(), solution.residual
            effort[row] = solution.work
            job.usage.progress(row + 1, count)
    job.usage.count(solves=count, solves_without_contact=int(np.sum(area == 0)))
    variables = {
        "pressure": store.Variable(("sample", "node"), pressure, "Pa", "contact pressure at nodes around the centre"),
        "gap": store.Variable(("sample", "node"), gap, "m", "gap at nodes around the centre"),
        "area_fraction": store.Variable(("sample",), area, "1", "share of the nodes in contact"),
        "mean_pressure": store.Variable(("sample",), mean_pressure, "Pa", "mean pressure on the square"),
        "residual": store.Variable(("sample",), residual, "1", "relative residual of the complementarity"),
        "work": store.Variable(("sample",), effort, "1", "work of the solver, as its method counts it"),
    }
    store.write(arguments.output, variables, job.key, {"first": arguments.first, "design": arguments.design_name})


if __name__ == "__main__":
    execute(
        "contact_square", work, files=("surface", "design"), names=("design_name",), optional=("scan",), range_=True
    )
