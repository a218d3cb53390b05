"""The error budget: what each source leaves in every number of the figures.

One source at a time is varied with common random numbers: the same surfaces, strips or paths, solved as in the scene
and more accurately. The change is then much better known than the number itself. Errors are shares of the number.
"""

from __future__ import annotations

import csv
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from roughslip.chaos.local import jackknife_deviations
from roughslip.contact.solve import solve
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.friction.process import FrictionProcess
from roughslip.friction.recursion import Recursion, recursion
from roughslip.grid import Grid
from roughslip.oscillator.motion import ensemble_counts
from roughslip.probability import BetaDistribution
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import elastic, geometry, mass_on_belt, surface_model
from roughslip.stages.path_resolution import Thinned
from roughslip.surface.karhunen_loeve import heights, karhunen_loeve
from workflow.benchmarks.chaos import MEDIAN, PERCENTILES, MonteCarloReference, Square, describe, load_scene
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

Statistic = Callable[[np.ndarray], Mapping[str, float]]  # from the indices of samples to numbers


class Change(NamedTuple):
    """The value of a number, its relative change, and the standard error of the change as a share of the number."""

    value: float
    shift: float
    error: float


def compare_paired(samples: int, rough: Statistic, better: Statistic) -> dict[str, Change]:
    """Return how the numbers of `rough` differ from those of `better`, over the latter.

    samples : number of samples, the same ones in both

    Method: delete-a-group jackknife of the ratio (Kott, J. Off. Stat. 17 (2001) 521).
    """
    everyone = np.arange(samples)
    group = everyone % min(GROUPS, samples)
    values, found = better(everyone), {}
    parts = [everyone, *(everyone[group != number] for number in range(group.max() + 1))]
    both = [(rough(part), better(part)) for part in parts]
    for name, value in values.items():
        whole, *without = (one[name] / other[name] for one, other in both)
        found[name] = Change(value, whole - 1.0, float(np.sqrt(len(without) - 1) * np.std(without)))
    return found


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


def central_pressures(square: Square, grid: Grid, rough: np.ndarray, tolerance: float, step: int = 1) -> Statistic:
    """Return the statistic of the pressures at the central nodes.

    rough : (surfaces, nx, ny) [m] heights on a mesh of which every `step`-th node is one of the scene's
    """
    influence = elastic.influence(square.scene, grid)
    x, y = (step * nodes[: square.central] for nodes in (square.nodes.x, square.nodes.y))
    solved = (solve(influence, surface - square.planes[MEDIAN], tolerance) for surface in rough)
    pressure = np.array([solution.pressure[x, y] for solution in solved])
    return lambda chosen: describe(pressure[chosen])


