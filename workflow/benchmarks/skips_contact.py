"""What contact solves skip, and the same problems with everything computed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from roughslip.contact import conjugate_gradients, dense_solver, nested
from roughslip.contact.conjugate_gradients import Problem
from roughslip.contact.influence import Influence, gathered
from roughslip.contact.solve import solve, sweep
from roughslip.grid import Grid
from roughslip.stages.runtime import skip_reasons
from workflow.benchmarks import contact_problem
from workflow.benchmarks.contact_problem import MODULUS, square, surface

TOLERANCE = 1e-10
ROUNDING = 1e-12
LEAST_EIGENVALUE = 0.5  # of B over B_00, on square cells; contact/periodic.py
LEVELS = tuple(range(10, 100, 10))
STRIP_CELL = 2.5e-6  # m

Call = Callable[[], tuple[Any, int]]  # the result, and its natural count of work


@dataclass(frozen=True)
class Skip:
    """Work that the code skips.

    reason : what is skipped and why, as costs.json counts it
    problem : what both solve, without blanks
    tolerance : of the difference; 0 if the result is the same to the bit
    skipping, plain : the problem as the code solves it, and with everything computed
    difference : of the two results, relative
    """

    reason: str
    problem: str
    tolerance: float
    skipping: Call
    plain: Call
    difference: Callable[[Any, Any], float]


def within_residual(influence: Influence) -> float:
    """Return by how much B_00 ||p|| / ||max(u_bar, 0)|| may differ if both residuals are at most TOLERANCE.

    With w = M p - q, M = B / B_00, and the least eigenvalue lambda of M: ||p - p*|| <= (1 + ||M||) / lambda
    ||min(w, p)|| (R. Mathias & J.-S. Pang, Linear Algebra Appl. 132 (1990) 123).
    """
    return 2 * TOLERANCE * (1 + influence.largest_eigenvalue / influence.diagonal) / LEAST_EIGENVALUE


def apart(influence: Influence, interference: np.ndarray) -> Callable[[np.ndarray, np.ndarray], float]:
    """Return B_00 ||p - p'|| / ||max(u_bar, 0)|| as a function; without contact, the number of different pressures."""
    reach = float(np.linalg.norm(np.maximum(interference, 0.0)))

    def difference(one: np.ndarray, other: np.ndarray) -> float:
        if reach == 0.0:
            return float(np.count_nonzero(one != other))
        return influence.diagonal * float(np.linalg.norm(one - other)) / reach

    return difference


def solved(influence: Influence, interference: np.ndarray) -> Call:
    """Return the code's own solve."""

    def call() -> tuple[np.ndarray, int]:
        found = solve(influence, interference, TOLERANCE)
        return found.pressure, found.work

    return call


def iterated(
    influence: Influence, interference: np.ndarray, start: Callable[[Problem], np.ndarray | None] = lambda _: None
) -> Call:
    """Return a solve by conjugate gradients on every node of the mesh."""

    def call() -> tuple[np.ndarray, int]:
        problem = Problem(influence, interference)
        found = conjugate_gradients.solve(problem, TOLERANCE, start(problem))
        return found.pressure, found.products

    return call


def contact_skips(n: int, nx: int) -> Iterator[Skip]:
    """Yield every skip of contact, on squares of n x n nodes or less, and on a strip of nx x 10 nodes."""
    influence, rough = Influence(square(n), MODULUS), surface("gauss", square(n))
    yield from _without_contact(influence, rough)
    yield _below_the_plane()
    yield _cropped(influence)
    yield _swept(Grid(nx, 10, STRIP_CELL, STRIP_CELL))
    u_bar = rough - np.median(rough)
    yield Skip(
        skip_reasons.NESTED,
        f"gauss-{n}x{n}-median",
        within_residual(influence),
        iterated(influence, u_bar, nested.guess),
        iterated(influence, u_bar),
        apart(influence, u_bar),
    )
    yield _summed(n)


