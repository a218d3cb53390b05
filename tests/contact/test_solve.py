"""Solves, sweeps and the choice of the method: contact conditions, work, and refused input."""

import importlib
import math

import numpy as np
import pytest
from scipy.special import ndtri

from roughslip.contact import conjugate_gradients
from roughslip.contact.conjugate_gradients import Problem
from roughslip.contact.influence import Influence
from roughslip.contact.solve import DENSE_LIMIT, solve, solve_load, sweep
from roughslip.errors import ConvergenceError, ParameterError
from roughslip.grid import Grid

solve_module = importlib.import_module("roughslip.contact.solve")  # the package exports its function
PERCENTILES = (5, 10, 30, 50, 70, 90, 95, 99.9)


@pytest.mark.parametrize(("shape", "length"), [((240, 10), 0.0), ((64, 64), 6.4)])
def test_strip_and_square_from_light_to_deep(
    surface, contact_conditions, shape: tuple[int, int], length: float
) -> None:
    influence = Influence(Grid(*shape, 1.0, 1.0), 1.0)
    heights = surface(shape, length, 1)
    fractions = []
    for percentile in PERCENTILES:
        interference = heights + ndtri(percentile / 100)
        solution = solve(influence, interference)
        assert solution.work <= 60
        contact_conditions(solution, influence.apply(solution.pressure), interference)
        fractions.append(solution.area_fraction)
    assert {solve(influence, heights + ndtri(q / 100)).method for q in (5, 95)} == {"dense", "fft"}
    assert fractions == sorted(fractions)  # contact only grows as the plane descends


def test_median_of_a_rough_square_in_few_products(surface) -> None:
    """Measured 36 on average; without the approximate inverse 62."""
    influence = Influence(Grid(64, 64, 1.0, 1.0), 1.0)
    assert np.mean([solve(influence, surface((64, 64), 6.4, seed)).work for seed in range(4)]) <= 42


def test_sweep_saves_products(surface) -> None:
    """Measured 0.72 of the products of single solves."""
    influence = Influence(Grid(64, 64, 1.0, 1.0), 1.0)
    heights, planes = surface((64, 64), 6.4, 6), [-0.2 * k for k in range(6)]
    swept = sum(s.work for s in sweep(influence, heights, planes))
    assert swept < 0.85 * sum(solve(influence, heights - plane).work for plane in planes)


def test_no_contact_costs_nothing(surface, monkeypatch: pytest.MonkeyPatch) -> None:
    influence = Influence(Grid(30, 30, 1.0, 1.0), 1.0)
    interference = surface((30, 30), 3.0, 7)
    interference -= interference.max()  # the summit touches without load
    monkeypatch.setattr(influence, "apply", lambda pressure: pytest.fail("a product with B"))
    monkeypatch.setattr(solve_module.dense_solver, "solve", lambda *_: pytest.fail("a dense solve"))
    solution = solve(influence, interference)
    assert (solution.method, solution.work, solution.residual) == ("none", 0, 0.0)
    assert not np.any(solution.pressure)
    assert np.array_equal(solution.gap, -interference)
    assert solution.area_fraction == solution.mean_pressure == 0.0


@pytest.mark.parametrize("limit", [0, DENSE_LIMIT])
def test_unreachable_tolerance_is_a_typed_error(surface, limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solve_module, "DENSE_LIMIT", limit)
    influence = Influence(Grid(12, 12, 1.0, 1.0), 1.0)
    with pytest.raises(ConvergenceError, match="rounding") as raised:
        solve(influence, surface((12, 12), 2.0, 8), tolerance=1e-20)
    assert 0 < raised.value.residual < 1e-14
    assert raised.value.work >= 1


def test_part_that_can_touch(surface) -> None:
    """A bump on a large flat: solved on the rows and columns that can touch, and the gap is right everywhere."""
    grid = Grid(150, 120, 1.0, 1.0)
    x, y = np.meshgrid(grid.x() - 60, grid.y() - 70, indexing="ij")
    interference = 20.0 - (x**2 + y**2) / 60 + 0.5 * surface((150, 120), 4.0, 3)
    influence = Influence(grid, 1.0)
    solution = solve(influence, interference, 1e-11)
    assert solution.method == "fft"
    gap = influence.apply(solution.pressure) - interference
    np.testing.assert_array_equal(solution.gap, gap)
    whole = conjugate_gradients.solve(Problem(influence, interference), 1e-11)
    np.testing.assert_allclose(solution.pressure, whole.pressure, rtol=0, atol=1e-8 * whole.pressure.max())
    assert influence.on((30, 20)).coarser.grid == Grid(15, 10, 2.0, 2.0)


FREE = Influence(Grid(4, 3, 1.0, 1.0), 1.0)
CELL = Influence(Grid(4, 3, 1.0, 1.0), 1.0, periodic=True)
FLAT = np.ones((4, 3))
HOLED = np.where(np.arange(12).reshape(4, 3) == 4, math.nan, 1.0)


@pytest.mark.parametrize(
    ("field", "message"), [(FLAT.T, "shape"), (FLAT[0], "shape"), (HOLED, "finite"), (math.inf * FLAT, "finite")]
)
def test_refuses_fields(field: np.ndarray, message: str) -> None:
    for wrong in (
        lambda: solve(FREE, field),
        lambda: solve(FREE, FLAT, initial_pressure=field),
        lambda: sweep(FREE, field, [0.0]),
    ):
        with pytest.raises(ParameterError, match=message):
            wrong()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: solve(FREE, FLAT, initial_pressure=-FLAT), "negative"),
        *((lambda t=t: solve(FREE, FLAT, tolerance=t), "tolerance") for t in (0.0, -1.0, 1.0, math.nan)),
        *((lambda z=z: sweep(FREE, FLAT, [0.0, z]), "planes") for z in (math.nan, math.inf)),
        *((lambda p=p: solve_load(CELL, FLAT, p), "mean pressure") for p in (-1.0, math.nan, math.inf)),
        *((lambda h=h: solve(FREE, FLAT, hardness_pa=h), "hardness") for h in (0.0, -1.0, math.nan)),
        *((lambda h=h: solve_load(FREE, FLAT, 0.5, hardness_pa=h), "hardness") for h in (0.0, -1.0, math.nan)),
        # At p = H the whole surface yields and any plane is a solution
        *((lambda i=i: solve_load(i, FLAT, 1.0, hardness_pa=1.0), "hardness") for i in (FREE, CELL)),
        # At a fixed plane the energy of a periodic cell has no minimum once the mean interference is positive
        (lambda: solve(CELL, FLAT), "solve_load"),
        (lambda: sweep(CELL, FLAT, [0.0]), "solve_load"),
    ],
)
def test_refuses_options(call, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        call()
