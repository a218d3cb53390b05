"""Stage strip_pilot: contact of the training strips, where an accuracy is asked.

From them follows how many more are solved. They are the first strips of contact_strip, which then solves the others.
"""

from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene.strip_contact import solve_strips
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="strip_pilot",
    reads="seed material roughness "
    "strip.length_m strip.margin_m strip.width_m strip.cell_m strip.penetration_percentiles "
    "strip.window_m strip.window_spacing_m strip.training_samples "
    "numerics.contact_area numerics.contact_tolerance numerics.extrapolate_mesh",
    optional={"scan": "scan"},
    result="contact/pilot.nc",
    runs_if="accuracy.friction_mean",
)


def work(job: Job) -> None:
    """Solve the training strips."""
    solve_strips(job, range(job.scene.strip.training_samples))
