"""Periodic cells under a load, elastic and yielding: an independent solver, limits, bounds of errors, several loads."""

import math

import numpy as np
import pytest

from roughslip.contact import Influence, conjugate_gradients, solve_load, solve_loads
from roughslip.errors import ParameterError
from roughslip.grid import Grid


def nearest(trial: np.ndarray, cap: float, mean: float) -> np.ndarray:
    """The pressures between zero and the cap, of the given mean, that are nearest to a trial: by bisection."""
    cap = min(cap, mean * trial.size)  # no node bears more than all
    low, high = -trial.max(), cap - trial.min()
    for _ in range(100):
        shift = (low + high) / 2
        low, high = (shift, high) if np.clip(trial + shift, 0, cap).mean() < mean else (low, shift)
    return np.clip(trial + shift, 0, cap)


def projected_gradient(influence: Influence, heights: np.ndarray, cap: float, mean: float) -> np.ndarray:
    """The plain method: p'Bp / 2 - p'z falls along its gradient, with the momentum of Beck and Teboulle (2009)."""
    displacements = np.fft.rfft2(influence.coefficients)  # of the periodic cell: no product of the solver
    pressure = trial = np.full(heights.shape, mean)
    t = 1.0
    for _ in range(4000):
        gradient = np.fft.irfft2(displacements * np.fft.rfft2(trial), heights.shape) - heights
        step = nearest(trial - gradient / influence.largest_eigenvalue, cap, mean)
        if np.sum((trial - step) * (step - pressure)) > 0:  # restart, O'Donoghue and Candes (2015)
            t = 1.0
        t, before = (1 + math.sqrt(1 + 4 * t * t)) / 2, t
        change = np.abs(step - pressure).max()
        trial, pressure = step + (before - 1) / t * (step - pressure), step
        if change < 1e-13 * mean:
            return pressure
    raise AssertionError("the plain method has not converged")


@pytest.mark.parametrize(
    ("load", "hardness"), [(0.02, math.inf), (0.3, math.inf), (0.02, 0.2), (0.3, 0.5), (0.3, 0.32)]
)
def test_against_projected_gradients(surface, load: float, hardness: float) -> None:
    """Slopes of 0.5: yielded shares from nothing to nearly all. Both reach 1e-11 of the largest pressure."""
    grid = Grid(20, 14, 1.0, 0.8)
    influence, heights = Influence(grid, 1.0, periodic=True), 1.4 * surface((20, 14), 4.0, 7)
    found = solve_load(influence, heights, load, 1e-12, hardness_pa=hardness)
    plain = projected_gradient(influence, heights, hardness, load)
    np.testing.assert_allclose(found.pressure, plain, rtol=0, atol=1e-9 * plain.max())
    assert found.pressure.mean() == pytest.approx(load, rel=1e-11)
    assert np.any(found.plastic_displacement) == (plain.max() >= hardness)


@pytest.mark.parametrize("load", [0.01, 0.1, 0.5, 0.9])
def test_area_of_a_fully_plastic_contact_is_load_over_hardness(surface, load: float) -> None:
    """At E* h' / H = 3000. Shares count a cell by p / H at least, so that only edges with less than their share of H
    are counted in excess. These are few: 0.5 % of the area is allowed. Loads are shares of the hardness."""
    heights, hardness = surface((64, 48), 6.0, 3), 1e-4
    influence = Influence(Grid(64, 48, 1.0, 1.0), 1.0, periodic=True)
    found = solve_load(influence, heights, load * hardness, 1e-8, hardness_pa=hardness)
    assert 0 <= found.pressure.min() <= found.pressure.max() == hardness
    assert found.pressure.mean() == pytest.approx(load * hardness, rel=1e-11)
    assert found.area_fraction >= load * (1 - 1e-11)
    assert found.shares.mean() == pytest.approx(load, rel=5e-3)


