"""The budget of Figure 3: what mesh, tolerance and number of strips leave in mean and scatter of the friction."""

from __future__ import annotations

import copy
import csv
import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.stages.from_scene import geometry, surface_model
from workflow.benchmarks.chain_problem import FIRST_ORDER, Change, Numbers, Statistic, jackknifed, rows
from workflow.benchmarks.measure import Row, say
from workflow.references.friction_solves import windows

PERCENTILES = (20.0, 50.0, 80.0)
STREAM = 27  # the second entry of every seed
TIGHT = 1e-12  # tolerance that stands for an exact solve


def with_cell(scene: dict[str, Any], factor: float) -> dict[str, Any]:
    """The scene with the cells of the strip so many times as large."""
    changed = copy.deepcopy(scene)
    changed["strip"]["cell_m"] *= factor
    return changed


def statistic(scene: dict[str, Any], area: np.ndarray, force: np.ndarray) -> Statistic:
    """Mean and standard deviation of mu at each penetration, in units of the mean at the median as the study has it."""
    strip = scene["strip"]
    least = scene["friction"]["least_contact_fraction"] * strip["window_m"] * strip["width_m"]
    mu, valid = friction_coefficient(area, force, 1.0, least)

    def numbers(chosen: np.ndarray) -> Numbers:
        found = {}
        for level, percentile in enumerate(PERCENTILES):
            values = mu[chosen, level][valid[chosen, level]]
            found[percentile] = float(values.mean()), float(values.std())
        unit = found[50.0][0]
        means = {f"mu_mean_{p:g}": mean / unit for p, (mean, _) in found.items() if p != 50.0}
        return means | {f"mu_std_{p:g}": std / unit for p, (_, std) in found.items()}

    return numbers


def budget(name: str, scene: dict[str, Any], strips: int) -> Iterator[Row]:
    """Rows of mesh and tolerance of so many strips, drawn on a mesh of half the cell.

    On every other node, and every fourth, the field is that of the scene's cell and of twice that.
    """
    tolerance = scene["numerics"]["contact_tolerance"]
    fine = with_cell(scene, 0.5)
    sample = surface_model.surface_model(fine).sampler(geometry.strip_grid(fine))
    fields = [sample(np.random.default_rng([scene["seed"], STREAM, number])) for number in range(strips)]
    solved, seconds = {}, {}
    for factor, step in ((0.5, 1), (1.0, 2), (2.0, 4)):
        part = with_cell(scene, factor)
        start = time.perf_counter()
        solved[factor] = statistic(
            part, *windows(part, [field[::step, ::step] for field in fields], PERCENTILES, tolerance)
        )
        seconds[factor] = time.perf_counter() - start
        say(f"{name}: {strips} strips of {part['strip']['cell_m']:.3g} m cells")
    changes = jackknifed(strips, solved[1.0], solved[0.5])
    coarse = jackknifed(strips, solved[2.0], solved[1.0])
    for one in rows(name, "mesh", changes, [seconds[1.0]], strips, factor=FIRST_ORDER):
        number = one["case"].rpartition("=")[2]
        ratio = coarse[number].shift / changes[number].shift if changes[number].shift else math.nan
        yield one | {"order": math.log2(ratio) if ratio > 0 else None}
    few = fields[: max(2, strips // 4)]
    tight, rough = (
        statistic(scene, *windows(scene, [field[::2, ::2] for field in few], PERCENTILES, limit))
        for limit in (TIGHT, tolerance)
    )
    yield from rows(name, "solver tolerance", jackknifed(len(few), rough, tight), [seconds[1.0]], len(few))


def sampling(name: str, summary: Path) -> Iterator[Row]:
    """Rows of the sampling error that a run told of its numbers: half of their 95 % intervals over 1.96.

    summary : the summary.csv that is kept of the scene
    """
    with summary.open(encoding="utf-8") as table:
        told = {float(line["percentile"]): line for line in csv.DictReader(table)}
    for percentile in PERCENTILES:
        for kind in ("mean", "std"):
            value, low, high = (float(told[percentile][f"combined_{kind}{end}"]) for end in ("", "_low", "_high"))
            if kind == "std" or percentile != 50.0:  # the mean at the median is what the shear strength is set by
                change = Change(value, (high - low) / (2 * 1.96 * value), 0.0)
                yield from rows(name, "sampling", {f"mu_{kind}_{percentile:g}": change}, [0.0], 0)
