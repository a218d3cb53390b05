"""What periodic cells say of friction: of the pad and its windows under the load, and of pads under loads about it."""

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.correlation import LENGTHS, CorrelationFit, lags_with_pairs, window_lengths
from roughslip.friction.marginal import BetaFit, fit_beta
from roughslip.friction.pad import (
    WINDOWS,
    Blocks,
    Correlation,
    Estimates,
    Surface,
    pad_edges,
    pad_estimates,
    pad_means,
    under_load,
)
from roughslip.friction.process import PAPER_SHAPES
from roughslip.friction.scatter_law import doubt_of_law, scatter_by_law
from roughslip.friction.table import describe
from roughslip.friction.table_variables import TITLES as OF_WINDOWS
from roughslip.friction.table_variables import beta_variables
from roughslip.friction.windows import (
    SCALE,
    SHAPE,
    WindowStatistics,
    estimate_of,
    friction_coefficient,
    strip_weights,
)
from roughslip.probability import Estimate
from roughslip.probability.estimate import columns_of
from roughslip.scene.part import Scene
from roughslip.study.from_scene import Stream, elastic, geometry
from roughslip.study.from_scene.surface_model import fractal_law, gaussian_model, surface_model
from roughslip.study.job import Job
from roughslip.surface.fractal import WeierstrassMandelbrot
from roughslip.surface.plausibility import ELASTIC, yielding

REPLICATES, REPLICATES_THERE = 400, 200  # under the load, and over loads
PARTS = "1", "shares of powers 1, 2, 4, 8 of the correlation of the heights, and of no correlation, in the influence"
COHERENCE = 2.0  # longest waves of a fractal
LAGS = 49  # slipped distances
BEYOND = 6.0  # correlation lengths of the heights by which it reaches over the length of the pad
TITLES = {
    "shear_strength": ((), "Pa", "shear strength that gives the pad its mean friction coefficient"),
    "real_area": ((), "1", "contact area over the apparent area"),
    "load_mean": ((), "1", "mean friction coefficient of the pad, as the scene gives it"),
    "load_std": ((), "1", "standard deviation of the friction coefficient of the pad"),
    "no_contact": ((), "1", "share of the windows without contact"),
    "pad_std": (("pad",), "1", "standard deviation of the friction coefficient of a pad of so many windows"),
    "pad_parts": (("part",), *PARTS),
}
OVER_LOADS = {
    "real_area": "contact area over the apparent area",
    "mean": "mean friction coefficient of the pad",
    "variation": "coefficient of variation of the friction coefficient of the pad",
    "no_contact": "share of the windows without contact",
}
HEAD = (
    "Friction of a pad against its load, a row a nominal pressure: contact of periodic cells of the surface",
    'Columns with _low and _high are the ends of the 95 % interval. Python: pandas.read_csv(file, comment="#")',
)


