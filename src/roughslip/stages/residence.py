"""Stage residence: how long stick-slip and steady sliding last near the existence limit, at several scatters."""

from dataclasses import replace

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.paths import path_sampler
from roughslip.oscillator.durations import residence
from roughslip.oscillator.limits import hopf_damping
from roughslip.oscillator.path import KeptPath
from roughslip.oscillator.states import run_until_known
from roughslip.oscillator.survival import damping_band
from roughslip.oscillator.trough_chain import theory_or_nan
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import geometry, mass_on_belt
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="residence",
    reads="seed oscillator survival",
    reads_if_given="ensemble.marginal friction.statistics friction.scatter",
    optional={"friction": "friction friction_under_load record"},
    result="oscillator/residence.nc",
    memory_mb=620,
)

NODES = 4  # per correlation length, as in the map
REACH = 4.0  # standard deviations of the limit about it, in which stick-slip lives or dies by chance
TITLES = {
    "stick_slip": "mean duration of stick-slip in natural periods, NaN where none ended",
    "sliding": "mean duration of steady sliding in natural periods, NaN where none ended",
    "share": "share of stick-slip in the time, in the long run",
}


def one_scatter(job: Job, factor: float, dampings: np.ndarray) -> dict[str, np.ndarray]:
    """Durations (points, 3) by runs and theory, and the damping (3,) of a share of a half, at one scatter."""
    scene, friction = job.scene, job.arguments.friction
    asked, numbers = scene.survival, mass_on_belt.friction_numbers(scene, friction)
    belt, law = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, numbers)
    options, periods = mass_on_belt.motion_options(scene), asked.duration_periods
    scaled = replace(numbers, standard_deviation=factor * numbers.standard_deviation)
    process = mass_on_belt.friction_process(scene, scaled, friction)
    deviation = mass_on_belt.pad_deviation(scene, scaled, friction) / mass_on_belt.unit_of_scatter(scene, numbers)
    friction_of = process.correlation_length_m, process.autocorrelation
    paths = path_sampler(process, process.correlation_length_m / NODES)
    seeds = [[scene.seed, geometry.STREAM_SURVIVAL, number] for number in range(asked.realisations)]
    kept = [KeptPath(paths.realisation(seed)) for seed in seeds]
    generator = np.random.default_rng([scene.seed, geometry.STREAM_BOOTSTRAP])
    rows: dict[str, list[np.ndarray]] = {name: [] for name in (*TITLES, *(f"{name}_by_theory" for name in TITLES))}
    shares = []
    for ratio in dampings:
        damped = replace(belt, damping_ratio=float(ratio))
        runs = [
            run_until_known(damped, law, path, paths.spacing, periods, options, sliding)[1:]
            for sliding in (False, True)
            for path in kept
        ]
        measured = residence([states for _, states in runs], generator)
        theory = theory_or_nan(damped, law, deviation, *friction_of, options)
        for name in TITLES:
            rows[name].append(finite(getattr(measured, name)))
            rows[f"{name}_by_theory"].append(finite(getattr(theory, name)[:1]))
        halves = [states.share(first + 0.5 * periods, first + periods) for first, states in runs]
        shares.append(np.nan_to_num(np.reshape(halves, (2, -1))).mean(axis=0))
    try:
        half = damping_band(dampings, np.array(shares).T, (0.5,), generator)[0]
    except IllPosedError as error:
        job.usage.warn(f"{error}; stored as NaN")
        half = np.full(3, np.nan)
    return {name: np.array(values) for name, values in rows.items()} | {"half": half}


def finite(values: np.ndarray) -> np.ndarray:
    """The values, NaN where they are infinite."""
    return np.where(np.isfinite(values), values, np.nan)


def work(job: Job) -> None:
    """Write mean durations of both states and the share of stick-slip over scatter and damping."""
    scene, friction = job.scene, job.arguments.friction
    asked, numbers = scene.survival, mass_on_belt.friction_numbers(scene, friction)
    belt, law = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, numbers)
    factors, scatters = np.array(asked.scatter_factors, dtype=np.float64), []
    deviations = factors * mass_on_belt.pad_deviation(scene, numbers, friction)
    with job.usage.core():
        response, scatter = mass_on_belt.response_of_limit(scene, belt, numbers, friction)
        hopf, width = hopf_damping(belt, law), REACH * scatter * deviations
        minimum = np.maximum(np.minimum(response.limit - width, hopf), 0.0)
        dampings = np.linspace(minimum, response.limit + width, asked.points, axis=1)
        for number, factor in enumerate(factors):
            scatters.append(one_scatter(job, float(factor), dampings[number]))
            job.usage.progress(number + 1, len(factors))
    runs, drawn = 2 * dampings.size * asked.realisations, factors.size * asked.realisations
    job.usage.count(runs=runs)
    job.usage.skip({skip_reasons.KEPT: runs - drawn})
    row, point = ("scatter",), ("scatter", "point")
    variables = {
        "scatter_factor": store.Variable(row, factors, "1", "multiple of the scene's standard deviation of friction"),
        "friction_deviation": store.Variable(row, deviations, "1", "standard deviation of the friction of all windows"),
        "residence_damping": store.Variable(point, dampings, "1", "damping ratio D"),
        "residence_limit": store.Variable((), response.limit, "1", "existence limit of the cycle"),
        "residence_hopf": store.Variable((), hopf, "1", "sliding is unstable below"),
        "unit_scatter": store.Variable((), scatter, "1", "std of the limit over that of friction, first order"),
    }
    stacked = {name: np.moveaxis(np.array([rows[name] for rows in scatters]), -1, 0) for name in scatters[0]}
    title = "damping ratio at which the share of stick-slip is a half, in the second half of the runs"
    variables |= store.with_interval("half", row, stacked["half"], "1", title)
    for name, title in TITLES.items():
        variables |= store.with_interval(name, point, stacked[name], "1", title)
        theory = f"{name}_by_theory"
        variables[theory] = store.Variable(point, stacked[theory][0], "1", f"{title}, by the chain of troughs")
    store.write(job.arguments.output, variables, job.key)
