"""Stage ensemble_pilot: as many runs, and nodes of friction paths, as the accuracy asked of the mean counts takes.

Few runs show how the counts scatter, and how they follow the standard deviation of friction: each path is run with
its scatter a quarter larger, and as much smaller. Between its nodes an interpolated path scatters less than the process
does, by a share that its covariance gives. The mean counts then err by this share times their derivative by the
logarithm of the standard deviation. Sums over many nodes lose less of their scatter, so that this bounds the error.

A path that is read at half its nodes is no measure of it. Near the limit of existence a motion forgets the details of
a path within a few cycles. It then counts like another path.
"""

import math
from dataclasses import replace

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.limits import MOST_RUNS
from roughslip.oscillator.counts import ensemble_counts
from roughslip.oscillator.path import KeptPath
from roughslip.probability.estimate import student_95, variance_margin
from roughslip.scene.declarations import Stage
from roughslip.scene.expansion import AUTO
from roughslip.stages.from_scene import geometry, mass_on_belt
from roughslip.stages.from_scene.own_limits import damping_ratios
from roughslip.stages.runtime.command import Job, execute

STAGE = Stage(
    name="ensemble_pilot",
    reads="seed oscillator ensemble accuracy.cycles accuracy.cost_limit_cpu_s",
    reads_if_given="friction.statistics",
    optional={"friction": "friction"},
    result="oscillator/allocation.nc",
    runs_if="accuracy.cycles",
    memory_mb=520,
    memory_doubles={"path_nodes": 10, "drawn_realisations": 32_000, "periods": 2000},
)

RUNS, NODES = 24, 8  # of the pilot, and per correlation length
FACTOR = 1.25  # of the standard deviation, and its inverse
SHARE = 0.25  # of the accuracy, for the nodes of the paths
NUMBERS_OF_NODES = (2, 4, 8, 16, 32, 64)
FEWEST_RUNS = 8
PERIOD_S = 2.5e-5  # CPU time of a natural period of a run, measured on resolved


def missing_scatter(nodes: int) -> float:
    """Share of the standard deviation that a path of so many nodes a correlation length misses between them.

    For the autocorrelation exp(-s / L), and the weights of `oscillator.path` of four nodes in a row.
    """
    correlation = np.exp(-np.abs(np.subtract.outer(np.arange(4), np.arange(4))) / nodes)
    t = (np.arange(64) + 0.5) / 64
    before, after = 0.5 * t * (1 - t) ** 2, 0.5 * t**2 * (1 - t)
    start, end = 1 - 2.5 * t**2 + 1.5 * t**3, 0.5 * t + 2 * t**2 - 1.5 * t**3
    weights = np.array([-before, start, end, -after])
    return 1.0 - float(np.sqrt(np.einsum("it,ij,jt->t", weights, correlation, weights)).mean())


def half_width(deviation: np.ndarray, pilot: int, runs: int, *, safe: bool = True) -> float:
    """Largest half width of Student's 95 % interval of the mean counts of so many runs.

    deviation : (dampings,) of the counts of the pilot's runs
    safe : whether to allow for their own error, else as expected
    """
    margin = math.sqrt(variance_margin(pilot)) if safe else 1.0
    return margin * float(deviation.max()) * float(student_95(runs)) / math.sqrt(runs)


def runs_for(deviation: np.ndarray, pilot: int, largest: float) -> int:
    """Runs with which no half width is above `largest`; more than MOST_RUNS stand for any number above that."""
    runs = FEWEST_RUNS
    while runs <= MOST_RUNS and half_width(deviation, pilot, runs) > largest:
        runs = math.ceil(1.02 * runs)
    return runs