def test_plastic_area_falls_to_the_elastic_one_with_the_hardness(surface) -> None:
    """Under one load the area falls as the hardness rises, from N / H to that of elastic contact."""
    heights, influence = surface((64, 64), 6.0, 5), Influence(Grid(64, 64, 1.0, 1.0), 1.0, periodic=True)
    areas = [
        solve_load(influence, heights, 0.01, 1e-8, hardness_pa=H).shares.mean() for H in (0.011, 0.02, 0.05, 0.2, 2)
    ]
    assert np.all(np.diff(areas) <= 0)
    assert areas[0] == pytest.approx(0.01 / 0.011, rel=0.01)
    assert areas[-1] == solve_load(influence, heights, 0.01, 1e-8).shares.mean()


@pytest.mark.parametrize("hardness", [math.inf, 2.5])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def test_gap_error_bounds_the_errors_of_plane_and_gap(surface, hardness: float, tolerance: float) -> None:
    """From light to full contact, against solutions to 1e-12. The bound is no more than twice the residual times its
    scale, which is relative to the largest pressure."""
    influence, heights = Influence(Grid(48, 40, 1.0, 1.0), 1.0, periodic=True), 3 * surface((48, 40), 5.0, 2)
    for load in (0.02, 0.3, 0.8, 1.5, 2.2):
        found = solve_load(influence, heights, load, tolerance, hardness_pa=hardness)
        exact = solve_load(influence, heights, load, 1e-12, hardness_pa=hardness)
        assert abs(found.plane - exact.plane) <= found.gap_error
        assert np.abs(found.signed_gap - exact.signed_gap).max() <= 2 * found.gap_error
        scale = max(
            np.linalg.norm(np.maximum(heights - found.plane, 0)), influence.diagonal * np.linalg.norm(found.pressure)
        )
        assert 0 < found.gap_error <= 2 * found.residual * scale


@pytest.mark.parametrize(("shape", "hardness"), [((40, 36), math.inf), ((80, 72), 0.6)])
def test_several_loads(surface, contact_conditions, shape: tuple[int, int], hardness: float) -> None:
    """In any order and repeated, with bits that do not depend on it, and equal to single solves to the tolerance.
    The smaller mesh always starts from the loads below, the larger one where they are close."""
    influence, heights = Influence(Grid(*shape, 1.0, 1.0), 1.0, periodic=True), surface(shape, 5.0, 1)
    loads = [0.05, 0.06, 0.02, 0.3, 0.06, 0.055]
    found = solve_loads(influence, heights, loads, 1e-9, hardness)
    for load, one in zip(loads, found, strict=True):
        alone = solve_load(influence, heights, load, 1e-9, hardness_pa=hardness)
        assert one.pressure.mean() == pytest.approx(load, rel=1e-11)
        assert one.residual <= 1e-9
        np.testing.assert_allclose(one.pressure, alone.pressure, rtol=0, atol=1e-6 * alone.pressure.max())
        contact_conditions(one, influence.apply(one.pressure), heights - one.plane, hardness)
    again = solve_loads(influence, heights, np.array(sorted(loads)), 1e-9, hardness)
    for one, other in zip(sorted(found, key=lambda s: s.mean_pressure), again, strict=True):
        np.testing.assert_array_equal(one.pressure, other.pressure)
    warm, cold = (
        sum(s.work for s in solve_loads(influence, heights, some, 1e-5)) for some in (np.linspace(0.1, 0.2, 9), [0.15])
    )
    assert warm < 0.9 * 9 * cold


def test_loads_that_nothing_bears_are_refused_before_a_solve(monkeypatch) -> None:
    """More than the hardness on the whole area; full contact; no contact. One of several refuses all."""
    influence, heights = Influence(Grid(8, 8, 1.0, 1.0), 1.0, periodic=True), np.arange(64.0).reshape(8, 8)
    monkeypatch.setattr(conjugate_gradients, "solve", lambda *_: pytest.fail("solved"))
    for load, line in (
        (1.01, "more than the hardness 1 Pa"),
        (1.0, "load of full contact"),
        (0.0, "load of no contact"),
    ):
        with pytest.raises(ParameterError, match=line):
            solve_load(influence, heights, load, hardness_pa=1.0)
        with pytest.raises(ParameterError, match=line):
            solve_loads(influence, heights, [0.5, load], hardness_pa=1.0)
