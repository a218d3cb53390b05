"""Stage friction: statistics of the friction coefficient over windows, per source of pressure and penetration."""

from dataclasses import fields
from pathlib import Path

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.friction.combination import Combined, Others, Rows, combine, mesh_factors
from roughslip.friction.correlation import autocorrelation, correlation_fit
from roughslip.friction.marginal import SET_WINDOWS, distance_to_beta, fit_beta, scaled_beta, set_beta
from roughslip.friction.over_penetration import combined_estimates
from roughslip.friction.statistics import estimate_of, ratio_of_sums, strip_weights, window_statistics
from roughslip.probability import Estimate
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import geometry
from roughslip.stages.from_scene.strip_contact import COARSE, OTHERS
from roughslip.stages.result_tables import friction_table, load_table
from roughslip.stages.result_tables.friction_table import SOURCES
from roughslip.stages.runtime.command import Job, execute

STAGE = Stage(
    name="friction",
    reads="seed roughness strip friction.mean_at_median",
    reads_if_given="friction.least_contact_fraction load oscillator.normal_force_n strip.light_percentiles",
    many={"contact": "strip_pilot contact_strip", "expansion": "expansion_strip"},
    optional={"scan": "scan", "allocation": "strip_allocation"},
    result="friction/statistics.nc",
    outputs={"summary": "summary.csv"},
    runs_if="not friction.statistics",
    memory_mb=420,
    memory_doubles={
        "strips windows": 16,
        "expansion_strips windows": 10,
        "expansion_strips": 800,
        "windows": 9600,
    },
)

REPLICATES = 400
Windows = tuple[np.ndarray, np.ndarray]  # mu and valid, or area and force, each (..., strips, windows)


def describe(windows: Windows, area_force: Windows, shear: float, weights: np.ndarray, job: Job) -> dict[str, Estimate]:
    """Every statistic of the solved windows at one penetration, by the name under which it is stored."""
    strip = job.scene.strip
    statistics = window_statistics(*windows, weights)
    estimates = {
        f.name: getattr(statistics, f.name) for f in fields(statistics) if f.name not in ("windows", "missing")
    }
    estimates["ratio_of_sums"] = ratio_of_sums(*area_force, shear, weights)
    lags = strip.window_spacing_m * np.arange(windows[0].shape[1])
    estimates["autocorrelation"] = autocorrelation(*windows, len(lags), weights)
    fit = correlation_fit(lags, estimates["autocorrelation"], strip.window_m)
    for name in ("least_squares", "half_window", "one_over_e", "integral"):
        estimates[f"length_{name}"] = getattr(fit, name)
    for name in ("misfit_exponential", "misfit_triangle", "misfit_difference"):
        estimates[name] = getattr(fit, name)
    beta, scaled = fit_beta(*windows, weights), scaled_beta(*windows, weights)
    for shape in ("a", "b", "lower", "upper"):
        estimates[f"beta_{shape}"], estimates[f"scaled_beta_{shape}"] = getattr(beta, shape), getattr(scaled, shape)
    estimates["beta_misfit"] = beta.distance
    sets = np.random.default_rng([job.scene.seed, geometry.STREAM_BOOTSTRAP, SET_WINDOWS])
    estimates["set_beta_a"], estimates["set_beta_b"] = set_beta(*windows, sets)
    distance = distance_to_beta(*windows, weights)
    estimates["beta_distance_standardised"] = distance.standardised
    estimates["beta_distance_scaled"] = distance.scaled
    return estimates


