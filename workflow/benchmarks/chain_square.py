"""The budget of Figure 2: what mesh, modes, tolerance, expansion and samples leave in the pressure at the centre."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from roughslip.chaos.local import Samples, fit_local, jackknife_deviations
from roughslip.contact.solve import solve
from roughslip.grid import Grid
from roughslip.stages.from_scene import elastic, geometry
from roughslip.stages.from_scene.nodes import central_nodes
from roughslip.surface.karhunen_loeve import heights, karhunen_loeve
from workflow.benchmarks.chain_problem import FIRST_ORDER, Change, Numbers, Statistic, jackknifed, rows
from workflow.benchmarks.chaos_problem import JUDGED, QUANTILES, Square, references
from workflow.benchmarks.measure import Row, say

LEVEL = 1  # of PERCENTILES: the median
MORE_MODES = 4  # times as many, of which those of the scene are the first
TIGHT = 1e-12
DRAWS = 400_000
STREAM = 28  # the second entry of the seed of the modes that the scene leaves out


def statistic(pressure: np.ndarray) -> Statistic:
    """Contact probability, mean and quantiles given contact of pressures : (surfaces, nodes) [Pa]."""

    def numbers(chosen: np.ndarray) -> Numbers:
        part = pressure[chosen].ravel()
        positive = part[part > 0]
        found = {"contact_probability": len(positive) / len(part), "mean_pressure": float(part.mean())}
        return found | dict(zip(QUANTILES, map(float, np.quantile(positive, JUDGED)), strict=True))

    return numbers


def centre(square: Square, grid: Grid, surfaces_: np.ndarray, tolerance: float, step: int = 1) -> np.ndarray:
    """p : (surfaces, 4) [Pa] at the central nodes of heights : (surfaces, nx, ny) on a mesh of which every `step`-th
    node is one of the scene's."""
    influence, nodes = elastic.influence(square.configuration, grid), central_nodes(square.model, square.grid)
    found = np.empty((len(surfaces_), len(nodes.x)))
    for row, rough in enumerate(surfaces_):
        pressure = solve(influence, rough - square.planes[LEVEL], tolerance).pressure
        found[row] = pressure[step * nodes.x, step * nodes.y]
    return found


def budget(name: str, surfaces_: int, kept: Path) -> Iterator[Row]:
    """Rows of every source at the median. kept : the reference of the pressure at the centre

    The mesh is varied on surfaces with all their modes, drawn on a mesh of half the cell.
    """
    square = Square.of(name)
    tolerance = square.configuration["numerics"]["contact_tolerance"]
    grid, fine = square.grid, Grid(2 * square.grid.nx, 2 * square.grid.ny, square.grid.dx / 2, square.grid.dy / 2)
    modes = len(square.modes)
    xi = square.design("monte_carlo", surfaces_, 0)
    start = time.perf_counter()
    rough = np.stack([square.surface(one) for one in xi])
    as_it_is = statistic(centre(square, grid, rough, tolerance))
    seconds = time.perf_counter() - start
    say(f"{name}: {surfaces_} surfaces")

    more = min(MORE_MODES * modes, grid.size)
    if more > modes:
        every = karhunen_loeve(square.model.covariance, grid, more).modes
        others = np.random.default_rng([square.seed, STREAM]).standard_normal((surfaces_, more - modes))
        richer = rough + np.stack([heights(every[modes:], one) for one in others])
        better = statistic(centre(square, grid, richer, tolerance))
        yield from rows(name, "modes", jackknifed(surfaces_, as_it_is, better), [seconds], surfaces_)
        say(f"{name}: {more} modes")

    sample = square.model.sampler(fine)
    on_both = np.stack([sample(np.random.default_rng([square.seed, STREAM, number])) for number in range(surfaces_)])
    fine_pressure = statistic(centre(square, fine, on_both, tolerance, step=2))
    on_coarse = statistic(centre(square, grid, np.ascontiguousarray(on_both[:, ::2, ::2]), tolerance))
    changes = jackknifed(surfaces_, on_coarse, fine_pressure)
    yield from rows(name, "mesh", changes, [seconds], surfaces_, factor=FIRST_ORDER)
    say(f"{name}: mesh of half the cell")

    few = max(20, surfaces_ // 10)
    tight = statistic(centre(square, grid, rough[:few], TIGHT))
    yield from rows(name, "solver tolerance", jackknifed(few, as_it_is, tight), [seconds], few)

    yield from _expanded(name, square, kept)


def _expanded(name: str, square: Square, kept: Path) -> Iterator[Row]:
    """Rows of the expansion, with its own seconds: off the reference, and the sampling error that it tells itself."""
    reference, terms = references(kept)[LEVEL], square.configuration["expansion"]
    start = time.perf_counter()
    solved = square.solved(square.design("latin_hypercube", terms["samples"], 0))
    variables = np.einsum("km,nvm->knv", solved.xi, square.directions)
    samples = Samples(variables, square.nodes.distance2, solved.pressure[:, LEVEL], solved.gap[:, LEVEL], square.odd)
    fitting = time.process_time()
    found = fit_local(samples, terms["degree"], square.target)
    generator = np.random.default_rng([square.seed, geometry.STREAM_DRAWS])
    drawn = found.draw(generator, DRAWS, left_out=True)
    seconds, fit_seconds = time.perf_counter() - start, time.process_time() - fitting
    differences = reference.differences(drawn[0])
    numbers = [statistic(one[:, None])(np.arange(DRAWS)) for one in drawn]
    off, scatter = {}, {}
    for key, value in numbers[0].items():
        told = float(np.linalg.norm(jackknife_deviations(np.array([one[key] for one in numbers[1:]])))) / value
        off[key] = Change(value, differences[key].seen, differences[key].reference_error)
        scatter[key] = Change(value, told, 0.0)
    yield from rows(name, "expansion", off, [seconds], terms["samples"])
    yield from rows(name, "sampling", scatter, [seconds], terms["samples"], fit_seconds=fit_seconds)