def _without_contact(influence: Influence, rough: np.ndarray) -> Iterator[Skip]:
    """Plain: the gap without pressure, where any iteration starts; it is nowhere negative."""
    u_bar = rough - 1.5 * rough.max()
    product = contact_problem.Convolution(influence.grid, MODULUS)

    def plain() -> tuple[np.ndarray, int]:
        pressure = np.zeros(u_bar.shape)
        gap = product(pressure) - u_bar
        assert (gap >= 0).all()
        return pressure, 1

    name = f"gauss-{influence.grid.nx}x{influence.grid.ny}-above"
    yield Skip(skip_reasons.NO_CONTACT, name, 0.0, solved(influence, u_bar), plain, apart(influence, u_bar))


def _below_the_plane() -> Skip:
    """Plain: block pivoting on all nodes of the paper's square of 10 x 10."""
    grid = square(10)
    influence, rough = Influence(grid, MODULUS), surface("white", grid)
    u_bar = rough - np.median(rough)
    i, j = (axis.ravel() for axis in np.indices(grid.shape))

    def plain() -> tuple[np.ndarray, int]:
        pressure, factors, found = dense_solver.complementary_solution(
            gathered(influence.coefficients, i, j), u_bar.ravel()
        )
        assert found
        return pressure.reshape(grid.shape), factors

    skipping = lambda: dense_solver.solve(influence, u_bar)  # noqa: E731
    return Skip(skip_reasons.BELOW, "white-10x10-median", ROUNDING, skipping, plain, apart(influence, u_bar))


def _cropped(influence: Influence) -> Skip:
    """A paraboloid in contact on a disc of radius edge / 5. Work: products times nodes."""
    n = influence.grid.nx
    x = (np.arange(n) - n // 2) / n
    u_bar = 1e-6 * ((1 / 5) ** 2 - x[:, None] ** 2 - x**2)
    everywhere = iterated(influence, u_bar, nested.guess)

    def cropped() -> tuple[np.ndarray, int]:
        found = solve(influence, u_bar, TOLERANCE)
        return found.pressure, found.work * found.nodes

    def plain() -> tuple[np.ndarray, int]:
        pressure, products = everywhere()
        return pressure, products * pressure.size

    tolerance, difference = within_residual(influence), apart(influence, u_bar)
    return Skip(skip_reasons.CROPPED, f"paraboloid-{n}x{n}", tolerance, cropped, plain, difference)


def _swept(grid: Grid) -> Skip:
    """Nine penetrations, each starting from those above; plain: each starting from zero pressure."""
    influence, rough = Influence(grid, MODULUS), surface("white", grid)
    planes = [float(np.percentile(rough, 100 - level)) for level in LEVELS]

    def swept() -> tuple[list[np.ndarray], int]:
        found = sweep(influence, rough, planes, TOLERANCE)
        return [one.pressure for one in found], sum(one.work for one in found)

    def plain() -> tuple[list[np.ndarray], int]:
        found = [solve(influence, rough - plane, TOLERANCE) for plane in planes]
        return [one.pressure for one in found], sum(one.work for one in found)

    def difference(one: Sequence[np.ndarray], other: Sequence[np.ndarray]) -> float:
        return max(
            apart(influence, rough - plane)(*pair)
            for plane, pair in zip(planes, zip(one, other, strict=True), strict=True)
        )

    name = f"white-{grid.nx}x{grid.ny}-nine-planes"
    return Skip(skip_reasons.WARM, name, within_residual(influence), swept, plain, difference)


def _summed(n: int) -> Skip:
    """The product of few pressures, summed directly; plain: transforms of the whole padded mesh."""
    grid = square(n)
    influence, transforms = Influence(grid, MODULUS), contact_problem.Convolution(grid, MODULUS)
    few = np.zeros(grid.shape)
    few.ravel()[:: grid.size // 50] = 1.0

    def relative(one: np.ndarray, other: np.ndarray) -> float:
        return float(np.linalg.norm(one - other) / np.linalg.norm(other))

    skipping, plain = lambda: (influence.apply(few), 1), lambda: (transforms(few), 1)
    return Skip(skip_reasons.SUMMED, f"product-{n}x{n}-few", ROUNDING, skipping, plain, relative)
