"""Solves and sweeps: contact conditions, work, and changes that must not change a solution."""

import importlib
import math

import numpy as np
import pytest
from scipy.special import ndtri

from roughslip.contact import conjugate_gradients
from roughslip.contact.influence import Influence
from roughslip.contact.problem import Problem
from roughslip.contact.solve import DENSE_LIMIT, solve, solve_load, sweep
from roughslip.errors import ConvergenceError, ParameterError
from roughslip.grid import Grid

solve_module = importlib.import_module("roughslip.contact.solve")  # the package exports its function
PERCENTILES = (5, 10, 30, 50, 70, 90, 95, 99.9)


@pytest.mark.parametrize(("shape", "length"), [((240, 10), 0.0), ((64, 64), 6.4)])
def test_strip_and_square_from_light_to_deep(surface, shape, length):
    """Dense where few nodes can touch; contact only grows as the plane descends."""
    influence, heights = Influence(Grid(*shape, 1.0, 1.0), 1.0), surface(shape, length, 1)
    solutions = [solve(influence, heights + ndtri(percentile / 100)) for percentile in PERCENTILES]
    assert max(solution.work for solution in solutions) <= 60
    assert (solutions[0].method, solutions[-1].method) == ("dense", "fft")
    fractions = [solution.area_fraction for solution in solutions]
    assert fractions == sorted(fractions)


def test_median_of_a_rough_square_in_few_products(surface) -> None:
    """Measured 36 on average; without the approximate inverse 62. A sweep saves 0.31 of the products, and
    0.28 where the displacement of its starts is not known."""
    influence = Influence(Grid(64, 64, 1.0, 1.0), 1.0)
    assert np.mean([solve(influence, surface((64, 64), 6.4, seed)).work for seed in range(4)]) <= 42
    heights, planes = surface((64, 64), 6.4, 6), [-0.2 * k for k in range(6)]
    swept = sum(s.work for s in sweep(influence, heights, planes))
    assert swept < 0.71 * sum(solve(influence, heights - plane).work for plane in planes)


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


TOLERANCE = 1e-12
ALLOWED = 100 * TOLERANCE  # by the bound of |B^-1| |B|: relative error of a pressure over the residual


@pytest.mark.parametrize("share", [0.3, 1.0, 4.0])
def test_start_of_a_sweep_has_its_displacement(surface, share: float) -> None:
    """No pressure falls as the plane descends, so the extrapolation is not negative and B p is extrapolated with it."""
    influence = Influence(Grid(48, 40, 1.0, 0.8), 1.0)
    heights = surface((48, 40), 5.0, 5)
    above = sweep(influence, heights, [0.0, -0.5], TOLERANCE).solutions
    start = solve_module._extrapolated(above, heights, -0.5 - 0.5 * share)
    assert start.displacement is not None
    lifted = influence.apply(start.pressure)
    np.testing.assert_allclose(start.displacement, lifted, rtol=0, atol=1e-13 * lifted.max())
    start = solve_module._extrapolated(above[::-1], heights, 0.0)  # upwards pressures reach zero, and B p is not known
    np.testing.assert_allclose(start.pressure, above[0].pressure, rtol=0, atol=1e-14)


@pytest.mark.parametrize("hardness", [math.inf, 0.3])
def test_order_of_planes(surface, hardness: float) -> None:
    """From no to full contact: equal bits in any order and repeated, and agreement with single solves."""
    influence = Influence(Grid(48, 40, 1.0, 0.8), 1.0)
    heights = surface((48, 40), 5.0, 5)
    planes = [0.0, 9.0, 1.6, -1.6, 0.0, -0.8, -0.8 - 1e-13, -20.0]
    swept = sweep(influence, heights, planes, TOLERANCE, hardness_pa=hardness).solutions
    order = np.random.default_rng(6).permutation(len(planes))
    for k, shuffled in zip(
        order, sweep(influence, heights, [planes[k] for k in order], TOLERANCE, hardness), strict=True
    ):
        assert np.array_equal(shuffled.pressure, swept[k].pressure)
        assert np.array_equal(shuffled.gap, swept[k].gap)
        assert np.array_equal(shuffled.plastic_displacement, swept[k].plastic_displacement)
    for plane, solution in zip(planes, swept, strict=True):
        single = solve(influence, heights - plane, TOLERANCE, hardness_pa=hardness)
        assert np.array_equal(single.contact, solution.contact)
        allowed = ALLOWED * np.maximum(heights - plane, 0).max()  # of pressures and lengths, B_00 being of order one
        np.testing.assert_allclose(single.pressure, solution.pressure, rtol=0, atol=allowed)
        np.testing.assert_allclose(single.plastic_displacement, solution.plastic_displacement, rtol=0, atol=allowed)
    assert {s.method for s in swept} >= {"fft", "none"}
    assert len(sweep(influence, heights, [])) == 0


@pytest.mark.parametrize("periodic", [False, True])
def test_a_load_that_one_node_bears_takes_no_iteration(periodic):
    """Its pressure is the load, and the plane stands as far below its height as it is pressed down: B_00 p.
    Such loads were lost in the rounding of the heights below about 1e-30 Pa."""
    influence = Influence(Grid(24, 20, 1e-6, 1e-6), 2.3e11, periodic)
    heights = 1e-7 * np.random.default_rng(0).standard_normal((24, 20))
    for mean_pressure in (1e-30, 1e-12, 1e6):
        found = solve_load(influence, heights, mean_pressure)
        load = mean_pressure * heights.size
        assert found.pressure.max() == found.pressure[np.unravel_index(heights.argmax(), heights.shape)] == load
        assert np.count_nonzero(found.pressure) == found.nodes == 1
        assert found.plane == pytest.approx(heights.max() - influence.diagonal * load, rel=1e-15)
        assert abs(found.gap.min()) <= 1e-15 * influence.diagonal * load  # rounded as the machine does
    iterated = solve_load(influence, heights, 1e7)
    assert iterated.method == "fft"
    assert found.plane > iterated.plane


def test_loads_of_no_contact_and_of_full_contact_are_named():
    """Before a solve; a guess of another load begins with the right one; equal nodes share a load."""
    influence, heights = Influence(Grid(16, 16, 1e-6, 1e-6), 1e11), np.random.default_rng(1).random((16, 16)) * 1e-8
    for load, name in ((0.0, "no contact"), (1e-300, "no contact"), (1e300, "full contact"), (1e9, "full contact")):
        with pytest.raises(ParameterError, match=name):
            solve_load(influence, heights, load, hardness_pa=1e9 if load == 1e9 else np.inf)
    expected = solve_load(influence, heights, 1e8).pressure
    for guess in (1e30, 1e-300):
        found = solve_load(influence, heights, 1e8, initial_pressure=np.full(heights.shape, guess))
        np.testing.assert_allclose(found.pressure, expected, atol=1e-7 * expected.max())
    twins = np.where(heights < np.partition(heights, -3, axis=None)[-3], heights, 1e-8)
    assert np.count_nonzero(solve_load(influence, twins, 1e-30).pressure) == 3
