"""Stage contact_strip: contact of a batch of strips with the plane, at every penetration of the scene."""

from roughslip.scene.declarations import Batches, Stage
from roughslip.stages.from_scene.strip_contact import solve_strips
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="contact_strip",
    reads="seed material roughness "
    "strip.length_m strip.margin_m strip.width_m strip.cell_m strip.penetration_percentiles "
    "strip.window_m strip.window_spacing_m strip.training_samples "
    "numerics.contact_area numerics.contact_tolerance numerics.extrapolate_mesh",
    optional={"scan": "scan"},
    result="contact/strip-{first}-{last}.nc",
    batches=Batches(totals={"": "strip.samples"}),
)


def work(job: Job) -> None:
    """Solve the strips of the batch."""
    solve_strips(job, range(job.arguments.first, job.arguments.last))
