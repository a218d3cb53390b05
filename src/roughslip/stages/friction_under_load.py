"""Stage friction_under_load: friction of the pad and of its windows under the load, from periodic cells."""

import numpy as np

from roughslip import store
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.friction.marginal import SET_WINDOWS
from roughslip.friction.pad import WINDOWS, pad_edges
from roughslip.friction.scatter_law import scatter_of_friction
from roughslip.friction.statistics import SCALE, SHAPE, estimate_of, strip_weights
from roughslip.friction.table import describe
from roughslip.friction.table_variables import TITLES as OF_WINDOWS
from roughslip.friction.under_load import CellBlocks, pad_estimates, under_load
from roughslip.probability import Estimate
from roughslip.probability.estimate import columns_of
from roughslip.scene.declarations import Stage
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import elastic, geometry
from roughslip.stages.from_scene.streams import Stream
from roughslip.stages.from_scene.surface_model import gaussian_model
from roughslip.stages.result_tables.pad_autocorrelation import PARTS, correlated, correlation_variables
from roughslip.stages.runtime.command import Job
from roughslip.surface.plausibility import ELASTIC

STAGE = Stage(
    name="friction_under_load",
    reads="seed material roughness strip.cell_m strip.width_m strip.window_m strip.window_spacing_m "
    "friction.mean_at_median friction.least_contact_fraction oscillator.windows_in_parallel load",
    inputs={"contact": "contact_periodic"},
    optional={"scan": "scan"},
    result="friction/under_load.nc",
    runs_if="load and not friction.statistics and not friction.record",
    memory_mb=620,
)

REPLICATES = 400
BY_LAW = "standard deviation of the friction coefficient of the pad by the law of scatter, without a solve"
TITLES = {
    "shear_strength": ((), "Pa", "shear strength that gives the pad its mean friction coefficient"),
    "real_area": ((), "1", "contact area over the apparent area"),
    "load_mean": ((), "1", "mean friction coefficient of the pad, as the scene gives it"),
    "load_std": ((), "1", "standard deviation of the friction coefficient of the pad"),
    "no_contact": ((), "1", "share of the windows without contact"),
    "pad_std": (("pad",), "1", "standard deviation of the friction coefficient of a pad of so many windows"),
    "pad_parts": (("part",), *PARTS),
}


def work(job: Job) -> None:
    """Write the statistics with their intervals."""
    scene, contact = job.scene, store.read(job.arguments.contact)
    blocks = CellBlocks(contact["block_area"], contact["block_force"], *geometry.block_sizes(scene))
    weights = strip_weights(blocks.cells, REPLICATES, np.random.default_rng([scene.seed, Stream.CELL, blocks.cells]))
    mean, windows = scene.load.mean_friction or scene.friction.mean_at_median, scene.oscillator.windows_in_parallel
    with job.usage.core():
        found = pad_estimates(blocks, correlated(scene, job.arguments.scan), weights, windows, scene.load.pad_length_m)
        of_load = under_load(found, mean, scene.load.nominal_pressure_pa, blocks.cells)
        own = of_windows(scene, blocks, weights, float(of_load["shear_strength"].value))
    job.usage.count(windows=blocks.cells * blocks.area[0].size // blocks.window)
    variables = {
        "nominal_pressure": store.Variable((), scene.load.nominal_pressure_pa, "Pa", "force over apparent area"),
        "windows": store.Variable((), windows, "1", "windows of the pad"),
        "pad_windows": store.Variable(("pad",), WINDOWS, "1", "windows of a pad"),
        "lag": store.Variable(("lag",), blocks.block_m * np.arange(own["autocorrelation"].value.size), "m", "lags"),
    }
    for name, (dimensions, unit, title) in TITLES.items():
        variables |= store.with_interval(name, dimensions, columns_of(of_load[name]), unit, title)
    for name, estimate in own.items():
        unit, lag = "m" if "length_" in name else "1", ("lag",) if name == "autocorrelation" else ()
        variables |= store.with_interval(name, lag, columns_of(estimate), unit, OF_WINDOWS[name])
    if float(contact["plasticity_index"]) <= ELASTIC and scene.roughness.marginal is None and not job.arguments.scan:
        variables["load_std_by_law"] = store.Variable((), mean * by_law(scene), "1", BY_LAW)
    store.write(
        job.arguments.output,
        variables | correlation_variables(scene, job.arguments.scan, scene.load.pad_length_m),
        job.key,
    )


def by_law(scene: Scene) -> float:
    """Coefficient of variation of the friction of the pad by the law of scatter: Gaussian heights, elastic contact."""
    strip, load = scene.strip, scene.load
    pad = pad_edges(scene.oscillator.windows_in_parallel, strip.window_m, strip.width_m, load.pad_length_m)
    modulus = elastic.material(scene).plane_strain_modulus_pa
    return scatter_of_friction(gaussian_model(scene).covariance, modulus, load.nominal_pressure_pa, pad)


def of_windows(scene: Scene, blocks: CellBlocks, weights: np.ndarray, shear_pa: float) -> dict[str, Estimate]:
    """Statistics of single windows that have a friction coefficient, over lags of half a period at most."""
    mu, valid = friction_coefficient(*blocks.windows, shear_pa, geometry.least_contact_area(scene))
    lags = blocks.block_m * np.arange(blocks.area.shape[1] // 2 + 1)
    sets = np.random.default_rng([scene.seed, Stream.CELL, SET_WINDOWS])
    found = describe((mu, valid), blocks.of_rows(weights), lags, blocks.window_m, sets)
    moments = ("mean", *SCALE, *SHAPE)
    return found | {name: estimate_of(name, found[name].rows, blocks.cells) for name in moments}
