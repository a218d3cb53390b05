"""Friction paths measured: points per second of every way of drawing them, and the error of their correlation.

All in one process and one thread, by turns. Paths are judged by their sample autocorrelation about the known mean up to
four correlation lengths, and by the Kolmogorov distance of their marginal, apart from the code that made them. What is
set up once for a process is told as `setup_seconds`.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np
from scipy.special import betaincinv

from roughslip.friction.paths import METHODS, Paths, prepare
from roughslip.friction.process import FrictionProcess
from roughslip.friction.recursion import PIECE_NODES
from roughslip.probability import BetaDistribution
from workflow.benchmarks import measure
from workflow.benchmarks.measure import Contender, Row, case, row

PACKAGES = ("numpy", "scipy", "numba")
SEED = 20110914
LENGTHS = 4  # correlation lengths up to which the autocorrelation is judged
QUANTILES = 2000  # at which the marginal is: the distance is too small by 1 / 2000 at most
POINTS_PER_SECOND = 1e7  # what the project promises of the default


@dataclass(frozen=True)
class Campaign:
    """What is measured.

    shapes : of the Beta marginals
    nodes : of a correlation length
    lengths : correlation lengths of a path
    paths : sizes of the ensembles
    quick : one turn each, to show that everything works
    """

    shapes: tuple[tuple[float, float], ...] = ((2.1, 5.0), (0.5, 0.5), (0.3, 3.0))
    nodes: int = 16
    lengths: int = 256
    paths: tuple[int, ...] = (20, 200, 2000)
    quick: bool = False


QUICK = Campaign(((2.1, 5.0),), 4, 16, (4, 16), True)


def ensemble(paths: Paths, nodes: int, count: int) -> np.ndarray:
    """mu_S : (count, nodes) of the first so many realisations."""
    found = np.empty((count, nodes))
    for number in range(count):
        pieces = paths.realisation([SEED, number])
        found[number] = np.concatenate(list(islice(pieces, math.ceil(nodes / PIECE_NODES))))[:nodes]
    return found


def correlation_error(values: np.ndarray, nodes: int) -> float:
    """Largest deviation of the autocorrelation of values : (paths, nodes) of unit variance from exp(-lag / nodes)."""
    worst = 0.0
    for lag in range(LENGTHS * nodes + 1):
        found = np.einsum("ps,ps->", values[:, : values.shape[1] - lag], values[:, lag:])
        worst = max(worst, abs(found / (len(values) * (values.shape[1] - lag)) - math.exp(-lag / nodes)))
    return worst


def marginal_distance(values: np.ndarray, a: float, b: float) -> float:
    """Kolmogorov distance of values of zero mean and unit variance from Beta(a, b), at QUANTILES of it."""
    probability = np.arange(1, QUANTILES) / QUANTILES
    law = BetaDistribution(a, b, 0.0, 1.0)
    ends = (betaincinv(a, b, probability) - law.mean) / law.standard_deviation
    shares = np.searchsorted(np.sort(values, axis=None), ends) / values.size
    return float(np.max(np.abs(shares - probability)))


def drawn(campaign: Campaign) -> list[Row]:
    """Time and error of ensembles of every size, by every method."""
    rows: list[Row] = []
    nodes = campaign.nodes * campaign.lengths
    for a, b in campaign.shapes:
        process = FrictionProcess(BetaDistribution.of_moments(a, b, 0.0, 1.0), 1.0)
        spacing = 1.0 / campaign.nodes
        prepared, setup = {}, {}
        for method in METHODS:
            setup[method], prepared[method] = measure.timed(
                partial(prepare, process, spacing, campaign.lengths, method)
            )
            ensemble(prepared[method], nodes, 1)  # what is compiled or planned at the first call
        for count in campaign.paths:
            calls, values = {}, {}
            for method, paths in prepared.items():
                call = partial(ensemble, paths, nodes, count)
                seconds, values[method] = measure.timed(call)
                calls[method] = Contender(call, seconds, 1 if campaign.quick else measure.turns(seconds))
            times = measure.race(calls)
            for method, found in values.items():
                rows.append(
                    row(
                        case(a=a, b=b, nodes=campaign.nodes, lengths=campaign.lengths, paths=count),
                        f"roughslip/{method}",
                        correlation_error(found, campaign.nodes),
                        times[method],
                        found.size,
                        marginal_distance=marginal_distance(found, a, b),
                        told_error=prepared[method].correlation_error,
                        setup_seconds=setup[method],
                    )
                )
                last = rows[-1]
                speed = last["work"] / last["seconds"]
                measure.say(f"{last['case']} {last['method']}: {speed:.2e} points/s, {last['error']:.1e}")
    return rows


def summary(rows: Sequence[Row]) -> dict[str, object]:
    """Points per second of each method in its largest ensembles, at its slowest marginal, and the default's promise."""
    most = max(row["work"] for row in rows)
    speed = {
        f"roughslip/{method}": min(
            row["work"] / row["seconds"]
            for row in rows
            if row["work"] == most and row["method"] == f"roughslip/{method}"
        )
        for method in METHODS
    }
    return {
        "points_per_second": speed,
        "promised": POINTS_PER_SECOND,
        "met": speed["roughslip/recursion"] >= POINTS_PER_SECOND,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True, help="the JSON file")
    parser.add_argument("--peers", action="store_true", help="no public generator takes part")
    parser.add_argument("--quick", action="store_true", help="tiny ensembles, one turn each")
    rows = drawn(QUICK if (arguments := parser.parse_args()).quick else Campaign())
    head = {"machine": measure.machine(), "versions": measure.versions(PACKAGES), "checks": {}}
    measure.write(arguments.output, {**head, "summary": summary(rows), "rows": rows})


if __name__ == "__main__":
    main()
