"""Stage friction: statistics of the friction coefficient over windows, per source of pressure and penetration."""

from pathlib import Path

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.combination import mesh_factors
from roughslip.friction.description import describe
from roughslip.friction.level import Windows, group_weights, levels_of_sums
from roughslip.friction.marginal import SET_WINDOWS
from roughslip.friction.over_penetration import calibrated_levels, combined_estimates
from roughslip.friction.statistics import estimate_of, ratio_of_sums
from roughslip.probability import Estimate
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import geometry
from roughslip.stages.from_scene.strip_contact import COARSE, FINE, OTHERS
from roughslip.stages.result_tables import friction_table, load_table
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


def work(job: Job) -> None:
    """Calibrate the shear strength at the median, then write every statistic with its interval, and summary.csv."""
    scene, batches = job.scene, store.read_all(job.arguments.contact)
    percentiles = np.array(scene.strip.penetration_percentiles, dtype=float)
    sums, expanded = area_and_force(batches), area_and_force(store.read_all(job.arguments.expansion))
    with job.usage.core():
        generator = np.random.default_rng([scene.seed, geometry.STREAM_BOOTSTRAP])
        levels = levels_of_sums(geometry.least_contact_area(scene), sums, expanded, coarse_sums(batches))
        weights, factors = group_weights(levels, REPLICATES, generator), mesh_factors(REPLICATES, generator)
        best, shear = calibrated_levels(percentiles, levels, weights, factors, scene.friction.mean_at_median)
        lags = scene.strip.window_spacing_m * np.arange(levels[0].mu.shape[2])
        combined = combined_estimates(best, lags, scene.strip.window_m)
        mu, strips = (float(shear.value) * levels[0].mu, levels[0].valid), levels[0].strips
        table = described(job, mu, sums, shear, weights[0])
        for name in friction_table.BY_SOURCE:
            rows = ((shear.value * np.exp(each.control[name]), each.strips[1]) for each in best)
            table[name] += [estimate_of(name, *pair) for pair in rows]
        loads, light = (
            of_load(job, batches, (table, combined), shear, weights[0])
            for of_load in (load_table.load_table, load_table.light_table)
        )
        law = friction_table.law_variables(scene, mu, combined, weights[0])
    job.usage.warn(*friction_table.missing_warnings(table["missing_share"], percentiles))
    got = reached(job.arguments.allocation, percentiles, combined)
    job.usage.count(windows=sums[0][0].size, expanded_windows=expanded[0][0].size, **got)
    variables = friction_table.table_variables(table, combined, percentiles, scene.strip) | law
    variables |= friction_table.error_variables(best) | load_table.load_variables(scene, loads, light)
    variables |= friction_table.windows_variables(mu, int(np.flatnonzero(percentiles == 50.0)[0]))
    variables |= friction_table.solve_variables(batches, shear, weights[0])
    store.write(job.arguments.output, variables, job.key, {"strips": strips} if job.arguments.allocation else None)
    store.write_text(job.arguments.summary, friction_table.summary(variables, percentiles))


def described(job: Job, mu: Windows, sums: Windows, shear: Estimate, weights: np.ndarray) -> dict[str, list[Estimate]]:
    """Statistics of the solved windows, by name those of each penetration."""
    strip = job.scene.strip
    table: dict[str, list[Estimate]] = {}
    lags = strip.window_spacing_m * np.arange(mu[0].shape[2])
    for number, percentile in enumerate(strip.penetration_percentiles):
        sets = np.random.default_rng([job.scene.seed, geometry.STREAM_BOOTSTRAP, SET_WINDOWS])
        try:
            estimates = describe((mu[0][number], mu[1][number]), weights, lags, strip.window_m, sets)
            area, force = (values[number] for values in sums)
            estimates["ratio_of_sums"] = ratio_of_sums(area, force, float(shear.value), weights)
        except IllPosedError as error:
            raise IllPosedError(f"percentile {percentile:g}: {error}") from error
        for name, estimate in estimates.items():
            table.setdefault(name, []).append(estimate)
        job.usage.progress(number + 1, len(strip.penetration_percentiles))
    return table


def reached(path: Path | None, percentiles: np.ndarray, combined: dict[str, list[Estimate]]) -> dict[str, float]:
    """Largest relative half width by statistic, of the numbers that an accuracy was asked of. path : the allocation"""
    widths: dict[str, float] = {}
    if path is None:
        return widths
    allocation = store.read(path)
    for percentile, statistic in zip(allocation["percentile"], allocation["statistic"], strict=True):
        estimate = combined[str(statistic).removeprefix("friction_")][int(np.flatnonzero(percentiles == percentile)[0])]
        name, width = f"{statistic}_reached", float((estimate.high - estimate.low) / 2 / estimate.value)
        widths[name] = max(widths.get(name, 0.0), round(width, 5))
    return widths


def area_and_force(batches: list[store.Result], mesh: str = FINE) -> Windows:
    """Area [m2] and force [N] : (levels, strips, windows) on a mesh."""
    parts = [batch for batch in batches if f"{mesh}area" in batch]
    area, force = (store.join(parts, mesh + name).transpose(1, 0, 2) for name in ("area", "force"))
    return area, force


def coarse_sums(batches: list[store.Result]) -> Windows | None:
    """The same on cells of twice the edge, of the solved strips and then of those on these cells alone, if any."""
    meshes = [mesh for mesh in (COARSE, OTHERS) if any(f"{mesh}area" in batch for batch in batches)]
    if not meshes:
        return None
    area, force = zip(*(area_and_force(batches, mesh) for mesh in meshes), strict=True)
    return np.concatenate(area, axis=1), np.concatenate(force, axis=1)


if __name__ == "__main__":
    execute(STAGE, work)
