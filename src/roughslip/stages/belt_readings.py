"""Stage belt_readings: the mass on the belt as the paper's text can also be taken, one small ensemble for each reading.

Each reading changes one thing against the ensemble of figure 5. Their places in the text stand with the statements.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np

from roughslip import store
from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.oscillator.counts import ensemble as ensemble_counts
from roughslip.oscillator.limits import limit_cycle, limits_or_nan
from roughslip.oscillator.motion import simulate
from roughslip.oscillator.path import KeptPath
from roughslip.probability.distributions import nearest_level
from roughslip.scene.declarations import Stage
from roughslip.scene.fields import unless_auto
from roughslip.scene.types import Scene, scene_of
from roughslip.stages.from_scene import geometry, mass_on_belt
from roughslip.stages.from_scene.mass_on_belt import FrictionNumbers
from roughslip.stages.result_tables.ensemble_table import Runs, ensemble_variables
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="belt_readings",
    reads="seed oscillator ensemble",
    reads_if_given="friction.statistics friction.scatter",
    optional={"friction": "friction friction_under_load record"},
    result="oscillator/readings.nc",
    target="readings",
    memory_mb=620,
)

RUNS = 80  # of each reading, at most those of the scene: if all show a cycle, the interval of the share lies above 0.95
NODES = 4  # of a path per correlation length
PAPER_LENGTH = 250e-6  # m
CURVE, BEYOND = (0.75, 0.9, 0.997, 1.003, 1.03, 1.1, 1.2), (1.003, 1.03)  # damping ratios over the limit of existence
Reading = tuple[str, Scene, FrictionNumbers, tuple[float, ...]]


def readings(job: Job) -> Iterator[Reading]:
    """Name, scene and friction of each reading, and its damping ratios over the limit beside its own."""
    section, statistics = job.scene.oscillator, job.arguments.friction
    numbers = mass_on_belt.friction_numbers(job.scene, statistics)
    friction = mass_on_belt.of_windows(statistics)
    if friction is not None and section.penetration_percentile is not None:
        others = friction["percentile"] != section.penetration_percentile
        level = nearest_level(friction["beta_distance_standardised"], friction["combined_skewness"], others)
        scene = _changed(job, "oscillator", penetration_percentile=float(friction["percentile"][level]))
        yield "nearest_penetration", scene, mass_on_belt.friction_numbers(scene, statistics), CURVE
    own = replace(numbers, correlation_length_m=PAPER_LENGTH, shape=None)
    yield "paper_process", _changed(job, "ensemble", marginal="paper"), own, BEYOND
    yield "belt_travel", _changed(job, "oscillator", friction_follows="belt"), numbers, BEYOND
    yield "mean_stick_limit", _changed(job, "oscillator", stochastic_static_limit=False), numbers, BEYOND
    damping, rate = section.damping_ratio, section.mass_kg * section.natural_frequency_rad_per_s
    yield "half_damping", _changed(job, "oscillator", damping_ratio=damping / 2), numbers, ()
    yield "plain_damping", _changed(job, "oscillator", damping_ratio=damping / (2 * rate)), numbers, ()


def _changed(job: Job, section: str, **keys: object) -> Scene:
    """The scene with other values in a section."""
    values = job.key.configuration
    return scene_of(values | {section: values[section] | keys}, STAGE.keys)


_limits = cache(limits_or_nan)  # the readings share them, unless the law is another


def work(job: Job) -> None:
    """Write for each reading what stage cycles writes for the ensemble, its name before that of each variable."""
    variables: dict[str, store.Variable] = {}
    with job.usage.core():
        for name, scene, numbers, of_limit in readings(job):
            percentile = scene.oscillator.penetration_percentile
            results = _summed_up(job, scene, numbers, of_limit) | {
                "percentile": store.Variable((), np.nan if percentile is None else percentile, "percent", "penetration")
            }
            for key, variable in results.items():
                dimensions = tuple(f"{name}_{dimension}" for dimension in variable.dimensions)
                variables[f"{name}_{key}"] = variable._replace(dimensions=dimensions)
    store.write(job.arguments.output, variables, job.key)


def _summed_up(
    job: Job, scene: Scene, numbers: FrictionNumbers, of_limit: tuple[float, ...]
) -> dict[str, store.Variable]:
    """The runs of one reading around its own limit of existence, and at its own damping ratio."""
    ensemble, statistics = scene.ensemble, job.arguments.friction
    belt, law = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, numbers)
    process = mass_on_belt.friction_process(scene, numbers, statistics)
    is_free = belt.excitation_force_n == 0
    hopf, limit = _limits(replace(belt, damping_ratio=0.0), law) if is_free else (np.nan, np.nan)
    nominal = belt.damping_ratio
    dampings = sorted({nominal, *(factor * limit for factor in of_limit if np.isfinite(limit))})
    options, periods = mass_on_belt.motion_options(scene), ensemble.duration_periods
    over, on_slip = {"damping": dampings}, replace(options, friction_follows="slip")
    plain = ensemble_counts(belt, law, [None], duration_periods=periods, over=over, options=on_slip)
    count = min(RUNS, unless_auto(ensemble.realisations) or RUNS)
    drawn = mass_on_belt.friction_paths(scene, process, NODES)
    paths = [KeptPath(drawn.realisation([scene.seed, geometry.STREAM_PROCESS, number])) for number in range(count)]
    counts = ensemble_counts(belt, law, paths, drawn.spacing, periods, over=over, options=options)
    motions = [simulate(belt, law, path, drawn.spacing, periods, options) for path in paths]
    places = [motion.reattachments(mass_on_belt.DISCARDED_PERIODS) for motion in motions]
    nominal_last_cycle = np.array([motion.last_cycle for motion in motions])
    owner = np.repeat(np.arange(count), [len(place) for place in places])
    of_counts = counts.cycles, counts.micro_slips, counts.last_cycle, counts.stick_slip
    runs = Runs(*of_counts, nominal_last_cycle, np.concatenate(places), owner)
    try:
        period = limit_cycle(belt, law).period if is_free else np.nan
    except (IllPosedError, ConvergenceError):
        period = np.nan
    without = {
        "damping_ratio": np.array(dampings),
        "cycles": plain.cycles[0],
        "period": np.array(period),
        "hopf_damping": np.array(hopf),
        "existence_limit": np.array(limit),
    }
    job.usage.count(runs=count * (len(dampings) + 1) + len(dampings), cycles=int(runs.cycles.sum()))
    generator = np.random.default_rng([scene.seed, geometry.STREAM_BOOTSTRAP])
    return ensemble_variables(without, runs, (periods, nominal), generator, job.usage.warn)
