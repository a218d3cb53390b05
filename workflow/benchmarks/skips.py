"""Measure what skipped work saves: each problem as the code solves it, and with everything computed, in turns.

The kinds of skip are those that costs.json counts. The tolerance of a case is 0 if the result must be the same to the
bit. The error of a row of `roughslip` is the difference of its result from that of `roughslip/plain`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from roughslip.contact import conjugate_gradients, dense_solver, nested
from roughslip.contact.conjugate_gradients import Problem
from roughslip.contact.influence import Influence, gathered
from roughslip.contact.solve import solve, sweep
from roughslip.grid import Grid
from roughslip.oscillator.limits import counts_by_period
from roughslip.oscillator.motion import MotionOptions, ensemble_counts
from roughslip.stages.runtime import skip_reasons
from workflow.benchmarks.contact_problem import MODULUS, Convolution, square, surface
from workflow.benchmarks.oscillator import LAW, STUDY
from workflow.benchmarks.runner import OURS, is_met, make_row, race, report_rows, run_command, time_ratios
from workflow.evidence.rows import Row, case, fields, power

PLAIN = f"{OURS}/plain"
TOLERANCE = 1e-10  # of contact
ROUNDING = 1e-12
LEAST_EIGENVALUE = 0.5  # of B over B_00, on square cells; contact/periodic.py
STRIP_CELL = 2.5e-6  # m
DAMPING = (0.05, 0.1, 0.17, 0.23, 0.27, 0.3, 0.32, 0.36)

Call = Callable[[], tuple[Any, int]]  # the result, and its natural count of work


def compare(
    reason: str,
    problem: str,
    tolerance: float,
    skipping: Call,
    plain: Call,
    difference: Callable[[Any, Any], float],
    quick: bool,
) -> list[Row]:
    """Return the rows of a skip.

    reason : what is skipped and why, as costs.json counts it
    problem : what both solve, without blanks
    tolerance : of the difference
    skipping, plain : the problem as the code solves it, and with everything computed
    difference : of the two results, relative
    """
    seconds, results = race({OURS: skipping, PLAIN: plain}, quick, least=3)
    errors = {OURS: difference(results[OURS][0], results[PLAIN][0]), PLAIN: 0.0}
    name = case(skip=reason.replace(" ", "-"), problem=problem, tolerance=power(float(f"{tolerance:.1e}")))
    rows = [make_row(name, method, errors[method], seconds[method], results[method][1]) for method in results]
    report_rows(rows)
    return rows


# Contact. The work is products times nodes, of block pivoting the matrices that are factored.


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


def skips_of_squares(n: int, quick: bool) -> list[Row]:
    """Return the rows of one plane on squares of n x n nodes."""
    influence, rough = Influence(square(n), MODULUS), surface("gauss", square(n))
    product, within = Convolution(square(n), MODULUS), within_residual(influence)

    def compute_gap(u_bar: np.ndarray) -> tuple[np.ndarray, int]:
        """The gap without pressure, where any iteration starts, is nowhere negative."""
        assert (product(np.zeros(u_bar.shape)) - u_bar >= 0).all()
        return np.zeros(u_bar.shape), u_bar.size

    def row(reason: str, name: str, tolerance: float, u_bar: np.ndarray, ours: Callable, plain: Callable) -> list[Row]:
        calls, difference = (partial(ours, u_bar), partial(plain, u_bar)), partial(apart, influence, u_bar)
        return compare(reason, f"{name}-{n}x{n}", tolerance, *calls, difference, quick)

    x = (np.arange(n) - n // 2) / n
    paraboloid = 1e-6 * ((1 / 5) ** 2 - x[:, None] ** 2 - x**2)  # in contact on a disc of radius edge / 5
    once, cold = partial(solve_once, influence), partial(iterate, influence, start_nested=False)
    from_coarse = partial(iterate, influence, start_nested=True)
    rows = row(skip_reasons.NO_CONTACT, "gauss-above", 0.0, rough - 1.5 * rough.max(), once, compute_gap)
    rows += row(skip_reasons.CROPPED, "paraboloid", within, paraboloid, once, from_coarse)
    return rows + row(skip_reasons.NESTED, "gauss-median", within, rough - np.median(rough), from_coarse, cold)


def nodes_below_the_plane(quick: bool) -> list[Row]:
    """Return the rows of block pivoting on the paper's square of 10 x 10; plain: on all nodes."""
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
    return compare(skip_reasons.BELOW, "white-median-10x10", ROUNDING, ours, plain, difference, quick)


def sweeps(nx: int, quick: bool) -> list[Row]:
    """Return the rows of nine planes on a strip, each starting from those above; plain: from zero pressure."""
    grid = Grid(nx, 10, STRIP_CELL, STRIP_CELL)
    influence, rough = Influence(grid, MODULUS), surface("white", grid)
    planes = [float(np.percentile(rough, 100 - level)) for level in range(10, 100, 10)]

    def ours() -> tuple[list[np.ndarray], int]:
        found = sweep(influence, rough, planes, TOLERANCE)
        return [one.pressure for one in found], sum(one.work * one.nodes for one in found)

    def plain() -> tuple[list[np.ndarray], int]:
        found = [solve_once(influence, rough - plane) for plane in planes]
        return [pressure for pressure, _ in found], sum(work for _, work in found)

    def difference(some: list[np.ndarray], others: list[np.ndarray]) -> float:
        triples = zip(planes, some, others, strict=True)
        return max(apart(influence, rough - plane, one, other) for plane, one, other in triples)

    name = f"white-nine-planes-{nx}x10"
    return compare(skip_reasons.WARM, name, within_residual(influence), ours, plain, difference, quick)


def repeated_cycles(periods: float, quick: bool) -> list[Row]:
    """Return the rows of cycles without scatter, counted by the period of the first; plain: in the whole motion."""

    def counted(found: Any) -> tuple[np.ndarray, int]:
        return np.array([found.cycles, found.micro_slips]), found.steps

    def ours() -> tuple[np.ndarray, int]:
        return counted(counts_by_period(STUDY, LAW, periods, DAMPING, MotionOptions(1e-6)))

    def plain() -> tuple[np.ndarray, int]:
        return counted(ensemble_counts(STUDY, LAW, None, 0.0, periods, DAMPING, MotionOptions(1e-6)))

    def difference(one: np.ndarray, other: np.ndarray) -> float:
        return float(np.count_nonzero(one != other))

    name = f"{len(DAMPING)}-dampings-{periods:g}-periods"
    return compare(skip_reasons.BY_PERIOD, name, 0.0, ours, plain, difference, quick)


def measure(quick: bool, _: bool) -> dict[str, Any]:
    """Return the summary and the rows."""
    rows = skips_of_squares(128 if quick else 256, quick) + nodes_below_the_plane(quick)
    rows += sweeps(240 if quick else 960, quick) + repeated_cycles(10.0 if quick else 100.0, quick)
    times = {fields(name)["skip"]: ratio for name, ratio in time_ratios(rows).get(PLAIN, {}).items()}
    return {"summary": {"times_as_fast": times, "unchanged": all(is_met(row) for row in rows)}, "rows": rows}


if __name__ == "__main__":
    run_command(__doc__, measure)
