"""The error budget: what each source leaves in every number of the figures.

One source at a time is varied with common random numbers: the same surfaces, strips or paths, solved as in the scene
and more accurately. The change is then much better known than the number itself. Errors are shares of the number.
"""

from __future__ import annotations

import csv
import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from roughslip.chaos.local import Samples, fit_local, jackknife_deviations
from roughslip.contact.solve import solve
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.friction.process import FrictionProcess
from roughslip.friction.recursion import recursion
from roughslip.grid import Grid
from roughslip.oscillator.motion import ensemble_counts
from roughslip.probability import BetaDistribution
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import elastic, geometry, mass_on_belt, surface_model
from roughslip.stages.path_resolution import Thinned
from roughslip.surface.karhunen_loeve import heights, karhunen_loeve
from workflow.benchmarks.chaos_problem import (
    JUDGED,
    MEDIAN,
    PERCENTILES,
    QUANTILES,
    Square,
    load_scene,
    read_references,
)
from workflow.benchmarks.runner import make_row, report_progress
from workflow.evidence.rows import Row, case
from workflow.monte_carlo.friction import solve_windows

GROUPS = 20  # of samples, left out in turn
FIRST_ORDER = 2.0  # error over the change on halving a cell, for an error in proportion to the cell
TIGHT = 1e-12  # a tolerance that stands for an exact solve
NORMAL = 1.96  # half of a 95 % interval over the standard error
MORE_MODES = 4  # times as many modes, of which those of the scene are the first
DRAWS = 400_000
DAMPING = (0.17, 0.3, 0.32)  # the paper's; where the scatter costs cycles; just below the limit of existence
STREAMS = {"strips": 27, "square": 28, "oscillator": 29}  # the second entry of every seed

Numbers = Mapping[str, float]
Statistic = Callable[[np.ndarray], Numbers]  # from the indices of samples to numbers


class Change(NamedTuple):
    """The value of a number, its relative change, and the standard error of the change as a share of the number."""

    value: float
    shift: float
    error: float


class Friction(NamedTuple):
    """Mean, standard deviation, correlation length [m] and shapes of the Beta distribution of mu_S."""

    mean: float
    std: float
    length_m: float
    a: float
    b: float


def compare_paired(samples: int, rough: Statistic, better: Statistic) -> dict[str, Change]:
    """Return how the numbers of `rough` differ from those of `better`, over the latter.

    samples : number of samples, the same ones in both

    Method: delete-a-group jackknife of the ratio (Kott, J. Off. Stat. 17 (2001) 521).
    """
    everyone = np.arange(samples)
    group = everyone % min(GROUPS, samples)
    whole = _ratios(everyone, rough, better)
    without = [_ratios(everyone[group != number], rough, better) for number in range(group.max() + 1)]
    values, found = better(everyone), {}
    for name, ratio in whole.items():
        scatter = np.array([one[name] for one in without])
        error = float(np.sqrt((len(scatter) - 1) * np.mean((scatter - scatter.mean()) ** 2)))
        found[name] = Change(values[name], ratio - 1.0, error)
    return found


def _ratios(chosen: np.ndarray, rough: Statistic, better: Statistic) -> dict[str, float]:
    of_rough, of_better = rough(chosen), better(chosen)
    return {name: of_rough[name] / value for name, value in of_better.items()}


def rows_of_source(
    scene: str, source: str, changes: Mapping[str, Change], seconds: float, work: int, factor: float = 1.0, **more: Any
) -> list[Row]:
    """Return a row for each number: its error from a source is `factor` times the change."""
    rows = []
    for name, change in changes.items():
        columns = {"value": change.value, "shift": factor * change.shift, "standard_error": factor * change.error}
        error = factor * abs(change.shift)
        rows.append(make_row(case(scene=scene, number=name), source, error, [seconds], work, **columns, **more))
    report_progress(f"{scene}: {source}")
    return rows


# The pressure at the centre, Figure 2.


