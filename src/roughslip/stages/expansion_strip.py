"""Stage expansion_strip: window sums of a batch of strips from the pressure expansion instead of contact solves."""

from roughslip import store
from roughslip.scene.declarations import Batches, Stage
from roughslip.stages.from_scene import geometry
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
    batches=Batches(totals={"": "strip.expansion_samples"}),
)


def work(job: Job) -> None:
    """Write contact area and normal force of every window."""
    numbers = range(job.arguments.first, job.arguments.last)
    area, force = expand_strips(job, numbers, job.scene.strip.samples)
    shape = ("sample", "level", "window")
    variables = {
        "area": store.Variable(shape, area, "m2", "contact area of the window"),
        "force": store.Variable(shape, force, "N", "normal force on the window"),
    } | geometry.window_coordinates(job.scene, numbers, area.shape[2])
    store.write(job.arguments.output, variables, job.key, {"first": numbers.start})