def square_budget(square: Square, surfaces: int) -> Iterator[Row]:
    """Yield the rows of modes, mesh and tolerance at the median.

    The mesh is varied on surfaces with all their modes, drawn on a mesh of half the cell.
    """
    name, tolerance, grid, modes = square.name, square.scene.numerics.contact_tolerance, square.grid, len(square.modes)
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

    fine = Grid(2 * grid.nx, 2 * grid.ny, grid.dx / 2, grid.dy / 2)
    sample, seeds = square.model.sampler(fine), [[square.seed, STREAMS["square"], k] for k in range(surfaces)]
    on_both = np.stack([sample(np.random.default_rng(seed)) for seed in seeds])
    better = central_pressures(square, fine, on_both, tolerance, step=2)
    on_coarse = central_pressures(square, grid, np.ascontiguousarray(on_both[:, ::2, ::2]), tolerance)
    changes = compare_paired(surfaces, on_coarse, better)
    yield from rows_of_source(name, "mesh", changes, seconds, surfaces, FIRST_ORDER)

    few = max(20, surfaces // 10)
    tight = central_pressures(square, grid, rough[:few], TIGHT)
    yield from rows_of_source(name, "solver tolerance", compare_paired(few, usual, tight), seconds, few)


def expansion_budget(square: Square, reference: MonteCarloReference) -> Iterator[Row]:
    """Yield the expansion's difference from the reference, and the sampling error that it estimates of itself."""
    name, count = square.name, square.scene.expansion.samples
    start = time.perf_counter()
    solved = square.solve(square.design("latin_hypercube", count, 0))
    fitting = time.process_time()
    generator = np.random.default_rng([square.seed, geometry.STREAM_DRAWS])
    drawn = square.fit(solved, MEDIAN).draw(generator, DRAWS, left_out=True)
    seconds, fit_seconds = time.perf_counter() - start, time.process_time() - fitting
    numbers = [describe(one) for one in drawn]
    missed, scatter = {}, {}
    for key, value in numbers[0].items():
        expected, error = reference.numbers[key]
        missed[key] = Change(value, value / expected - 1.0, error / expected)
        deviations = jackknife_deviations(np.array([one[key] for one in numbers[1:]]))
        scatter[key] = Change(value, float(np.linalg.norm(deviations)) / value, 0.0)
    yield from rows_of_source(name, "expansion", missed, seconds, count)
    yield from rows_of_source(name, "sampling", scatter, seconds, count, fit_seconds=fit_seconds)


# The friction coefficient of windows, Figure 3.


def window_moments(scene: Scene, area: np.ndarray, force: np.ndarray, percentiles: tuple[float, ...]) -> Statistic:
    """Return mean and standard deviation of A / N of windows (strips, percentiles, windows) [m2], [N]."""
    least = scene.friction.least_contact_fraction * scene.strip.window_m * scene.strip.width_m
    mu, valid = friction_coefficient(area, force, 1.0, least)

    def numbers(chosen: np.ndarray) -> dict[str, float]:
        found = {}
        for level, percentile in enumerate(percentiles):
            values = mu[chosen, level][valid[chosen, level]]
            found |= {f"mu_mean_{percentile:g}": float(values.mean()), f"mu_std_{percentile:g}": float(values.std())}
        return found

    return numbers


def strip_budget(name: str, scene: Scene, strips: int) -> Iterator[Row]:
    """Yield the rows of mesh and tolerance of so many strips, in units of the mean at the median.

    Strips are drawn on a mesh of half the cell, of which every second node has the scene's.
    """
    fine = load_scene(name, {"strip.cell_m": scene.strip.cell_m / 2})
    sample = surface_model.surface_model(fine).sampler(geometry.strip_grid(fine))
    seeds = [[scene.seed, STREAMS["strips"], number] for number in range(strips)]
    on_both = [sample(np.random.default_rng(seed)) for seed in seeds]
    coarse = [field[::2, ::2] for field in on_both]

    def moments(of: Scene, fields: list[np.ndarray], tolerance: float) -> Statistic:
        numbers = window_moments(of, *solve_windows(of, fields, PERCENTILES, tolerance), PERCENTILES)

        def relative(chosen: np.ndarray) -> dict[str, float]:
            found = numbers(chosen)
            unit = found.pop("mu_mean_50")
            return {key: value / unit for key, value in found.items()}

        return relative

    tolerance, few = scene.numerics.contact_tolerance, max(2, strips // 4)
    start = time.perf_counter()
    usual = moments(scene, coarse, tolerance)
    seconds = time.perf_counter() - start
    changes = compare_paired(strips, usual, moments(fine, on_both, tolerance))
    yield from rows_of_source(name, "mesh", changes, seconds, strips, FIRST_ORDER)
    changes = compare_paired(few, usual, moments(scene, coarse[:few], TIGHT))
    yield from rows_of_source(name, "solver tolerance", changes, seconds, few)


def read_summary(path: Path) -> dict[float, dict[str, str]]:
    """Return the rows of the kept summary.csv of a scene by percentile."""
    with path.open(encoding="utf-8") as table:
        return {float(row["percentile"]): row for row in csv.DictReader(table)}


def read_number(row: Mapping[str, str], name: str, unit: str = "") -> tuple[float, float]:
    """Return a number of a row of summary.csv, and its standard error from its 95 % interval."""
    value, low, high = (float(row[f"{name}{end}{unit}"]) for end in ("", "_low", "_high"))
    return value, (high - low) / (2 * NORMAL)


def strip_sampling(name: str, summary: Path) -> Iterator[Row]:
    """Yield the sampling errors of a run, from the 95 % intervals of its summary.csv."""
    by_percentile = read_summary(summary)
    for percentile in PERCENTILES:
        for kind in ("mean", "std"):
            if kind == "std" or percentile != 50.0:  # the mean at the median sets the shear strength
                value, error = read_number(by_percentile[percentile], f"combined_{kind}")
                change = {f"mu_{kind}_{percentile:g}": Change(value, error / value, 0.0)}
                yield from rows_of_source(name, "sampling", change, 0.0, 0)


# Cycles of the oscillator, Figure 5.


class Friction(NamedTuple):
    """Mean, standard deviation, correlation length [m] and shapes of the Beta distribution of mu_S."""

    mean: float
    std: float
    length_m: float
    a: float
    b: float

    def paths(self, nodes: int) -> Recursion:
        """Return paths of so many nodes a correlation length."""
        marginal = BetaDistribution.of_moments(self.a, self.b, 0.0, self.std)
        return recursion(FrictionProcess(marginal, self.length_m), self.length_m / nodes)


def read_friction(summary: Path) -> tuple[Friction, Friction]:
    """Read the friction at the median from the summary.csv of a scene: numbers, and their standard errors."""
    row = read_summary(summary)[50.0]
    length = read_number(row, "combined_length_least_squares", "_m")
    names = ("combined_mean", "combined_std", "beta_a", "beta_b")
    mean, std, a, b = (read_number(row, name) for name in names)
    values, errors = zip(mean, std, length, a, b, strict=True)
    return Friction(*values), Friction(*errors)


def count_cycles(
    scene: Scene, friction: Friction, paths: int, nodes: int, step: int = 1, tolerance: float | None = None
) -> np.ndarray:
    """Return cycles (paths, dampings) on paths of so many nodes a correlation length, reading every `step`-th node."""
    drawn, options = friction.paths(nodes), mass_on_belt.motion_options(scene)
    options = options if tolerance is None else replace(options, tolerance=tolerance)
    belt, law = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, friction.mean)
    periods, found = scene.ensemble.duration_periods, []
    for number in range(paths):
        path = Thinned(drawn.realisation([scene.seed, STREAMS["oscillator"], number]), step)
        found.append(ensemble_counts(belt, law, path, step * drawn.spacing, periods, DAMPING, options).cycles)
    return np.array(found)


def oscillator_budget(name: str, scene: Scene, paths: int, summary: Path) -> Iterator[Row]:
    """Yield the rows of every source, as shares of the mean count at each damping ratio."""
    friction, errors = read_friction(summary)
    nodes = 2 * int(scene.ensemble.nodes_per_correlation_length)
    start = time.perf_counter()
    usual = count_cycles(scene, friction, paths, nodes, 2)
    seconds = time.perf_counter() - start
    mean = np.maximum(usual.mean(axis=0), 1.0 / paths)

    def rows(source: str, shift: np.ndarray, error: np.ndarray | float, factor: float = 1.0) -> list[Row]:
        columns = np.transpose([mean, shift / mean, error / mean]).tolist()
        changes = {f"cycles_{damping:g}": Change(*column) for damping, column in zip(DAMPING, columns, strict=True)}
        return rows_of_source(name, source, changes, seconds, paths, factor)

    sources = {
        "path nodes": (count_cycles(scene, friction, paths, nodes), FIRST_ORDER),
        "integrator": (count_cycles(scene, friction, paths, nodes, 2, TIGHT), 1.0),
    }
    for field in ("mean", "std", "length_m"):
        moved = friction._replace(**{field: getattr(friction, field) + getattr(errors, field)})
        sources[f"friction {field}"] = count_cycles(scene, moved, paths, nodes, 2), 1.0
    for source, (other, factor) in sources.items():
        difference = usual - other
        yield from rows(source, difference.mean(axis=0), difference.std(axis=0, ddof=1) / np.sqrt(paths), factor)
    yield from rows("sampling", usual.std(axis=0, ddof=1) / np.sqrt(scene.ensemble.realisations), 0.0 * mean)