def work(job: Job) -> None:
    """Calibrate the shear strength at the median, then write every statistic with its interval, and summary.csv."""
    scene = job.scene
    percentiles = np.array(scene.strip.penetration_percentiles, dtype=float)
    batches = {
        source: store.read_all(getattr(job.arguments, option))
        for source, option in (("solved", "contact"), ("expansion", "expansion"))
    }
    windows_of = {source: area_and_force(batches[source]) for source in SOURCES}
    for mesh in (COARSE, OTHERS):
        if any(f"{mesh}area" in batch for batch in batches["solved"]):
            windows_of[mesh] = area_and_force(batches["solved"], mesh)
    residual = max(float(batch["residual"].max()) for batch in batches["solved"])
    strips, many = (windows_of[source][0].shape[1] for source in SOURCES)
    window_area = scene.strip.window_m * scene.strip.width_m
    least = scene.friction.least_contact_fraction * window_area
    with job.usage.core():
        generator = np.random.default_rng([scene.seed, geometry.STREAM_BOOTSTRAP])
        others = windows_of[OTHERS][0].shape[1] if OTHERS in windows_of else 0
        groups = {"solved": strips, "control": many - strips - others} | ({OTHERS: others} if others else {})
        weights = {name: strip_weights(count, REPLICATES, generator) for name, count in groups.items()}
        factors = mesh_factors(REPLICATES, generator)
        unit = {source: friction_coefficient(*pair, 1.0, least) for source, pair in windows_of.items()}
        median = int(np.flatnonzero(percentiles == 50.0)[0])
        mean = scene.friction.mean_at_median
        best = [combined_at(unit, level, weights, factors) for level in range(len(percentiles))]
        shear = estimate_of("mean", mean / np.exp(best[median].rows["mean"]), strips)
        best = [one.calibrated(mean, best[median]) for one in best]
        lags = scene.strip.window_spacing_m * np.arange(unit["solved"][0].shape[2])
        combined = combined_estimates(best, lags, scene.strip.window_m)
        mu = float(shear.value) * unit["solved"][0], unit["solved"][1]
        table: dict[str, list[Estimate]] = {}
        for level, percentile in enumerate(percentiles):
            windows, pair = ((values[level], other[level]) for values, other in (mu, windows_of["solved"]))
            try:
                estimates = describe(windows, pair, float(shear.value), weights["solved"], job)
            except IllPosedError as error:
                raise IllPosedError(f"percentile {percentile:g}: {error}") from error
            for name, estimate in estimates.items():
                table.setdefault(name, []).append(estimate)
            job.usage.progress(level + 1, len(percentiles))
        for name in friction_table.BY_SOURCE:
            rows = ((shear.value * np.exp(one.control[name]), one.strips[1]) for one in best)
            table[name] += [estimate_of(name, *one) for one in rows]
        loads = load_table.load_table(job, batches["solved"], (table, combined), shear, weights["solved"])
        light = load_table.light_table(job, batches["solved"], (table, combined), shear, weights["solved"])
        law = (
            friction_table.candidate_variables(mu, weights["solved"])
            | friction_table.p_value_variables(mu, combined, percentiles, weights["solved"])
            | friction_table.fit_variables(combined["mean"], percentiles)
            | friction_table.window_variables(scene, strips, lags, combined["autocorrelation"][median])
        )
    solved_windows, expanded = (windows_of[source][0] for source in SOURCES)
    job.usage.warn(*friction_table.missing_warnings(table["missing_share"], percentiles))
    got = reached(job.arguments.allocation, percentiles, combined)
    job.usage.count(windows=solved_windows[0].size, expanded_windows=expanded[0].size, **got)
    variables = friction_table.table_variables(table, combined, percentiles, scene.strip) | law
    variables |= friction_table.error_variables(best) | load_table.load_variables(scene, loads, light)
    variables |= friction_table.distribution(mu[0][median], mu[1][median]) | friction_table.histograms(mu)
    ends, title = [shear.value, shear.low, shear.high], "shear strength that gives the mean at the median"
    variables |= store.with_interval("shear_strength", (), ends, "Pa", title)
    corrected, of_nodes = (store.join(batches["solved"], f"area_{name}").T for name in ("corrected", "of_nodes"))
    ratios = [
        ratio_of_sums(one[:, None], other[:, None], 1.0, weights["solved"])
        for one, other in zip(corrected, of_nodes, strict=True)
    ]
    variables |= friction_table.stored("area_correction", ("level",), ratios)
    variables["largest_residual"] = store.Variable((), residual, "1", "largest residual of all contact solves")
    store.write(job.arguments.output, variables, job.key, {"strips": strips} if job.arguments.allocation else None)
    store.write_text(job.arguments.summary, friction_table.summary(variables, percentiles))


def reached(path: Path | None, percentiles: np.ndarray, combined: dict[str, list[Estimate]]) -> dict[str, float]:
    """Largest relative half width by statistic, of the numbers that an accuracy was asked of. path : the allocation"""
    widths: dict[str, float] = {}
    if path is None:
        return widths
    allocation = store.read(path)
    for percentile, statistic in zip(allocation["percentile"], allocation["statistic"], strict=True):
        one = combined[str(statistic).removeprefix("friction_")][int(np.flatnonzero(percentiles == percentile)[0])]
        name, width = f"{statistic}_reached", float((one.high - one.low) / 2 / one.value)
        widths[name] = max(widths.get(name, 0.0), round(width, 5))
    return widths


def area_and_force(batches: list[store.Result], mesh: str = "") -> Windows:
    """Area [m2] and force [N] : (levels, strips, windows) of a source."""
    parts = [batch for batch in batches if f"{mesh}area" in batch]
    area, force = (store.join(parts, mesh + name).transpose(1, 0, 2) for name in ("area", "force"))
    return area, force


def combined_at(mu: dict[str, Windows], level: int, weights: dict[str, np.ndarray], factors: Rows) -> Combined:
    """Solved windows of a level with their controls. Strips of the expansion are numbered: solved, others, all else."""
    at_level = {source: (values[level], valid[level]) for source, (values, valid) in mu.items()}
    first = weights["solved"].shape[1]
    last = first + (weights[OTHERS].shape[1] if OTHERS in weights else 0)
    same, of_others, many = (
        tuple(one[part] for one in at_level["expansion"])
        for part in (slice(first), slice(first, last), slice(last, None))
    )
    return combine(
        at_level["solved"],
        same,
        many,
        weights["solved"],
        weights["control"],
        at_level.get(COARSE),
        factors,
        Others(at_level[OTHERS], of_others, weights[OTHERS]) if OTHERS in at_level else None,
    )


if __name__ == "__main__":
    execute(STAGE, work)
