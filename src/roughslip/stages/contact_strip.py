"""Stage contact_strip: contact of a batch of strips with the plane, at every penetration of the scene."""

from roughslip.scene.declarations import Batches, Stage
from roughslip.stages.from_scene.shares import sample_range, solved_strips
from roughslip.stages.from_scene.strip_contact import solve_strips
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="contact_strip",
    reads="seed material roughness "
    "strip.length_m strip.margin_m strip.width_m strip.cell_m strip.penetration_percentiles "
    "strip.window_m strip.window_spacing_m strip.training_samples "
    "numerics.contact_area numerics.contact_tolerance numerics.extrapolate_mesh",
    optional={"scan": "scan", "allocation": "strip_allocation"},
    result="contact/strip-{first}-{last}.nc",
    batches=Batches(totals={"": "strip.samples"}, asked="accuracy.friction_mean"),
)


def work(job: Job) -> None:
    """Solve the strips of the batch, or of the share that the pilot leaves, and others on cells 2h alone."""
    numbers, others = sample_range(job, "strips", job.scene.strip.training_samples), range(0)
    if job.arguments.allocation is not None:
        others = sample_range(job, "coarse_strips", solved_strips(job))
    solve_strips(job, numbers, others)
