"""Stage contact_over_loads: contact of periodic cells over two decades of nominal pressure about that of the load.

Each pressure has a cell of its own size. Those that share a size are the same surfaces, solved from the lightest on.
"""

from itertools import groupby

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.statistics import estimate_of, strip_weights
from roughslip.friction.under_load import Estimates, pad_estimates
from roughslip.probability import Estimate
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import geometry
from roughslip.stages.from_scene.periodic_cell import Cells, cell_blocks
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="contact_over_loads",
    reads="seed material roughness strip.cell_m strip.width_m strip.window_m strip.window_spacing_m "
    "load.nominal_pressure_pa oscillator.windows_in_parallel numerics.contact_area numerics.contact_tolerance",
    optional={"scan": "scan"},
    result="contact/over_loads.nc",
    memory_mb=620,
)

FACTORS = 10.0 ** (np.arange(-4, 5) / 4.0)  # of the nominal pressure of the load
SAMPLES, FEWEST = 24, 8  # cells of the least size, and of any
REPLICATES = 200
TITLES = {
    "real_area": "contact area over the apparent area",
    "relative_mean": "mean friction coefficient of the pad over that under its load",
    "variation": "coefficient of variation of the friction coefficient of the pad",
    "no_contact": "share of the windows without contact",
}


def work(job: Job) -> None:
    """Solve cells at every pressure that they can bear, and write what the pad has there."""
    nominal = job.scene.load.nominal_pressure_pa
    at = {nominal * float(factor): Cells(job, nominal * float(factor)) for factor in FACTORS}
    if at[nominal].mistake:
        raise IllPosedError(at[nominal].mistake)
    left_out = {pressure: cells.mistake for pressure, cells in at.items() if cells.mistake}
    if left_out:
        listed = ", ".join(f"{pressure:.3g}" for pressure in left_out)
        job.usage.warn(f"friction_against_load leaves out {listed} Pa. At the last {list(left_out.values())[-1]}")
    found: dict[float, Estimates] = {}
    with job.usage.core():
        serving = [pressure for pressure in at if pressure not in left_out]
        for _, group in groupby(serving, key=lambda pressure: at[pressure].cell):
            pressures = list(group)
            found |= at_pressures(job, at[pressures[0]], pressures)
            job.usage.progress(len(found), len(serving))
    own = found[nominal]["ratio"].rows
    rows: dict[str, list[Estimate]] = {name: [] for name in TITLES}
    for pressure, pads in found.items():
        ratio, cells = pads["ratio"].rows, at[pressure].count(SAMPLES, FEWEST)
        rows["real_area"].append(estimate_of("mean", pressure * ratio, cells))
        rows["relative_mean"].append(estimate_of("mean", ratio / own, cells))
        rows["variation"].append(estimate_of("std", pads["load_std"].rows / ratio, cells))
        rows["no_contact"].append(pads["no_contact"])
    title = "force over apparent area"
    variables = {"nominal_pressure": store.Variable(("load",), np.array(list(found)), "Pa", title)}
    for name, estimates in rows.items():
        ends = [np.array([getattr(each, part) for each in estimates]) for part in ("value", "low", "high")]
        variables |= store.with_interval(name, ("load",), ends, "1", TITLES[name])
    store.write(job.arguments.output, variables, job.key)


def at_pressures(job: Job, cells: Cells, pressures_pa: list[float]) -> dict[float, Estimates]:
    """What pads have at pressures of one size of cells, from the lightest on."""
    scene, count = job.scene, cells.count(SAMPLES, FEWEST)
    sums = [
        [cells.block_sums(solution) for solution in cells.solutions(number, pressures_pa)] for number in range(count)
    ]
    job.usage.count(solves=count * len(pressures_pa))
    weights = strip_weights(count, REPLICATES, np.random.default_rng([scene.seed, geometry.STREAM_CELL, count]))
    found = {}
    for place, pressure in enumerate(pressures_pa):
        area, force = (np.stack([of_cell[place][part] for of_cell in sums]) for part in (0, 1))
        blocks, windows = cell_blocks(scene, area, force), scene.oscillator.windows_in_parallel
        found[pressure] = pad_estimates(blocks, cells.surface, weights, windows)
    return found
