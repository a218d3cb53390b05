"""Measure what skipped work saves: each problem as the code solves it, and with everything computed, in turns.

The kinds of skip are those that costs.json counts. The tolerance of a case is 0 if the result must be the same to the
bit. The error of a row of `roughslip` is the difference of its result from that of `roughslip/plain`.

Expansions are not the same to the bit: a fit without terms that are zero by symmetry has less scatter, and fewer solves
have the error that was asked. Their tolerance is the error that the expansion estimates of itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from roughslip.chaos.enrichment import enrich
from roughslip.chaos.local import LocalExpansion, Samples, jackknife_deviations
from roughslip.chaos.sampling import kolmogorov_distance
from roughslip.contact import conjugate_gradients, dense_solver, nested
from roughslip.contact.conjugate_gradients import Problem
from roughslip.contact.influence import Influence, gathered
from roughslip.contact.solve import solve, sweep
from roughslip.grid import Grid
from roughslip.oscillator.limits import counts_by_period
from roughslip.oscillator.motion import MotionOptions, ensemble_counts
from roughslip.stages.from_scene import geometry
from roughslip.stages.runtime import skip_reasons
from workflow.benchmarks.chaos import MEDIAN, Square
from workflow.benchmarks.contact_problem import MODULUS, Convolution, square, surface
from workflow.benchmarks.oscillator import LAW, STUDY
from workflow.benchmarks.runner import OURS, is_met, make_row, race, report_rows, run_command, time_ratios
from workflow.evidence.rows import Row, case, fields, power

PLAIN = f"{OURS}/plain"
TOLERANCE = 1e-10  # of contact
ROUNDING = 1e-12
LEAST_EIGENVALUE = 0.5  # of B over B_00, on square cells; contact/periodic.py
STRIP_CELL = 2.5e-6  # m
SIGMAS = 3.0  # of the estimated error of the mean of an expansion
DRAWS = 2**15
DAMPING = (0.05, 0.1, 0.17, 0.23, 0.27, 0.3, 0.32, 0.36)

Call = Callable[[], tuple[Any, int]]  # the result, and its natural count of work


class Skip(NamedTuple):
    """Work that the code skips.

    reason : what is skipped and why, as costs.json counts it
    problem : what both solve, without blanks
    tolerance : of the difference
    skipping, plain : the problem as the code solves it, and with everything computed
    difference : of the two results, relative
    """

    reason: str
    problem: str
    tolerance: float
    skipping: Call
    plain: Call
    difference: Callable[[Any, Any], float]


class Sizes(NamedTuple):
    """What is measured.

    nodes : on an edge of the squares
    strip : nodes on the length of a strip
    periods : natural periods of a motion
    surfaces : of the paper's square, solved for an expansion
    square : scene of the other square
    asked : its Kolmogorov error
    most : the most surfaces solved for it
    """

    nodes: int = 256
    strip: int = 960
    periods: float = 100.0
    surfaces: int = 1000
    square: str = "resolved"
    asked: float = 0.02
    most: int = 2048


QUICK = Sizes(128, 240, 10.0, 300, "paper", 0.03, 512)


# Contact. The work is products times nodes.


def within_residual(influence: Influence) -> float:
    """Return by how much B_00 ||p|| / ||max(u_bar, 0)|| may differ if both residuals are at most TOLERANCE.

    With w = M p - q, M = B / B_00, and the least eigenvalue lambda of M: ||p - p*|| <= (1 + ||M||) / lambda
    ||min(w, p)|| (R. Mathias & J.-S. Pang, Linear Algebra Appl. 132 (1990) 123).
    """
    return 2 * TOLERANCE * (1 + influence.largest_eigenvalue / influence.diagonal) / LEAST_EIGENVALUE


def apart(influence: Influence, interference: np.ndarray, one: np.ndarray, other: np.ndarray) -> float:
    """Return B_00 ||p - p'|| / ||max(u_bar, 0)||; without contact, the number of different pressures."""
    reach = float(np.linalg.norm(np.maximum(interference, 0.0)))
    if reach == 0.0:
        return float(np.count_nonzero(one != other))
    return influence.diagonal * float(np.linalg.norm(one - other)) / reach


def solve_once(influence: Influence, interference: np.ndarray) -> tuple[np.ndarray, int]:
    """Solve as the code does."""
    found = solve(influence, interference, TOLERANCE)
    return found.pressure, found.work * found.nodes


