"""Stage friction: statistics of the friction coefficient over windows, per source of pressure and penetration."""

from dataclasses import fields

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.friction.correlation import autocorrelation, correlation_fit
from roughslip.friction.marginal import distance_to_beta, fit_beta, scaled_beta
from roughslip.friction.statistics import Combined, combine, ratio_of_sums, strip_weights, window_statistics
from roughslip.probability import Estimate
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import geometry
from roughslip.stages.result_tables import friction_table
from roughslip.stages.result_tables.friction_table import SOURCES
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job, execute

STAGE = Stage(
    name="friction",
    reads="seed roughness strip friction.mean_at_median",
    reads_if_given="friction.least_contact_fraction",
    many={"contact": "contact_strip", "expansion": "expansion_strip"},
    result="friction/statistics.nc",
    outputs={"summary": "summary.csv"},
    runs_if="not friction.statistics",
    memory_mb=420,
    memory_doubles={
        "strips windows": 10,
        "expansion_strips windows": 10,
        "expansion_strips": 800,
        "windows": 9600,
    },
)

REPLICATES = 400
DESCRIBED = 4  # strips of the expansion that are described by themselves, a solved strip; the others are control alone
Windows = tuple[np.ndarray, np.ndarray]  # mu and valid, each (strips, windows)


def describe(windows: Windows, area_force: Windows, shear: float, weights: np.ndarray, job: Job) -> dict[str, Estimate]:
    """Every statistic of one source at one penetration, by the name under which it is stored."""
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
    area = {source: store.join(batches[source], "area").transpose(1, 0, 2) for source in SOURCES}
    force = {source: store.join(batches[source], "force").transpose(1, 0, 2) for source in SOURCES}
    residual = max(float(batch["residual"].max()) for batch in batches["solved"])
    strips, many = area["solved"].shape[1], area["expansion"].shape[1]
    described = {"solved": strips, "expansion": min(many, DESCRIBED * strips)}
    window_area = scene.strip.window_m * scene.strip.width_m
    least = scene.friction.least_contact_fraction * window_area
    with job.usage.core():
        generator = np.random.default_rng([scene.seed, geometry.STREAM_BOOTSTRAP])
        weights = {
            "solved": strip_weights(strips, REPLICATES, generator),
            "expansion": strip_weights(described["expansion"], REPLICATES, generator),
            "control": strip_weights(many - strips, REPLICATES, generator),
        }
        unit = {source: friction_coefficient(area[source], force[source], 1.0, least) for source in SOURCES}
        median = int(np.flatnonzero(percentiles == 50.0)[0])
        shear = scene.friction.mean_at_median / float(combined_at(unit, median, strips, weights).mean.value)
        mu = {source: (shear * unit[source][0], unit[source][1]) for source in SOURCES}
        table: dict[str, list[Estimate]] = {}
        for source in SOURCES:
            for level in range(len(percentiles)):
                part = level, slice(described[source])
                windows = (mu[source][0][part], mu[source][1][part])
                pair = (area[source][part], force[source][part])
                try:
                    estimates = describe(windows, pair, shear, weights[source], job)
                except IllPosedError as error:
                    raise IllPosedError(f"percentile {percentiles[level]:g}, {source}: {error}") from error
                for name, estimate in estimates.items():
                    table.setdefault(name, []).append(estimate)
                job.usage.progress(level + 1, len(percentiles))
        combined = [combined_at(mu, level, strips, weights) for level in range(len(percentiles))]
        law = (
            friction_table.candidate_variables(mu["solved"], weights["solved"])
            | friction_table.p_value_variables(mu["solved"], table, combined, percentiles, weights["solved"])
            | friction_table.fit_variables(combined, percentiles)
            | friction_table.white_variables(scene, strips, mu["solved"][0].shape[2])
        )
    job.usage.count(windows=area["solved"][0].size, expanded_windows=area["expansion"][0].size)
    job.usage.skip({skip_reasons.CONTROL: area["expansion"][:, described["expansion"] :].size})
    variables = friction_table.table_variables(table, combined, percentiles, scene.strip) | law
    variables |= friction_table.distribution(mu["solved"][0][median], mu["solved"][1][median])
    variables["shear_strength"] = store.Variable((), shear, "Pa", "shear strength that gives the mean at the median")
    corrected, of_nodes = (store.join(batches["solved"], f"area_{name}").T for name in ("corrected", "of_nodes"))
    ratios = [
        ratio_of_sums(one[:, None], other[:, None], 1.0, weights["solved"])
        for one, other in zip(corrected, of_nodes, strict=True)
    ]
    variables |= friction_table.stored("area_correction", ("level",), ratios)
    variables["largest_residual"] = store.Variable((), residual, "1", "largest residual of all contact solves")
    store.write(job.arguments.output, variables, job.key)
    store.write_text(job.arguments.summary, friction_table.summary(variables, percentiles))


def combined_at(mu: dict[str, Windows], level: int, strips: int, weights: dict[str, np.ndarray]) -> Combined:
    """Solved windows of a level with the expansion as control; strips from number `strips` on were never solved."""
    values, valid = mu["expansion"]
    return combine(
        (mu["solved"][0][level], mu["solved"][1][level]),
        (values[level, :strips], valid[level, :strips]),
        (values[level, strips:], valid[level, strips:]),
        weights["solved"],
        weights["control"],
    )


if __name__ == "__main__":
    execute(STAGE, work)
