"""Measure friction paths: points a second of every method, and the error of their autocorrelation.

One process, one thread, in turns. The sample autocorrelation about the known mean, up to four correlation lengths, and
the Kolmogorov distance of the marginal judge the paths. What a process needs once is listed as `setup_seconds`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np
from scipy.special import betaincinv

from roughslip.friction.paths import METHODS, Paths, prepare
from roughslip.friction.process import FrictionProcess
from roughslip.friction.recursion import PIECE_NODES
from roughslip.probability import BetaDistribution
from workflow.benchmarks.runner import make_row, race, report_rows, run_command, timed
from workflow.evidence.rows import Row, case

SEED = 20110914
LENGTHS = 4  # correlation lengths up to which the autocorrelation is judged
QUANTILES = 2000  # at which the marginal is judged; the distance is too small by 1 / 2000 at most


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


def marginal_distance(values: np.ndarray, a: float, b: float) -> float:
    """Return the Kolmogorov distance, at QUANTILES, of values of zero mean and unit variance from Beta(a, b)."""
    probability = np.arange(1, QUANTILES) / QUANTILES
    marginal = BetaDistribution(a, b, 0.0, 1.0)
    ends = (betaincinv(a, b, probability) - marginal.mean) / marginal.standard_deviation
    shares = np.searchsorted(np.sort(values, axis=None), ends) / values.size
    return float(np.max(np.abs(shares - probability)))


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
                more = {
                    "marginal_distance": marginal_distance(found, a, b),
                    "stated_error": prepared[method].correlation_error,
                    "setup_seconds": setup[method],
                }
                error = correlation_error(found, sizes.nodes)
                rows.append(make_row(name, f"roughslip/{method}", error, seconds[method], found.size, **more))
            report_rows(rows[-len(results) :])
    return {"summary": points_per_second(rows), "rows": rows}


def points_per_second(rows: list[Row]) -> dict[str, float]:
    """Return the speed of each method in its largest ensembles, at its slowest marginal."""
    most = max(row["work"] for row in rows)
    speeds: dict[str, float] = {}
    for row in rows:
        if row["work"] == most:
            speeds[row["method"]] = min(row["work"] / row["seconds"], speeds.get(row["method"], math.inf))
    return speeds


if __name__ == "__main__":
    run_command(__doc__, measure)
