"""Stage friction: statistics of the friction coefficient over windows, per source of pressure and penetration."""

import numpy as np

from roughslip import store
from roughslip.friction.level import Windows, levels_of_sums
from roughslip.friction.table import WindowLayout, friction_table
from roughslip.friction.table_variables import (
    missing_warnings,
    solve_variables,
    summary,
    table_variables,
    windows_variables,
)
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import geometry
from roughslip.stages.from_scene.streams import Stream
from roughslip.stages.from_scene.strip_contact import COARSE, FINE
from roughslip.stages.result_tables import load_table
from roughslip.stages.result_tables.pad_autocorrelation import correlation_variables
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="friction",
    reads="seed roughness strip friction.mean_at_median",
    reads_if_given="friction.least_contact_fraction oscillator.normal_force_n",
    many={"contact": "contact_strip", "expansion": "expansion_strip"},
    optional={"scan": "scan"},
    result="friction/statistics.nc",
    outputs={"summary": "summary.csv"},
    runs_if="not friction.statistics and not friction.record and not load",
    memory_mb=620,
)

REPLICATES = 400


def work(job: Job) -> None:
    """Calibrate the shear strength at the median, then write every statistic with its interval, and summary.csv."""
    scene, batches, seed = job.scene, store.read_all(job.arguments.contact), job.scene.seed
    sums, expanded = area_and_force(batches), area_and_force(store.read_all(job.arguments.expansion))
    windows, strip = geometry.windows(scene), scene.strip
    percentiles, cells = np.array(strip.penetration_percentiles, dtype=float), (windows.length, windows.spacing)
    layout = WindowLayout(percentiles, strip.window_m, strip.window_spacing_m, cells, sums[0].shape[2])
    with job.usage.core():
        levels = levels_of_sums(geometry.least_contact_area(scene), sums, expanded, coarse_sums(batches))
        draws, mean = [seed, Stream.BOOTSTRAP], scene.friction.mean_at_median
        table = friction_table(levels, sums, layout, mean, REPLICATES, draws, job.usage.progress)
        loads = load_table.load_table(job, batches, (table.solved, table.combined), table.shear, table.weights)
    job.usage.warn(*missing_warnings(table.solved["missing_share"], percentiles))
    job.usage.count(windows=sums[0][0].size, expanded_windows=expanded[0][0].size)
    variables = table_variables(table) | windows_variables(table.mu, layout.median)
    variables |= load_table.load_variables(loads)
    variables |= correlation_variables(scene, job.arguments.scan)
    variables |= solve_variables(batches, table.shear, table.weights)
    store.write(job.arguments.output, variables, job.key)
    store.write_text(job.arguments.summary, summary(variables, percentiles))


def area_and_force(batches: list[store.Result], mesh: str = FINE) -> Windows:
    """Area [m2] and force [N] : (levels, strips, windows) on a mesh."""
    area, force = (store.join(batches, mesh + name).transpose(1, 0, 2) for name in ("area", "force"))
    return area, force


def coarse_sums(batches: list[store.Result]) -> Windows | None:
    """The same on cells of twice the edge, where strips are solved on these too."""
    return area_and_force(batches, COARSE) if f"{COARSE}area" in batches[0] else None
