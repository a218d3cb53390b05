"""Stage expansion_strip: block sums of a batch of strips from the pressure expansion instead of contact solves."""

import numpy as np

from roughslip import store
from roughslip.scene.declarations import Batches, Stage
from roughslip.stages.from_scene.strip_expansion import expand_strips
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="expansion_strip",
    reads="seed material roughness "
    "strip.length_m strip.margin_m strip.width_m strip.cell_m strip.penetration_percentiles "
    "strip.window_m strip.window_spacing_m strip.samples expansion.degree expansion.target",
    reads_if_given="strip.expansion_spacing_m",
    inputs={"expansion": "chaos_strip"},
    optional={"scan": "scan"},
    result="friction/expansion-{first}-{last}.nc",
    runs_if="not load",
    batches=Batches(totals={"": "strip.expansion_samples"}),
)


def work(job: Job) -> None:
    """Write contact area and normal force of every block."""
    numbers = range(job.arguments.first, job.arguments.last)
    area, force = expand_strips(job, numbers, job.scene.strip.samples)
    shape = ("sample", "mesh", "level", "along", "across")
    percentiles = np.array(job.scene.strip.penetration_percentiles)
    variables = {
        "number": store.Variable(("sample",), np.array(numbers), "1", "number of the strip"),
        "at": store.Variable(("level",), percentiles, "percent", "share of heights above the plane"),
        "area": store.Variable(shape, area[:, None, :, :, None], "m2", "contact area of a block"),
        "force": store.Variable(shape, force[:, None, :, :, None], "N", "normal force on it"),
    }
    store.write(job.arguments.output, variables, job.key, {"first": numbers.start, "model": "expansion"})
