"""Stage contact_over_loads: contact of periodic cells over two decades of nominal pressure about that of the load.

That of the load itself is of stage contact_periodic. Each pressure has a cell of its own size.
"""

import numpy as np

from roughslip import store
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene.periodic_cell import Cells, solved
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="contact_over_loads",
    reads="seed material roughness strip.cell_m strip.width_m strip.window_m strip.window_spacing_m "
    "load.nominal_pressure_pa numerics.contact_area numerics.contact_tolerance",
    optional={"scan": "scan"},
    result="contact/over_loads.nc",
    memory_mb=900,
)

FACTORS = tuple(10.0 ** np.array([-1.0, -0.5, 0.5, 1.0]))  # of the nominal pressure of the load
SAMPLES, FEWEST = 24, 8  # samples, as of strip.samples, and cells at least


def work(job: Job) -> None:
    """Solve cells at every pressure that they can bear; write area and force of the blocks of each size of cells."""
    nominal = job.scene.load.nominal_pressure_pa
    at = {nominal * float(factor): Cells(job, nominal * float(factor)) for factor in FACTORS}
    left_out = {pressure: cells.mistake for pressure, cells in at.items() if cells.mistake}
    if left_out:
        listed = ", ".join(f"{pressure:.3g}" for pressure in left_out)
        job.usage.warn(f"friction_against_load leaves out {listed} Pa. At the last {[*left_out.values()][-1]}")
    serving = {pressure: cells for pressure, cells in at.items() if not cells.mistake}
    variables: dict[str, store.Variable] = {}
    with job.usage.core():
        for size, (_, pressures, (area, force)) in enumerate(
            solved(serving, lambda cells: cells.count(SAMPLES, FEWEST), job.usage.progress)
        ):
            job.usage.count(solves=area.shape[0] * area.shape[1])
            title = "force over apparent area"
            blocks = (f"load_{size}", f"sample_{size}", f"block_along_{size}", f"block_across_{size}")
            variables |= {
                f"pressure_{size}": store.Variable(blocks[:1], pressures, "Pa", title),
                f"block_area_{size}": store.Variable(blocks, area, "m2", "contact area of a block of a cell"),
                f"block_force_{size}": store.Variable(blocks, force, "N", "normal force on it"),
            }
    store.write(job.arguments.output, variables, job.key)
