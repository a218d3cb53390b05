"""Stage grinding: a scan of a surface ground grain by grain, written as a file of an instrument."""

import numpy as np

from roughslip.grid import Grid
from roughslip.scan.grinding import Grinding, ground_surface
from roughslip.scan.instrument_file import write_x3p
from roughslip.scan.topography import topography
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import geometry
from roughslip.stages.runtime.command import Job, execute

STAGE = Stage(
    name="grinding",
    reads="seed roughness.scan.grinding",
    result="scan.x3p",
    runs_if="roughness.scan.grinding",
    memory_mb=320,
    memory_doubles={"scan_points": 40},
)


OF_GRAINS = ("grains_per_m2", "depth_m", "tip_radius_m", "path_radius_m", "blank_rms_m", "blank_length_m")


def work(job: Job) -> None:
    """Grind, and write the heights as X3P."""
    asked = job.scene.roughness.scan.grinding
    points, spacing = asked.points, asked.spacing_m
    grinding = Grinding(**{name: getattr(asked, name) for name in OF_GRAINS})
    generator = np.random.default_rng([job.scene.seed, geometry.STREAM_GRINDING])
    with job.usage.core():
        heights = ground_surface(grinding, Grid(points, points, spacing, spacing), generator)
    job.usage.count(points=heights.size)
    write_x3p(job.arguments.output, topography(heights, spacing, spacing, str(job.arguments.output)))


if __name__ == "__main__":
    execute(STAGE, work)
