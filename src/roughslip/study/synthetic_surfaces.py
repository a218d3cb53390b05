"""Stage synthetic_surfaces: surfaces sampled from the model of a scan on its own mesh, described as it was.

The model is one of the surface without its form, so that no form is removed from twins. Where it cannot be sampled,
the result holds the scan alone and the reason, for a figure of the scan without twins.
"""

import numpy as np

from roughslip import store
from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.scan.statistics import ScanStatistics, scan_statistics
from roughslip.scan.topography import Topography, topography
from roughslip.scene.types import Scene
from roughslip.study.from_scene import surface_model
from roughslip.study.from_scene.streams import Stream
from roughslip.study.job import Job
from roughslip.study.result_tables import scan_table

TWINS = 19  # their least and largest value hold a further one with a probability of 0.9


def work(scene: Scene, job: Job) -> None:
    """Write what the figure of the scan draws: its statistics and those of the twins."""
    seed = scene.seed
    scan = store.read(job.path("scan"))
    (nx, ny), (dx, dy) = scan["points"], scan["spacing"]
    twins: list[tuple[Topography, ScanStatistics]] = []
    left_out: list[str] = []
    none = ""
    try:
        model = surface_model.restored_model(scan)
        sample = model.sampler(Grid(int(nx), int(ny), float(dx), float(dy)))
        model.heights(np.zeros(1))  # translated heights may have no series
    except (ConvergenceError, IllPosedError, ParameterError) as error:
        none = str(error) if "no_model" in scan.attributes else f"{error}. {surface_model.what_helps()}"
    for number in range(0 if none else TWINS):
        field = sample(np.random.default_rng([seed, Stream.TWINS, number]))
        twin = topography(model.heights(field), float(dx), float(dy), f"twin {number}")
        try:
            twins.append((twin, scan_statistics(twin, scan_table.sub_areas_of(scan, twin))))
        except IllPosedError as error:
            left_out.append(str(error))
        job.progress(number + 1, TWINS)
    if left_out and not twins:
        none = f"no sampled surface has statistics: {left_out[0]}"
    if none:
        job.warn(f"no surface is sampled like the scan, whose figure shows it alone: {none}")
    elif left_out:
        job.warn(f"{len(left_out)} of {TWINS} sampled surfaces have no statistics and are left out: {left_out[0]}")
    job.count(twins=len(twins))
    variables = {name: scan.variable(name) for name in scan if not name.startswith("marginal_")}
    if twins:
        variables |= scan_table.of_twins(twins, scan["density_edge"])
    variables["no_twins"] = store.Variable(("why",), np.array([none]), "1", "why there is no twin; empty with twins")
    store.write(job.output, variables, job.key)