def pressure_statistic(pressure: np.ndarray) -> Statistic:
    """Return contact probability, mean, and quantiles given contact of pressures (surfaces, nodes) [Pa]."""

    def numbers(chosen: np.ndarray) -> Numbers:
        part = pressure[chosen].ravel()
        positive = part[part > 0]
        found = {"contact_probability": len(positive) / len(part), "mean_pressure": float(part.mean())}
        return found | dict(zip(QUANTILES, map(float, np.quantile(positive, JUDGED)), strict=True))

    return numbers


def central_pressures(square: Square, grid: Grid, rough: np.ndarray, tolerance: float, step: int = 1) -> Statistic:
    """Return the statistic of the pressures at the central nodes.

    rough : (surfaces, nx, ny) [m] heights on a mesh of which every `step`-th node is one of the scene's
    """
    influence = elastic.influence(square.scene, grid)
    nodes = geometry.central_nodes(square.model.lengths_m, square.grid)
    found = np.empty((len(rough), len(nodes.x)))
    for row, surface in enumerate(rough):
        pressure = solve(influence, surface - square.planes[MEDIAN], tolerance).pressure
        found[row] = pressure[step * nodes.x, step * nodes.y]
    return pressure_statistic(found)


def square_budget(name: str, surfaces: int, kept: Path) -> Iterator[Row]:
    """Yield the rows of every source at the median.

    kept : the Monte Carlo reference of the pressure at the centre

    The mesh is varied on surfaces with all their modes, drawn on a mesh of half the cell.
    """
    square = Square.of(name)
    tolerance = square.scene.numerics.contact_tolerance
    grid, fine = square.grid, Grid(2 * square.grid.nx, 2 * square.grid.ny, square.grid.dx / 2, square.grid.dy / 2)
    modes = len(square.modes)
    start = time.perf_counter()
    rough = np.stack([square.surface(one) for one in square.design("monte_carlo", surfaces, 0)])
    usual = central_pressures(square, grid, rough, tolerance)
    seconds = time.perf_counter() - start

    more = min(MORE_MODES * modes, grid.size)
    if more > modes:
        every = karhunen_loeve(square.model.covariance, grid, more).modes
        others = np.random.default_rng([square.seed, STREAMS["square"]]).standard_normal((surfaces, more - modes))
        richer = rough + np.stack([heights(every[modes:], one) for one in others])
        better = central_pressures(square, grid, richer, tolerance)
        yield from rows_of_source(name, "modes", compare_paired(surfaces, usual, better), seconds, surfaces)

    sample, seeds = square.model.sampler(fine), [[square.seed, STREAMS["square"], k] for k in range(surfaces)]
    on_both = np.stack([sample(np.random.default_rng(seed)) for seed in seeds])
    better = central_pressures(square, fine, on_both, tolerance, step=2)
    on_coarse = central_pressures(square, grid, np.ascontiguousarray(on_both[:, ::2, ::2]), tolerance)
    changes = compare_paired(surfaces, on_coarse, better)
    yield from rows_of_source(name, "mesh", changes, seconds, surfaces, FIRST_ORDER)

    few = max(20, surfaces // 10)
    tight = central_pressures(square, grid, rough[:few], TIGHT)
    yield from rows_of_source(name, "solver tolerance", compare_paired(few, usual, tight), seconds, few)
    yield from _expansion_rows(name, square, kept)


def _expansion_rows(name: str, square: Square, kept: Path) -> Iterator[Row]:
    """Yield the expansion's difference from the reference, and the sampling error that it estimates of itself."""
    reference, terms = read_references(kept)[MEDIAN], square.scene.expansion
    start = time.perf_counter()
    solved = square.solve(square.design("latin_hypercube", terms.samples, 0))
    variables = np.einsum("km,nvm->knv", solved.xi, square.directions)
    pressure, gap = solved.pressure[:, MEDIAN], solved.gap[:, MEDIAN]
    fitting = time.process_time()
    samples = Samples(variables, square.nodes.distance2, pressure, gap, square.odd)
    found = fit_local(samples, terms.degree, square.target)
    drawn = found.draw(np.random.default_rng([square.seed, geometry.STREAM_DRAWS]), DRAWS, left_out=True)
    seconds, fit_seconds = time.perf_counter() - start, time.process_time() - fitting
    differences = reference.differences(drawn[0])
    numbers = [pressure_statistic(one[:, None])(np.arange(DRAWS)) for one in drawn]
    missed, scatter = {}, {}
    for key, value in numbers[0].items():
        deviations = jackknife_deviations(np.array([one[key] for one in numbers[1:]]))
        missed[key] = Change(value, differences[key].seen, differences[key].reference_error)
        scatter[key] = Change(value, float(np.linalg.norm(deviations)) / value, 0.0)
    yield from rows_of_source(name, "expansion", missed, seconds, terms.samples)
    yield from rows_of_source(name, "sampling", scatter, seconds, terms.samples, fit_seconds=fit_seconds)


# The friction coefficient of windows, Figure 3.


def friction_statistic(scene: Scene, area: np.ndarray, force: np.ndarray) -> Statistic:
    """Return mean and standard deviation of mu at each penetration, in units of the mean at the median."""
    least = scene.friction.least_contact_fraction * scene.strip.window_m * scene.strip.width_m
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


def strip_budget(name: str, scene: Scene, strips: int) -> Iterator[Row]:
    """Yield the rows of mesh and tolerance of so many strips, drawn on a mesh of half the cell.

    Every second node of the field has the scene's cell, and every fourth node twice that.
    """
    tolerance = scene.numerics.contact_tolerance
    by_step = {step: load_scene(name, {"strip.cell_m": step / 2 * scene.strip.cell_m}) for step in (1, 2, 4)}
    fine = by_step[1]
    sample = surface_model.surface_model(fine).sampler(geometry.strip_grid(fine))
    seeds = [[scene.seed, STREAMS["strips"], number] for number in range(strips)]
    fields = [sample(np.random.default_rng(seed)) for seed in seeds]

    def solve_every(step: int, chosen: list[np.ndarray], limit: float) -> Statistic:
        part = by_step[step]
        area, force = solve_windows(part, [field[::step, ::step] for field in chosen], PERCENTILES, limit)
        return friction_statistic(part, area, force)

    start = time.perf_counter()
    usual = solve_every(2, fields, tolerance)
    seconds = time.perf_counter() - start
    changes = compare_paired(strips, usual, solve_every(1, fields, tolerance))
    coarse = compare_paired(strips, solve_every(4, fields, tolerance), usual)
    for row in rows_of_source(name, "mesh", changes, seconds, strips, FIRST_ORDER):
        number = row["case"].rpartition("=")[2]
        ratio = coarse[number].shift / changes[number].shift if changes[number].shift else math.nan
        yield row | {"order": math.log2(ratio) if ratio > 0 else None}
    few = fields[: max(2, strips // 4)]
    paired = compare_paired(len(few), solve_every(2, few, tolerance), solve_every(2, few, TIGHT))
    yield from rows_of_source(name, "solver tolerance", paired, seconds, len(few))


def read_summary(path: Path) -> dict[float, dict[str, float]]:
    """Read the kept summary.csv of a scene: numbers by percentile, those that are empty left out."""
    with path.open(encoding="utf-8") as table:
        lines = [
            {name: float(text) for name, text in line.items() if _is_number(text)} for line in csv.DictReader(table)
        ]
    return {line["percentile"]: line for line in lines}


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def strip_sampling(name: str, summary: Path) -> Iterator[Row]:
    """Yield the sampling errors of a run, from the 95 % intervals of its summary.csv."""
    by_percentile = read_summary(summary)
    for percentile in PERCENTILES:
        for kind in ("mean", "std"):
            value, low, high = (by_percentile[percentile][f"combined_{kind}{end}"] for end in ("", "_low", "_high"))
            if kind == "std" or percentile != 50.0:  # the mean at the median sets the shear strength
                change = Change(value, (high - low) / (2 * NORMAL * value), 0.0)
                yield from rows_of_source(name, "sampling", {f"mu_{kind}_{percentile:g}": change}, 0.0, 0)


# Cycles of the oscillator, Figure 5.


def read_friction(summary: Path) -> tuple[Friction, Friction]:
    """Read the friction at the median from the summary.csv of a scene: numbers, and their standard errors.

    The errors follow from the 95 % intervals, also for shapes whose interval is one-sided.
    """
    row = read_summary(summary)[50.0]
    columns = ("combined_mean{}", "combined_std{}", "length_least_squares{}_m", "beta_a{}", "beta_b{}")
    values = [[row[column.format(end)] for end in ("", "_low", "_high")] for column in columns]
    return Friction(*(one[0] for one in values)), Friction(*((one[2] - one[1]) / (2 * NORMAL) for one in values))


def count_cycles(
    scene: Scene, friction: Friction, paths: int, nodes: int, step: int = 1, tolerance: float | None = None
) -> np.ndarray:
    """Return cycles (paths, dampings) on paths of so many nodes a correlation length, reading every `step`-th node."""
    marginal = BetaDistribution.of_moments(friction.a, friction.b, 0.0, friction.std)
    drawn = recursion(FrictionProcess(marginal, friction.length_m), friction.length_m / nodes)
    belt, periods, found = mass_on_belt.oscillator(scene), scene.ensemble.duration_periods, []
    options = mass_on_belt.motion_options(scene)
    options = options if tolerance is None else replace(options, tolerance=tolerance)
    mean = mass_on_belt.law(scene, friction.mean)
    for number in range(paths):
        path = Thinned(drawn.realisation([scene.seed, STREAMS["oscillator"], number]), step)
        found.append(ensemble_counts(belt, mean, path, step * drawn.spacing, periods, DAMPING, options).cycles)
    return np.array(found)


def oscillator_budget(name: str, scene: Scene, paths: int, summary: Path) -> Iterator[Row]:
    """Yield the rows of every source, as shares of the mean count at each damping ratio."""
    friction, errors = read_friction(summary)
    nodes = scene.ensemble.nodes_per_correlation_length
    nodes = 8 if nodes == "auto" else int(nodes)
    start = time.perf_counter()
    usual = count_cycles(scene, friction, paths, 2 * nodes, 2)
    seconds = time.perf_counter() - start
    mean = np.maximum(usual.mean(axis=0), 1.0 / paths)

    def changes(shift: np.ndarray, error: np.ndarray) -> dict[str, Change]:
        columns = zip(DAMPING, mean, shift / mean, error / mean, strict=True)
        return {f"cycles_{damping:g}": Change(float(m), float(s), float(e)) for damping, m, s, e in columns}

    def rows(source: str, difference: np.ndarray, factor: float = 1.0) -> list[Row]:
        error = difference.std(axis=0, ddof=1) / np.sqrt(paths)
        return rows_of_source(name, source, changes(difference.mean(axis=0), error), seconds, paths, factor)

    yield from rows("path nodes", usual - count_cycles(scene, friction, paths, 2 * nodes), FIRST_ORDER)
    yield from rows("integrator", usual - count_cycles(scene, friction, paths, 2 * nodes, 2, TIGHT))
    for field, error in zip(Friction._fields[:3], errors, strict=False):
        moved = friction._replace(**{field: getattr(friction, field) + error})
        yield from rows(f"friction {field}", count_cycles(scene, moved, paths, 2 * nodes, 2) - usual)
    deviation = usual.std(axis=0, ddof=1) / np.sqrt(scene.ensemble.realisations)
    yield from rows_of_source(name, "sampling", changes(deviation, 0.0 * deviation), seconds, paths)
