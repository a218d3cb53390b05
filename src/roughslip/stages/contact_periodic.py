"""Stage contact_periodic: contact of periodic cells of the surface under the nominal pressure of the load.

As many cells as `strip.samples` says, or one after another until the friction of pads is as accurate as asked.
"""

import math

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.statistics import strip_weights
from roughslip.friction.under_load import CellBlocks, pad_estimates
from roughslip.probability.pilot import refusal, widened
from roughslip.scene.declarations import Stage
from roughslip.scene.fields import unless_auto
from roughslip.stages.from_scene import geometry
from roughslip.stages.from_scene.periodic_cell import FEWEST, Cells, yielding
from roughslip.stages.result_tables.pad_autocorrelation import correlated
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="contact_periodic",
    reads="seed material roughness strip.cell_m strip.width_m strip.window_m strip.window_spacing_m strip.samples "
    "load.nominal_pressure_pa numerics.contact_area numerics.contact_tolerance",
    reads_if_given="accuracy",
    optional={"scan": "scan"},
    result="contact/periodic.nc",
    memory_mb=900,
)

REPLICATES = 200
MARGIN = 1.1  # on the number of cells that an accuracy takes, as the interval itself is uncertain
NODE_S = 1e-6  # [s] of CPU time that a node of a cell takes, by the model of cost


def work(job: Job) -> None:
    """Solve the cells, and write area and force of their blocks."""
    scene, pressure = job.scene, job.scene.load.nominal_pressure_pa
    cells, given = Cells(job, pressure), unless_auto(scene.strip.samples)
    if cells.mistake:
        raise IllPosedError(cells.mistake)
    wanted = FEWEST if given is None else cells.count(given)
    area: list[np.ndarray] = []
    force: list[np.ndarray] = []
    residual: list[float] = []
    yielded: list[float] = []
    with job.usage.core():
        while len(area) < wanted:
            (solution,) = cells.solutions(len(area), [pressure])
            residual.append(solution.residual)
            yielded.append(solution.yielded_share)
            for part, of_blocks in zip((area, force), cells.block_sums(solution), strict=True):
                part.append(of_blocks)
            job.usage.progress(len(area), wanted)
            if given is None and len(area) == wanted:
                wanted = more(job, cells, np.stack(area), np.stack(force))
    job.usage.count(solves=len(area), nodes=cells.cell.grid.size)
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


def more(job: Job, cells: Cells, area: np.ndarray, force: np.ndarray) -> int:
    """Cells for mean and scatter of pads of one window as accurate as asked; those that there are where they serve.

    Raises IllPosedError with the nearest accuracy where these take more than `accuracy.cost_limit_cpu_s`.
    """
    accuracy, count = job.scene.accuracy, len(area)
    generator = np.random.default_rng([job.scene.seed, geometry.STREAM_CELL, count, count])
    weights = strip_weights(count, REPLICATES, generator)
    blocks = CellBlocks(area, force, *geometry.block_sizes(job.scene))
    found = pad_estimates(blocks, correlated(job.scene, job.arguments.scan), weights)
    asked = {"friction_mean": accuracy.friction_mean, "friction_std": accuracy.friction_std}
    widths = {
        name: float(np.ravel((each.high - each.low) / 2.0 / each.value)[0])
        for name, each in zip(asked, (found["ratio"], found["pad_std"]), strict=True)
    }
    excess = max(widths[name] / asked[name] for name in asked)
    if excess <= 1.0:
        job.usage.count(**{f"{name}_reached": round(width, 5) for name, width in widths.items()})
        return count
    needed = math.ceil(MARGIN * excess**2 * count)
    affordable = int(accuracy.cost_limit_cpu_s / (NODE_S * cells.cell.grid.size))
    if needed > affordable:
        nearest = widened(asked, math.sqrt(needed / affordable)) if affordable >= FEWEST else None
        raise IllPosedError(refusal(asked, nearest, "give more accuracy.cost_limit_cpu_s, or larger strip.cell_m"))
    return min(needed, 4 * count)
