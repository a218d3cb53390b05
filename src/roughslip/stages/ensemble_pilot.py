"""Stage ensemble_pilot: as many runs, and nodes of friction paths, as the accuracy asked of the mean counts takes."""

from dataclasses import replace

import numpy as np

from roughslip import store
from roughslip.limits import MOST_RUNS
from roughslip.oscillator.counts import ensemble as ensemble_counts
from roughslip.oscillator.path import KeptPath
from roughslip.oscillator.run_numbers import SCATTER_FACTOR, RunErrors
from roughslip.probability.pilot import Pilot
from roughslip.scene.declarations import Stage
from roughslip.scene.fields import unless_auto
from roughslip.stages.from_scene import geometry, mass_on_belt
from roughslip.stages.from_scene.variation import damping_ratios
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="ensemble_pilot",
    reads="seed oscillator ensemble accuracy.cycles accuracy.cost_limit_cpu_s",
    reads_if_given="friction.statistics friction.scatter",
    optional={"friction": "friction friction_under_load"},
    result="oscillator/allocation.nc",
    runs_if="accuracy.cycles",
    memory_mb=620,
)

RUNS, NODES = 24, 8  # of the pilot, and per correlation length
PERIOD_S = 2.5e-5  # CPU time of a natural period of a run, measured on resolved


def pilot_counts(job: Job) -> np.ndarray:
    """(2, RUNS, dampings) cycles of the pilot, with less scatter of friction and with more."""
    scene = job.scene
    numbers = mass_on_belt.friction_numbers(scene, job.arguments.friction)
    belt, law = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, numbers.mean)
    periods, dampings = scene.ensemble.duration_periods, damping_ratios(scene, numbers, job.arguments.friction)
    options, over = mass_on_belt.motion_options(scene), {"damping": dampings}
    std = numbers.standard_deviation
    counts = np.empty((2, RUNS, len(dampings)))
    for row, factor in zip(counts, (1 / SCATTER_FACTOR, SCATTER_FACTOR), strict=True):
        scattering = replace(numbers, standard_deviation=factor * std)
        process = mass_on_belt.friction_process(scene, scattering, job.arguments.friction)
        paths = mass_on_belt.friction_paths(scene, process, NODES)
        for number in range(RUNS):
            path = KeptPath(paths.realisation([scene.seed, geometry.STREAM_PILOT, number]))
            counted = ensemble_counts(belt, law, [path], paths.spacing, periods, over=over, options=options)
            row[number] = counted.cycles[0]
            job.usage.progress(number + 1, RUNS)
    return counts


def work(job: Job) -> None:
    """Write nodes and runs. Raises IllPosedError where the accuracy asked is out of their reach."""
    ensemble, accuracy = job.scene.ensemble, job.scene.accuracy
    with job.usage.core():
        counts = pilot_counts(job)
    errors = RunErrors.of_pilot(counts)
    each = PERIOD_S * counts.shape[-1] * ensemble.duration_periods
    limits = ensemble.drawn_realisations, min(MOST_RUNS, int(accuracy.cost_limit_cpu_s / each))
    given = unless_auto(ensemble.nodes_per_correlation_length), unless_auto(ensemble.realisations)
    nodes, runs = Pilot(
        {"cycles": accuracy.cycles},
        lambda asked: errors.numbers(asked["cycles"], *given, limits),
        lambda: (
            f"raise accuracy.cost_limit_cpu_s, as only {limits[1]} runs are within it and {MOST_RUNS} in all, or "
            "take fewer ensemble.damping_ratios"
        ),
    ).numbers()
    from_nodes = errors.from_nodes(nodes)
    job.usage.count(
        runs=counts.size,
        runs_chosen=runs,
        nodes_chosen=nodes,
        cycles_asked=accuracy.cycles,
        cycles_from_nodes=round(from_nodes, 3),
        cycles_expected=round(from_nodes + errors.from_runs(runs, safe=False), 3),
    )
    title = "error of the mean counts, at most, from the nodes of the paths"
    variables = {
        "nodes_per_correlation_length": store.Variable((), nodes, "1", "nodes per correlation length taken"),
        "runs": store.Variable((), runs, "1", "runs for each damping ratio"),
        "from_nodes": store.Variable((), from_nodes, "1", title),
    }
    store.write(job.arguments.output, variables, job.key)