def pilot_counts(job: Job) -> np.ndarray:
    """(2, RUNS, dampings) cycles of the pilot, with less scatter of friction and with more."""
    scene = job.scene
    numbers = mass_on_belt.friction_numbers(scene, job.arguments.friction)
    belt, law = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, numbers.mean)
    periods, dampings = scene.ensemble.duration_periods, damping_ratios(scene, numbers, job.arguments.friction)
    options = mass_on_belt.motion_options(scene)
    std = numbers.standard_deviation
    counts = np.empty((2, RUNS, len(dampings)))
    for row, factor in zip(counts, (1 / FACTOR, FACTOR), strict=True):
        scattering = replace(numbers, standard_deviation=factor * std)
        process = mass_on_belt.friction_process(scene, scattering, job.arguments.friction)
        paths = mass_on_belt.friction_paths(scene, process, NODES)
        for number in range(RUNS):
            path = KeptPath(paths.realisation([scene.seed, geometry.STREAM_PILOT, number]))
            row[number] = ensemble_counts(belt, law, path, paths.spacing, periods, dampings, options).cycles
            job.usage.progress(number + 1, RUNS)
    return counts


def steepest_slope(counts: np.ndarray) -> float:
    """Largest derivative of a mean count by the logarithm of the standard deviation of friction, at most, with 95 %."""
    slope = (counts[1] - counts[0]) / (2 * math.log(FACTOR))
    return float(np.max(np.abs(slope.mean(axis=0)) + 2 * slope.std(axis=0, ddof=1) / math.sqrt(RUNS)))


def work(job: Job) -> None:
    """Write nodes and runs. Raises IllPosedError where the accuracy asked is out of their reach."""
    ensemble, asked = job.scene.ensemble, job.scene.accuracy.cycles
    with job.usage.core():
        counts = pilot_counts(job)
    slope, deviation = steepest_slope(counts), np.sqrt(counts.var(axis=1, ddof=1).mean(axis=0))
    errors = {nodes: slope * missing_scatter(nodes) for nodes in NUMBERS_OF_NODES}
    fewest = next((one for one in NUMBERS_OF_NODES if errors[one] <= SHARE * asked), NUMBERS_OF_NODES[-1])
    nodes = fewest if ensemble.nodes_per_correlation_length == AUTO else int(ensemble.nodes_per_correlation_length)
    from_nodes = slope * missing_scatter(nodes)
    if ensemble.realisations == AUTO:
        runs = max(runs_for(deviation, RUNS, asked - from_nodes), ensemble.drawn_realisations)
        each = PERIOD_S * counts.shape[-1] * ensemble.duration_periods
        affordable = min(MOST_RUNS, int(job.scene.accuracy.cost_limit_cpu_s / each))
        if runs > affordable:
            nearest = half_width(deviation, RUNS, max(affordable, FEWEST_RUNS))
            nearest = max(nearest / (1 - SHARE), nearest + from_nodes)
            raise IllPosedError(
                f"accuracy.cycles of {asked:g} is not reached with {affordable} runs, which is as many as there is "
                f"room for in {job.scene.accuracy.cost_limit_cpu_s:g} s or {MOST_RUNS}; nearest is {nearest:.3g}; ask "
                "for that, raise accuracy.cost_limit_cpu_s, or take fewer ensemble.damping_ratios"
            )
    else:
        runs = int(ensemble.realisations)
    job.usage.count(
        runs=counts.size,
        runs_chosen=runs,
        nodes_chosen=nodes,
        cycles_asked=asked,
        cycles_from_nodes=round(from_nodes, 3),
        cycles_expected=round(from_nodes + half_width(deviation, RUNS, runs, safe=False), 3),
    )
    title = "error of the mean counts, at most, from the nodes of the paths"
    variables = {
        "nodes_per_correlation_length": store.Variable((), nodes, "1", "nodes per correlation length taken"),
        "runs": store.Variable((), runs, "1", "runs for each damping ratio"),
        "from_nodes": store.Variable((), from_nodes, "1", title),
    }
    store.write(job.arguments.output, variables, job.key)


if __name__ == "__main__":
    execute(STAGE, work)