def load_results(
    job: Job, own: Blocks, others: dict[float, Blocks], solves: list[store.Result]
) -> tuple[dict[str, store.Variable], str]:
    """Statistics under the load and over loads, and the text of summary.csv.

    own, others : blocks under the load, and by nominal pressure [Pa] about it; solves : results of stage contact
    """
    scene, surface = job.scene, correlated(job.scene, job.optional("scan"))
    nominal, length = scene.load.nominal_pressure_pa, scene.load.pad_length_m
    mean, windows = scene.friction.mean, scene.oscillator.windows_in_parallel
    weights = weights_of(scene, own, REPLICATES)
    found = pad_estimates(own, surface, weights, windows, length)
    of_load = under_load(found, mean, nominal, own.samples)
    try:
        of_single, beta = of_windows(scene, own, weights, float(of_load["shear_strength"].value))
    except IllPosedError as error:
        job.warn(
            "the statistics of windows are missing; the scatter of a window is that of a pad of one, its correlation "
            f"length that of the window alone, its shapes those of the paper: {error.in_scene}"
        )
        of_single, beta = without_windows(own, of_load)
    loads = over_loads(scene, {nominal: own} | others, surface, mean)
    job.count(windows=own.area.size // own.window)
    areas = own.area.sum(axis=(1, 2))
    share = float(np.average(store.join(solves, "yielded")[:, 0], weights=areas))
    index = float(solves[0]["plasticity_index"])
    job.say(yielding(index, share))
    variables = {
        "plasticity_index": solves[0].variable("plasticity_index"),
        "yielded_share": store.Variable((), share, "1", "share of the real area that bears the hardness"),
        "nominal_pressure": store.Variable((), nominal, "Pa", "force over apparent area"),
        "windows": store.Variable((), windows, "1", "windows of the pad"),
        "pad_windows": store.Variable(("pad",), WINDOWS, "1", "windows of a pad"),
        "lag": store.Variable(("lag",), own.block_m * np.arange(of_single["autocorrelation"].value.size), "m", "lags"),
    }
    for name, (dimensions, unit, title) in TITLES.items():
        variables |= store.with_interval(name, dimensions, columns_of(of_load[name]), unit, title)
    for name, estimate in of_single.items():
        unit, along = "m" if "length_" in name else "1", ("lag",) if name == "autocorrelation" else ()
        variables |= store.with_interval(name, along, columns_of(estimate), unit, OF_WINDOWS[name])
    variables |= beta_variables([beta], ())
    if index <= ELASTIC and scene.roughness.beta_shapes is None and not job.optional("scan"):
        variables |= by_law(job)
    variables |= correlation_variables(scene, job.optional("scan"), length)
    of_loads = {"nominal_pressure": store.Variable(("load",), np.array(list(loads)), "Pa", "force over apparent area")}
    for name, title in OVER_LOADS.items():
        ends = columns_of([row[name] for row in loads.values()])
        of_loads |= store.with_interval(name, ("load",), ends, "1", title)
    columns = {"nominal_pressure_pa" if name == "nominal_pressure" else name: of_loads[name] for name in of_loads}
    variables |= {f"over_loads_{name}": variable for name, variable in of_loads.items()}
    return variables, store.table_text(HEAD, columns)


def weights_of(scene: Scene, blocks: Blocks, replicates: int) -> np.ndarray:
    """Counts (1 + replicates, cells) of resampled cells."""
    generator = np.random.default_rng([scene.seed, Stream.CELL, blocks.samples])
    return strip_weights(blocks.samples, replicates, generator)


def over_loads(scene: Scene, blocks: dict[float, Blocks], surface: Surface, mean: float) -> dict[float, Estimates]:
    """By nominal pressure, from the lightest on, what OVER_LOADS names, at the shear strength of the scene's own load.

    blocks : by nominal pressure [Pa], that of the load first; mean : friction coefficient of the pad under the load
    """
    pad = scene.oscillator.windows_in_parallel, scene.load.pad_length_m
    found = {
        pressure: pad_estimates(part, surface, weights_of(scene, part, REPLICATES_THERE), *pad)
        for pressure, part in blocks.items()
    }
    shear = mean / next(iter(found.values()))["ratio"].rows
    table: dict[float, Estimates] = {}
    for pressure, pads in sorted(found.items()):
        ratio, cells = pads["ratio"].rows, blocks[pressure].samples
        table[pressure] = {
            "real_area": estimate_of("mean", pressure * ratio, cells),
            "mean": estimate_of("mean", shear * ratio, cells),
            "variation": estimate_of("std", pads["load_std"].rows / ratio, cells),
            "no_contact": pads["no_contact"],
        }
    return table


def by_law(job: Job) -> dict[str, store.Variable]:
    """Scatter of the friction of the pad by the law of scatter: Gaussian heights, elastic contact.

    None where heights have no slope; a spectrum for which the law was not judged is warned of.
    """
    scene, strip, load = job.scene, job.scene.strip, job.scene.load
    pad = pad_edges(scene.oscillator.windows_in_parallel, strip.window_m, strip.width_m, load.pad_length_m)
    modulus, covariance = elastic.material(scene).plane_strain_modulus_pa, gaussian_model(scene).covariance
    try:
        deviation = scene.friction.mean * scatter_by_law(covariance, modulus, load.nominal_pressure_pa, pad)
    except IllPosedError as error:
        job.warn(f"the scatter of friction by the law of scatter is missing: {error.in_scene}")
        return {}
    if doubt := doubt_of_law(covariance):
        job.warn(doubt)
    title = "standard deviation of the friction coefficient of the pad by the law of scatter, without a solve"
    return {"load_std_by_law": store.Variable((), deviation, "1", title)}


def of_windows(
    scene: Scene, blocks: Blocks, weights: np.ndarray, shear_pa: float
) -> tuple[dict[str, Estimate], BetaFit]:
    """Statistics and Beta of single windows that have a friction coefficient.

    Lags go to half a period, or as far as windows with contact have partners in each resampled set of cells.
    """
    mu, valid = friction_coefficient(*blocks.windows, shear_pa, geometry.least_contact_area(scene))
    rows = blocks.of_rows(weights)
    lags = blocks.block_m * np.arange(lags_with_pairs(valid, rows, blocks.area.shape[1] // 2 + 1))
    found = describe((mu, valid), rows, lags, blocks.window_m)
    moments = ("mean", *SCALE, *SHAPE)
    found |= {name: estimate_of(name, found[name].rows, blocks.samples) for name in moments}
    return found, fit_beta(mu[valid])


def without_windows(blocks: Blocks, of_load: Estimates) -> tuple[dict[str, Estimate], BetaFit]:
    """What stands in the place of the statistics of windows that do not have them."""
    lags, unknown = blocks.block_m * np.arange(blocks.area.shape[1] // 2 + 1), Estimate(*[np.array(np.nan)] * 3)
    names = (field.name for kind in (WindowStatistics, CorrelationFit) for field in fields(kind))
    found = {f"length_{name}" if name in LENGTHS else name: unknown for name in names}
    found |= {"autocorrelation": Estimate(*[np.full(lags.size, np.nan)] * 3), "beta_distance_standardised": unknown}
    ends = [of_load["pad_std"].value, of_load["pad_std"].low, of_load["pad_std"].high]
    found |= {"mean": of_load["load_mean"], "std": Estimate(*(np.array(end[0]) for end in ends))}
    found["missing_share"] = of_load["no_contact"]
    for name, length in window_lengths(lags, blocks.window_m).items():
        found[f"length_{name}"] = Estimate(*[np.array(length)] * 3)
    return found, BetaFit(*PAPER_SHAPES, np.nan, np.nan, np.nan, True)


def correlation_variables(scene: Scene, scan: Path | None, length_m: float | None = None) -> dict[str, store.Variable]:
    """What with `pad_parts` gives the autocorrelation of the friction of a pad over the slipped distance."""
    strip, surface = scene.strip, correlated(scene, scan)
    pads = [pad_edges(count, strip.window_m, strip.width_m, length_m) for count in WINDOWS]
    lags = np.array([np.linspace(0.0, length + BEYOND * surface.lengths_m[0], LAGS) for length, _ in pads])
    sizes = strip.window_spacing_m, strip.width_m
    means = np.array([pad_means(surface, *sizes, pad, row) for pad, row in zip(pads, lags, strict=True)])
    title = "means of the parts over pairs of points of a pad and of the pad a lag behind"
    return {
        "pad_lag": store.Variable(("pad", "lag_of_pad"), lags, "m", "slipped distances"),
        "pad_means": store.Variable(("pad", "lag_of_pad", "part"), means, "1", title),
    }


def correlated(scene: Scene, scan: Path | None = None) -> Surface:
    """Correlation of the heights of the surface; of translated ones, that of the Gaussian field behind them."""
    roughness, model = scene.roughness, surface_model(scene, scan)
    if roughness.wavelengths_m is None:
        covariance: Any = gaussian_model(scene, scan).covariance
    else:
        covariance = forgotten(fractal_law(roughness))
    variance = float(covariance(0.0, 0.0))
    return Surface(lambda x, y: covariance(x, y) / variance, model.lengths_m)


def forgotten(waves: WeierstrassMandelbrot) -> Correlation:
    """The covariance of waves whose phases are lost over COHERENCE of the longest one.

    A sum of plane waves nearly repeats itself at any distance; a surface does not. A product of covariances is one.
    """
    reach = COHERENCE * waves.longest_wavelength_m
    return lambda x, y: waves(x, y) * np.exp(-(x**2 + y**2) / reach**2)
