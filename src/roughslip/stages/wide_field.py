"""Stage wide_field: friction of windows that are part of a wide field, at the nominal pressure of each penetration.

Windows of a strip are solved alone. Here periodic cells of the same surface bear the mean pressure that the strips have
at some of the penetrations: another reading of the statements on friction over penetration and under the load.
"""

from dataclasses import replace

import numpy as np

from roughslip import store
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.friction.statistics import estimate_of, margin_of, strip_weights, window_statistics
from roughslip.friction.under_load import CellBlocks, pad_estimates
from roughslip.probability import Estimate
from roughslip.probability.estimate import columns_of
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import geometry
from roughslip.stages.from_scene.periodic_cell import Cells, solved
from roughslip.stages.from_scene.surface_model import fitted_covariance, gaussian_model, surface_model
from roughslip.stages.result_tables.pad_autocorrelation import correlated
from roughslip.stages.runtime.command import Job
from roughslip.surface.plausibility import CELLS as RESOLVED
from roughslip.surface.plausibility import slope_mistake

STAGE = Stage(
    name="wide_field",
    reads="seed material roughness strip.cell_m strip.width_m strip.window_m strip.window_spacing_m "
    "numerics.contact_area numerics.contact_tolerance",
    reads_if_given="friction.mean_at_median friction.least_contact_fraction oscillator.penetration_percentile "
    "oscillator.normal_force_n",
    inputs={"friction": "friction"},
    optional={"scan": "scan"},
    result="friction/wide_field.nc",
    target="readings",
    runs_if="not friction.statistics and not friction.record and not load",
    memory_mb=900,
)

LEVELS = 5  # penetrations, evenly among those of the scene, and that of the oscillator
CELLS, REPLICATES = 12, 400
ACROSS = 5.0  # cells of twice the edge serve where a correlation length has so many
ROUNDING = 1e-6
TITLES = {
    "mean": "mean friction coefficient",
    "std": "standard deviation of the friction coefficient",
    "variation": "coefficient of variation of the friction coefficient",
}


def work(job: Job) -> None:
    """Write statistics of windows at each pressure, their change from the first to the last, and the pad's scatter."""
    friction, scene = store.read(job.arguments.friction), job.scene
    percentile = friction["percentile"]
    even = np.linspace(0, percentile.size - 1, LEVELS).round().astype(int).tolist()
    median, own = (int(np.argmin(np.abs(percentile - at))) for at in (50.0, scene.oscillator.penetration_percentile))
    levels = sorted({*even, median, own})
    pressures = friction["nominal_pressure"][levels].tolist()
    coarse = with_coarser_cells(job)
    cells = {} if (reason := why_not(coarse)) else {pressure: Cells(coarse, pressure) for pressure in pressures}
    reason = reason or next((cell.mistake for cell in cells.values() if cell.mistake), "")
    if reason:
        store.write(job.arguments.output, {}, job.key, {"reason": reason})
        return
    weights = strip_weights(CELLS, REPLICATES, np.random.default_rng([scene.seed, geometry.STREAM_CELL, CELLS]))
    with job.usage.core():
        tables = {}
        for _, of_size, sums in solved(cells, lambda _: CELLS, job.usage.progress):
            for pressure, area, force in zip(of_size.tolist(), *sums, strict=True):
                blocks = CellBlocks(area, force, *geometry.block_sizes(coarse.scene))
                tables[pressure] = statistics(coarse, blocks, weights, pressure)
        job.usage.count(solves=CELLS * len(levels))
    of_levels = [tables[pressure] for pressure in pressures]
    shear = scene.friction.mean_at_median / of_levels[levels.index(median)]["mean"]
    scaled = [rows | {name: shear * rows[name] for name in rows if name != "variation"} for rows in of_levels]
    of_strips = store.Variable(("level",), np.array(pressures), "Pa", "force over apparent area, as of the strips")
    variables = {
        "percentile": store.Variable(("level",), percentile[levels], "percent", "penetration of the strips"),
        "nominal_pressure": of_strips,
    }
    for name, title in TITLES.items():
        columns = columns_of([estimate_of(name, rows[name], CELLS) for rows in scaled])
        variables |= store.with_interval(name, ("level",), columns, "1", title)
        change = Estimate.from_rows(scaled[-1][name] - scaled[0][name], float(margin_of(name, CELLS)))
        title = f"from the first to the last level: {title}"
        variables |= store.with_interval(f"change_of_{name}", (), columns_of(change), "1", title)
    if "load_std" in scaled[0]:
        pad = estimate_of("std", scaled[levels.index(own)]["load_std"], CELLS)
        title = "standard deviation of friction of the pad that bears the force"
        variables |= store.with_interval("load_std", (), columns_of(pad), "1", title)
    store.write(job.arguments.output, variables, job.key)


def with_coarser_cells(job: Job) -> Job:
    """The job on cells of twice the edge, where these resolve the contacts and divide the windows."""
    strip = job.key.configuration["strip"]
    cell = 2.0 * strip["cell_m"]
    shortest = min(surface_model(job.scene, job.arguments.scan).lengths_m)
    parts = np.array([strip[name] / cell for name in ("width_m", "window_m", "window_spacing_m")])
    if cell * ACROSS > shortest or np.abs(parts - parts.round()).max() > ROUNDING:
        return job
    configuration = job.key.configuration | {"strip": strip | {"cell_m": cell}}
    return replace(job, key=replace(job.key, configuration=configuration))


def why_not(job: Job) -> str:
    """Why the surface has no periodic cells whose contacts are resolved; "" where it has."""
    if job.scene.roughness.fractal is not None:
        return "heights of a fractal law are not periodic"
    scan, cell = job.arguments.scan, job.scene.strip.cell_m
    model = gaussian_model(job.scene, scan)
    covariance = model.covariance if scan is None else fitted_covariance(store.read(scan))
    if covariance is not None and slope_mistake(covariance):
        return "the rms slope of the heights is infinite, so they have no real area under a pressure"
    shortest = min(model.lengths_m)
    if cell * RESOLVED > shortest:
        return f"cells of {cell:.3g} m resolve no contacts of heights with a correlation length of {shortest:.3g} m"
    return ""


def statistics(job: Job, blocks: CellBlocks, weights: np.ndarray, pressure_pa: float) -> dict[str, np.ndarray]:
    """Rows (1 + R,) of mean, std and variation of windows, and of the pad, for a shear strength of 1 Pa, by name."""
    scene = job.scene
    windows = window_statistics(
        *friction_coefficient(*blocks.windows, 1.0, geometry.least_contact_area(scene)), blocks.of_rows(weights)
    )
    rows = {name: getattr(windows, name).rows for name in TITLES}
    if scene.oscillator.normal_force_n is not None:
        count = max(scene.oscillator.normal_force_n / (pressure_pa * blocks.window_m * blocks.width_m), 1.0)
        rows["load_std"] = pad_estimates(blocks, correlated(scene, job.arguments.scan), weights, count)["load_std"].rows
    return rows
