"""Measure friction paths: points a second of every method, and the error of their autocorrelation.

One process, one thread, in turns. The sample autocorrelation about the known mean, up to four correlation lengths,
judges the paths. What a process needs once is listed as `setup_seconds`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np

from roughslip.friction.paths import METHODS, Paths, prepare
from roughslip.friction.process import FrictionProcess
from roughslip.friction.recursion import PIECE_NODES
from roughslip.probability import BetaDistribution
from workflow.benchmarks.runner import make_row, race, report_rows, run_command, timed
from workflow.evidence.rows import case

SEED = 20110914
LENGTHS = 4  # correlation lengths up to which the autocorrelation is judged


@dataclass(frozen=True)
class Sizes:
    """What is measured.

    shapes : of the Beta marginals
    nodes : of a correlation length
    lengths : correlation lengths of a path
    paths : sizes of the ensembles
    """

    shapes: tuple[tuple[float, float], ...] = ((2.1, 5.0), (0.5, 0.5), (0.3, 3.0))
    nodes: int = 16
    lengths: int = 256
    paths: tuple[int, ...] = (20, 200, 2000)


QUICK = Sizes(((2.1, 5.0),), 4, 16, (4, 16))


def ensemble(paths: Paths, nodes: int, count: int) -> np.ndarray:
    """Return mu_S (count, nodes) of the first so many realisations."""
    found = np.empty((count, nodes))
    for number in range(count):
        pieces = paths.realisation([SEED, number])
        found[number] = np.concatenate(list(islice(pieces, math.ceil(nodes / PIECE_NODES))))[:nodes]
    return found


def correlation_error(values: np.ndarray, nodes: int) -> float:
    """Return the largest deviation of the autocorrelation of values (paths, nodes), of unit variance, from the model.

    The model is exp(-lag / nodes).
    """
    worst = 0.0
    for lag in range(LENGTHS * nodes + 1):
        found = np.einsum("ps,ps->", values[:, : values.shape[1] - lag], values[:, lag:])
        worst = max(worst, abs(found / (len(values) * (values.shape[1] - lag)) - math.exp(-lag / nodes)))
    return worst


def measure(quick: bool, _: bool) -> dict[str, object]:
    """Return rows of ensembles of every size, by every method."""
    sizes, rows = QUICK if quick else Sizes(), []
    nodes = sizes.nodes * sizes.lengths
    for a, b in sizes.shapes:
        process = FrictionProcess(BetaDistribution.of_moments(a, b, 0.0, 1.0), 1.0)
        prepared, setup = {}, {}
        for method in METHODS:
            call = partial(prepare, process, 1.0 / sizes.nodes, sizes.lengths, method)
            setup[method], prepared[method] = timed(call)
        for count in sizes.paths:
            calls = {method: partial(ensemble, paths, nodes, count) for method, paths in prepared.items()}
            seconds, results = race(calls, quick)
            name = case(a=a, b=b, nodes=sizes.nodes, lengths=sizes.lengths, paths=count)
            for method, found in results.items():
                more = {"stated_error": prepared[method].correlation_error, "setup_seconds": setup[method]}
                error = correlation_error(found, sizes.nodes)
                rows.append(make_row(name, f"roughslip/{method}", error, seconds[method], found.size, **more))
            report_rows(rows[-len(results) :])
    return {"summary": {}, "rows": rows}


if __name__ == "__main__":
    run_command(__doc__, measure)