def iterate(influence: Influence, interference: np.ndarray, start_nested: bool) -> tuple[np.ndarray, int]:
    """Solve by conjugate gradients on every node of the mesh."""
    problem = Problem(influence, interference)
    found = conjugate_gradients.solve(problem, TOLERANCE, nested.guess(problem) if start_nested else None)
    return found.pressure, found.products * interference.size


def contact_skips(n: int, nx: int) -> Iterator[Skip]:
    """Yield the skips of contact, on squares of n x n nodes or less, and on a strip of nx x 10 nodes."""
    influence, rough, product = (
        Influence(square(n), MODULUS),
        surface("gauss", square(n)),
        Convolution(square(n), MODULUS),
    )
    within = within_residual(influence)

    def compute_gap(u_bar: np.ndarray) -> tuple[np.ndarray, int]:
        """The gap without pressure, where any iteration starts, is nowhere negative."""
        assert (product(np.zeros(u_bar.shape)) - u_bar >= 0).all()
        return np.zeros(u_bar.shape), u_bar.size

    u_bar = rough - 1.5 * rough.max()
    ours, plain = partial(solve_once, influence, u_bar), partial(compute_gap, u_bar)
    yield Skip(skip_reasons.NO_CONTACT, f"gauss-{n}x{n}-above", 0.0, ours, plain, partial(apart, influence, u_bar))

    u_bar = rough - np.median(rough)
    ours, plain = partial(iterate, influence, u_bar, True), partial(iterate, influence, u_bar, False)
    yield Skip(skip_reasons.NESTED, f"gauss-{n}x{n}-median", within, ours, plain, partial(apart, influence, u_bar))

    x = (np.arange(n) - n // 2) / n  # a paraboloid in contact on a disc of radius edge / 5
    u_bar = 1e-6 * ((1 / 5) ** 2 - x[:, None] ** 2 - x**2)
    ours, plain = partial(solve_once, influence, u_bar), partial(iterate, influence, u_bar, True)
    yield Skip(skip_reasons.CROPPED, f"paraboloid-{n}x{n}", within, ours, plain, partial(apart, influence, u_bar))

    few = np.zeros((n, n))
    few.ravel()[:: few.size // 50] = 1.0
    ours, plain = lambda: (influence.apply(few), 1), lambda: (product(few), 1)
    relative = lambda one, other: float(np.linalg.norm(one - other) / np.linalg.norm(other))  # noqa: E731
    yield Skip(skip_reasons.SUMMED, f"product-{n}x{n}-few", ROUNDING, ours, plain, relative)

    yield _below_the_plane()
    yield _swept(Grid(nx, 10, STRIP_CELL, STRIP_CELL))


def _below_the_plane() -> Skip:
    """Return the skip of nodes below the plane; plain: block pivoting on all nodes of the paper's square of 10 x 10."""
    grid = square(10)
    influence, rough = Influence(grid, MODULUS), surface("white", grid)
    u_bar = rough - np.median(rough)
    i, j = (axis.ravel() for axis in np.indices(grid.shape))

    def plain() -> tuple[np.ndarray, int]:
        matrix = gathered(influence.coefficients, i, j)
        pressure, factors, found = dense_solver.complementary_solution(matrix, u_bar.ravel())
        assert found
        return pressure.reshape(grid.shape), factors

    ours, difference = partial(dense_solver.solve, influence, u_bar), partial(apart, influence, u_bar)
    return Skip(skip_reasons.BELOW, "white-10x10-median", ROUNDING, ours, plain, difference)


def _swept(grid: Grid) -> Skip:
    """Return nine penetrations, each starting from those above; plain: each starting from zero pressure."""
    influence, rough = Influence(grid, MODULUS), surface("white", grid)
    planes = [float(np.percentile(rough, 100 - level)) for level in range(10, 100, 10)]

    def ours() -> tuple[list[np.ndarray], int]:
        found = list(sweep(influence, rough, planes, TOLERANCE))
        return [one.pressure for one in found], sum(one.work * one.nodes for one in found)

    def plain() -> tuple[list[np.ndarray], int]:
        found = [solve_once(influence, rough - plane) for plane in planes]
        return [pressure for pressure, _ in found], sum(work for _, work in found)

    def difference(some: list[np.ndarray], others: list[np.ndarray]) -> float:
        triples = zip(planes, some, others, strict=True)
        return max(apart(influence, rough - plane, one, other) for plane, one, other in triples)

    name = f"white-{grid.nx}x{grid.ny}-nine-planes"
    return Skip(skip_reasons.WARM, name, within_residual(influence), ours, plain, difference)


# Expansions and motions.


def samples_of(square: Square, xi: np.ndarray) -> Samples:
    """Return the surfaces of xi (K, M), solved at the median."""
    return square.samples(square.solve(xi, square.planes[[MEDIAN]]), 0)


def symmetric_terms(square: Square, surfaces: int) -> Skip:
    """Return a fit of so many surfaces without the terms that symmetry forbids; plain: with all terms."""
    samples = samples_of(square, square.design("latin_hypercube", surfaces, 0))
    every = replace(samples, odd=np.zeros((0, 0), dtype=np.int64))
    members = square.draw(square.fit(every), DRAWS, left_out=True).mean(axis=1)
    estimated = float(np.linalg.norm(jackknife_deviations(members[1:]))) / members[0]

    def fit(of: Samples) -> tuple[np.ndarray, int]:
        found = square.fit(of)
        return square.draw(found, DRAWS), len(found.indices)

    relative = lambda one, other: abs(float(one.mean() / other.mean()) - 1.0)  # noqa: E731
    name, tolerance = f"{square.name}-{surfaces}-surfaces", SIGMAS * estimated
    return Skip(skip_reasons.SYMMETRIC, name, tolerance, partial(fit, samples), partial(fit, every), relative)


def enough_solves(square: Square, asked: float, most: int) -> Skip:
    """Return an expansion of as many surfaces as the error asked takes; plain: of the most."""

    def solved(first: int, last: int) -> Samples:
        return samples_of(square, square.design("sobol", last, 0)[first:])

    def fit(of: Samples) -> tuple[LocalExpansion, Samples]:
        return square.fit(of), of

    def until_accurate() -> tuple[np.ndarray, int]:
        found = enrich(solved, fit, asked, least=128, most=most, seed=[square.seed, geometry.STREAM_ENRICHMENT])
        return square.draw(found.expansion, DRAWS), len(found.samples.pressure)

    def all_of_them() -> tuple[np.ndarray, int]:
        return square.draw(square.fit(solved(0, most)), DRAWS), most

    name = f"{square.name}-to-{asked:g}"
    return Skip(skip_reasons.ENOUGH_SOLVES, name, asked, until_accurate, all_of_them, kolmogorov_distance)


def repeated_cycles(periods: float) -> Skip:
    """Return counts of cycles without scatter, from the period of the first; plain: from the whole motion."""

    def counted(found: Any) -> tuple[np.ndarray, int]:
        return np.array([found.cycles, found.micro_slips]), found.steps

    ours = lambda: counted(counts_by_period(STUDY, LAW, periods, DAMPING, MotionOptions(1e-6)))  # noqa: E731
    plain = lambda: counted(ensemble_counts(STUDY, LAW, None, 0.0, periods, DAMPING, MotionOptions(1e-6)))  # noqa: E731
    different = lambda one, other: float(np.count_nonzero(one != other))  # noqa: E731
    name = f"{len(DAMPING)}-dampings-{periods:g}-periods"
    return Skip(skip_reasons.BY_PERIOD, name, 0.0, ours, plain, different)


def all_skips(sizes: Sizes) -> Iterator[Skip]:
    """Yield every measured skip."""
    yield from contact_skips(sizes.nodes, sizes.strip)
    yield symmetric_terms(Square("paper"), sizes.surfaces)
    yield enough_solves(Square(sizes.square), sizes.asked, sizes.most)
    yield repeated_cycles(sizes.periods)


def compare(skip: Skip, quick: bool) -> list[Row]:
    """Return the rows of a skip: as the code solves its problem, and with everything computed."""
    seconds, results = race({OURS: skip.skipping, PLAIN: skip.plain}, quick, least=3)
    errors = {OURS: skip.difference(results[OURS][0], results[PLAIN][0]), PLAIN: 0.0}
    tolerance = power(float(f"{skip.tolerance:.1e}"))
    name = case(skip=skip.reason.replace(" ", "-"), problem=skip.problem, tolerance=tolerance)
    rows = [make_row(name, method, errors[method], seconds[method], results[method][1]) for method in results]
    report_rows(rows)
    return rows


def measure(quick: bool, _: bool) -> dict[str, Any]:
    """Return the summary and the rows."""
    rows = [row for skip in all_skips(QUICK if quick else Sizes()) for row in compare(skip, quick)]
    times = {fields(name)["skip"]: ratio for name, ratio in time_ratios(rows).get(PLAIN, {}).items()}
    return {"summary": {"times_as_fast": times, "unchanged": all(is_met(row) for row in rows)}, "rows": rows}


if __name__ == "__main__":
    run_command(__doc__, measure)
