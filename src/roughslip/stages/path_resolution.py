"""Stage path_resolution: find how many nodes per correlation length the friction paths take.

As few as the error asked of the counts allows, where the scene leaves their number to the study. Paths of a pilot
ensemble are read at all their nodes and at every other one. The recursion is exact at any spacing, so both are the same
path, and the change of the counts comes from the interpolation alone.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from roughslip import store
from roughslip.errors import ConvergenceError
from roughslip.friction.recursion import recursion
from roughslip.oscillator.motion import ensemble_counts
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import geometry, mass_on_belt
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job, execute

STAGE = Stage(
    name="path_resolution",
    reads="seed oscillator ensemble numerics.oscillator_tolerance",
    reads_if_given="friction.statistics",
    optional={"friction": "friction"},
    result="oscillator/path_resolution.nc",
    runs_if="ensemble.nodes_per_correlation_length = auto",
    memory_mb=520,
    memory_doubles={"path_nodes": 10, "drawn_realisations": 32_000, "periods": 2000},
)

FEWEST_NODES, MOST_NODES = 4, 64  # per correlation length
FEWEST_PATHS, MOST_PATHS = 8, 128
FIRST_ORDER = 2.0  # the error over the change on halving the spacing, for an error in proportion to the spacing


@dataclass(frozen=True)
class Thinned:
    """Every so many nodes of a path."""

    path: Iterable[np.ndarray]
    step: int

    def __iter__(self) -> Iterator[np.ndarray]:
        skipped = 0
        for piece in self.path:
            yield piece[skipped :: self.step]
            skipped = (skipped - piece.size) % self.step


def error_bounds(coarse: np.ndarray, fine: np.ndarray) -> tuple[float, float]:
    """Between which the error of the mean counts lies, at the damping ratio where the upper bound is largest.

    coarse, fine : (paths, dampings) cycles of the same paths at a spacing and at half of it

    Returns lower and upper [-], relative to the largest mean count: Student's 95 % interval of the mean change, times
    FIRST_ORDER. Counts are whole numbers, so that n paths without any change leave room for one in a third of n (rule
    of three: Hanley and Lippman-Hand, J. Am. Med. Assoc. 249 (1983) 1743). Without any cycle both are 0.
    """
    largest = float(np.max(np.mean(fine, axis=0)))
    if largest == 0.0:
        return 0.0, 0.0
    change = coarse - fine
    half = stdtrit(len(change) - 1, 0.975) * change.std(axis=0, ddof=1) / np.sqrt(len(change))
    half = np.maximum(half, 3.0 / len(change))
    centre = np.abs(change.mean(axis=0))
    worst = int(np.argmax(centre + half))
    scale = FIRST_ORDER / largest
    return scale * max(float(centre[worst] - half[worst]), 0.0), scale * float(centre[worst] + half[worst])


def work(job: Job) -> None:
    """Double the nodes while their error is surely above the error asked, and the paths while that is undecided.

    Near the limit of existence a motion forgets the details of a path within a few cycles. A path read at half its
    nodes then counts like another path, and only many paths resolve a small error.
    """
    scene = job.scene
    ensemble, asked = scene.ensemble, scene.ensemble.count_error
    numbers = mass_on_belt.friction_numbers(scene, job.arguments.friction)
    process = mass_on_belt.friction_process(scene, numbers, job.arguments.friction)
    belt, law = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, numbers.mean)
    options = mass_on_belt.motion_options(scene)

    def counts(nodes: int, step: int, number: int) -> np.ndarray:
        """(dampings,) cycles of a path of so many nodes a correlation length, every step-th of them read."""
        paths = recursion(process, process.correlation_length_m / nodes)
        path = Thinned(paths.realisation([scene.seed, geometry.STREAM_PILOT, number]), step)
        found = ensemble_counts(
            belt, law, path, step * paths.spacing, ensemble.duration_periods, ensemble.damping_ratios, options
        )
        job.usage.skip({skip_reasons.STICK: np.sum(found.cycles + found.micro_slips)})
        return found.cycles

    tried: list[tuple[int, int, float]] = []
    nodes, lower, upper = FEWEST_NODES, 0.0, np.inf
    with job.usage.core():
        while nodes <= MOST_NODES:
            coarse, fine = np.empty((2, 0, len(ensemble.damping_ratios)))
            lower, upper = 0.0, np.inf
            while lower <= asked < upper and len(fine) < MOST_PATHS:
                more = range(len(fine), max(2 * len(fine), FEWEST_PATHS))
                coarse = np.vstack([coarse, [counts(2 * nodes, 2, number) for number in more]])
                fine = np.vstack([fine, [counts(2 * nodes, 1, number) for number in more]])
                lower, upper = error_bounds(coarse, fine)
            tried.append((nodes, len(fine), upper))
            job.usage.progress(len(tried), 1 + int(np.log2(MOST_NODES / FEWEST_NODES)))
            if lower <= asked:
                break
            nodes *= 2
    runs = 2 * sum(paths for _, paths, _ in tried) * len(ensemble.damping_ratios)
    if upper > asked:
        reason = (
            f"{tried[-1][1]} paths determine it no closer" if lower <= asked else f"{MOST_NODES} nodes are not enough"
        )
        raise ConvergenceError(
            f"the mean counts err by more than the ensemble.count_error of {asked} asked, or may: {reason}; ask for "
            f"more than the bound reached, or give ensemble.nodes_per_correlation_length; relative error",
            residual=upper,
            work=runs,
        )
    job.usage.count(runs=runs)
    most = 2 * MOST_PATHS * len(tried) * len(ensemble.damping_ratios)
    left = int(np.log2(MOST_NODES / nodes))
    job.usage.skip({skip_reasons.ENOUGH_PATHS: most - runs, skip_reasons.ENOUGH_NODES: left})
    rows, trial = list(zip(*tried, strict=True)), ("trial",)
    variables = {
        "nodes_per_correlation_length": store.Variable((), nodes, "1", "nodes per correlation length taken"),
        "count_error": store.Variable((), tried[-1][2], "1", "bound of the relative error of the mean counts"),
        "tried_nodes": store.Variable(trial, np.array(rows[0]), "1", "nodes per correlation length tried"),
        "tried_paths": store.Variable(trial, np.array(rows[1]), "1", "paths of the pilot ensemble"),
        "tried_error": store.Variable(trial, np.array(rows[2]), "1", "bound of the relative error of the mean counts"),
    }
    store.write(job.arguments.output, variables, job.key)


if __name__ == "__main__":
    execute(STAGE, work)
