"""Stage expansion_strip: window sums of a batch of strips from the pressure expansion instead of contact solves.

Strips are numbered as in contact_strip and drawn from the same streams: the first are the solved ones over again, which
makes the expansion their control variate; the others are new.
"""

from __future__ import annotations

import numpy as np

from roughslip import store
from roughslip.chaos.strip import StripExpansion
from roughslip.friction.bowden_tabor import window_sums
from roughslip.stages import expansion, geometry, surfaces
from roughslip.stages.command import Job, execute


def work(job: Job) -> None:
    """Write contact area and normal force of every window."""
    configuration, arguments = job.configuration, job.arguments
    grid, model = geometry.strip_grid(configuration), surfaces.surface_model(configuration, arguments.scan)
    stored = store.read(arguments.expansion)
    fitted = StripExpansion(
        stored["indices"],
        stored["whiten"],
        stored["coefficients"],
        expansion.stencil(model, grid),
        expansion.strip_target(configuration, model, grid),
    )
    sample = model.sampler(grid)
    windows = geometry.windows(configuration)
    count, levels = arguments.last - arguments.first, fitted.coefficients.shape[2]
    area, force = np.empty((2, count, levels, windows.count))
    with job.usage.core():
        for row, number in enumerate(range(arguments.first, arguments.last)):
            field = sample(np.random.default_rng([configuration["seed"], geometry.STREAM_STRIP, number]))
            pressure = fitted.pressure(field)
            in_contact = np.count_nonzero(pressure, axis=2).astype(float)
            column_area, column_force = grid.cell_area * in_contact, grid.cell_area * pressure.sum(axis=2)
            area[row] = window_sums(column_area[:, windows.middle], windows.length, windows.spacing)
            force[row] = window_sums(column_force[:, windows.middle], windows.length, windows.spacing)
            job.usage.progress(row + 1, count)
    job.usage.count(expansions=count * levels)
    shape = ("sample", "level", "window")
    variables = {
        "area": store.Variable(shape, area, "m2", "contact area of the window"),
        "force": store.Variable(shape, force, "N", "normal force on the window"),
    }
    store.write(arguments.output, variables, job.key, {"first": arguments.first})


if __name__ == "__main__":
    execute("expansion_strip", work, files=("expansion",), optional=("scan",), range_=True)
