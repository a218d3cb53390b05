"""The budget of Figure 5: what integrator, nodes of the paths, statistics and samples leave in the cycles lost."""

from __future__ import annotations

import csv
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from roughslip.friction.process import FrictionProcess
from roughslip.friction.recursion import recursion
from roughslip.oscillator.motion import ensemble_counts
from roughslip.probability import BetaDistribution
from roughslip.stages.from_scene import mass_on_belt
from roughslip.stages.spacing import Thinned
from workflow.benchmarks.chain_problem import FIRST_ORDER, Change, rows
from workflow.benchmarks.measure import Row, say

DAMPING = (0.17, 0.3, 0.32)  # the paper's; where the scatter costs cycles; just below the limit of existence
STREAM = 29
TIGHT = 1e-12


class Friction(NamedTuple):
    """Mean, standard deviation, correlation length [m] and shapes of the Beta, as a run of the scene told them."""

    mean: float
    std: float
    length_m: float
    a: float
    b: float


def told(summary: Path) -> tuple[Friction, Friction]:
    """At the median, from the summary.csv that is kept of the scene: numbers, and half their 95 % intervals / 1.96.

    The shapes' errors are those of their intervals too, though one of them may be at the end of its range.
    """
    with summary.open(encoding="utf-8") as table:
        row = next(line for line in csv.DictReader(table) if float(line["percentile"]) == 50.0)
    columns = ("combined_mean", "combined_std", "length_least_squares{}_m", "beta_a", "beta_b")
    names = [name if "{}" in name else name + "{}" for name in columns]
    values = [[float(row[name.format(end)]) for end in ("", "_low", "_high")] for name in names]
    return Friction(*(one[0] for one in values)), Friction(*((one[2] - one[1]) / (2 * 1.96) for one in values))


def counts(
    scene: dict[str, Any], friction: Friction, paths: int, nodes: int, step: int = 1, tolerance: float | None = None
) -> np.ndarray:
    """(paths, dampings) cycles of paths of so many nodes a correlation length, every `step`-th of them read."""
    law = BetaDistribution.of_moments(friction.a, friction.b, 0.0, friction.std)
    drawn = recursion(FrictionProcess(law, friction.length_m), friction.length_m / nodes)
    belt, periods, found = mass_on_belt.oscillator(scene), scene["ensemble"]["duration_periods"], []
    options = mass_on_belt.run_options(scene) | ({} if tolerance is None else {"tolerance": tolerance})
    for number in range(paths):
        path = Thinned(drawn.realisation([scene["seed"], STREAM, number]), step)
        mean = mass_on_belt.law(scene, friction.mean)
        found.append(ensemble_counts(belt, mean, path, step * drawn.spacing, periods, DAMPING, **options).cycles)
    return np.array(found)


def budget(name: str, scene: dict[str, Any], paths: int, summary: Path) -> Iterator[Row]:
    """Rows of every source, as shares of the mean count at each damping ratio."""
    friction, errors = told(summary)
    nodes = scene["ensemble"]["nodes_per_correlation_length"]
    nodes = 8 if nodes == "auto" else int(nodes)
    start = time.perf_counter()
    usual = counts(scene, friction, paths, 2 * nodes, 2)
    seconds = [time.perf_counter() - start]
    say(f"{name}: {paths} paths")
    mean = np.maximum(usual.mean(axis=0), 1.0 / paths)

    def told_as(source: str, difference: np.ndarray, factor: float = 1.0) -> list[Row]:
        shift = difference.mean(axis=0) / mean
        error = difference.std(axis=0, ddof=1) / np.sqrt(paths) / mean
        changes = {
            f"cycles_{damping:g}": Change(float(m), float(s), float(e))
            for damping, m, s, e in zip(DAMPING, mean, shift, error, strict=True)
        }
        return rows(name, source, changes, seconds, paths, factor=factor)

    yield from told_as("path nodes", usual - counts(scene, friction, paths, 2 * nodes), FIRST_ORDER)
    say(f"{name}: path nodes")
    yield from told_as("integrator", usual - counts(scene, friction, paths, 2 * nodes, 2, TIGHT))
    say(f"{name}: integrator")
    for field, error in zip(Friction._fields[:3], errors, strict=False):
        moved = replace_field(friction, field, error)
        yield from told_as(f"friction {field}", counts(scene, moved, paths, 2 * nodes, 2) - usual)
    say(f"{name}: friction statistics")
    realisations = scene["ensemble"]["realisations"]
    deviation = usual.std(axis=0, ddof=1) / np.sqrt(realisations) / mean
    changes = {
        f"cycles_{damping:g}": Change(float(m), float(d), 0.0)
        for damping, m, d in zip(DAMPING, mean, deviation, strict=True)
    }
    yield from rows(name, "sampling", changes, seconds, paths)


def replace_field(friction: Friction, field: str, by: float) -> Friction:
    """One number moved by its standard error."""
    return friction._replace(**{field: getattr(friction, field) + by})
