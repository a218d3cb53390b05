"""Stage contact_periodic: contact of periodic cells of the surface under the nominal pressure of the load."""

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene.periodic_cell import Cells, yielding
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="contact_periodic",
    reads="seed material roughness strip.cell_m strip.width_m strip.window_m strip.window_spacing_m strip.samples "
    "load.nominal_pressure_pa numerics.contact_area numerics.contact_tolerance",
    optional={"scan": "scan"},
    result="contact/periodic.nc",
    memory_mb=900,
)


def work(job: Job) -> None:
    """Solve the cells, and write area and force of their blocks."""
    scene, pressure = job.scene, job.scene.load.nominal_pressure_pa
    cells = Cells(job, pressure)
    if cells.mistake:
        raise IllPosedError(cells.mistake)
    count = cells.count(scene.strip.samples)
    area: list[np.ndarray] = []
    force: list[np.ndarray] = []
    residual: list[float] = []
    yielded: list[float] = []
    with job.usage.core():
        for number in range(count):
            (solution,) = cells.solutions(number, [pressure])
            residual.append(solution.residual)
            yielded.append(solution.yielded_share)
            for part, of_blocks in zip((area, force), cells.block_sums(solution), strict=True):
                part.append(of_blocks)
            job.usage.progress(number + 1, count)
    job.usage.count(solves=count, nodes=cells.cell.grid.size)
    share = float(np.average(yielded, weights=[part.sum() for part in area]))
    job.usage.say(yielding(cells.plasticity_index, share))
    blocks = ("sample", "block_along", "block_across")
    variables = {
        "block_area": store.Variable(blocks, np.stack(area), "m2", "contact area of a block of a cell"),
        "block_force": store.Variable(blocks, np.stack(force), "N", "normal force on it"),
        "residual": store.Variable(("sample",), np.array(residual), "1", "relative residual of the complementarity"),
        "plasticity_index": store.Variable((), cells.plasticity_index, "1", "E* h' / H, zero in elastic contact"),
        "yielded_share": store.Variable((), share, "1", "share of the real area that bears the hardness"),
    }
    store.write(job.arguments.output, variables, job.key)
