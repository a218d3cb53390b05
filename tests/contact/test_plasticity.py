"""Contact with the pressure limited to the hardness H: closed forms, limits, unloading and work."""

import math

import numpy as np
import pytest

from roughslip.contact.influence import Influence
from roughslip.contact.periodic import cell_heights
from roughslip.contact.solve import ContactSolution, solve, solve_load
from roughslip.grid import Grid

TOLERANCE = 1e-12


@pytest.mark.parametrize(("shape", "length"), [((12, 10), 0.0), ((48, 40), 5.0)])
def test_a_cap_that_is_not_reached_changes_nothing(surface, shape, length: float) -> None:
    influence = Influence(Grid(*shape, 1.0, 1.0), 1.0)
    interference = surface(shape, length, 3)
    elastic = solve(influence, interference, TOLERANCE)
    assert not np.any(elastic.plastic_displacement)
    peak = elastic.pressure.max()
    high = solve(influence, interference, TOLERANCE, hardness_pa=1.001 * peak)
    np.testing.assert_allclose(high.pressure, elastic.pressure, rtol=0, atol=100 * TOLERANCE * peak)
    assert not np.any(high.plastic_displacement)
    low = solve(influence, interference, TOLERANCE, hardness_pa=0.999 * peak)
    assert low.pressure.max() == 0.999 * peak
    assert np.count_nonzero(low.plastic_displacement) == 1
    assert low.pressure.sum() < elastic.pressure.sum()


@pytest.mark.parametrize("hardness", [1e-5, 1e-4, 1e-3, 1e-2])
def test_plastic_limit(surface, hardness: float) -> None:
    """N = H A_c, the bearing area of Abbott and Firestone, Mech. Eng. 55 (1933) 569. Elastic displacements
    are at most H max(B 1): nodes deeper than that bear H, those that do not
    reach the plane nothing. So A_c and N / H lie between the bearing areas at these two heights, which are the same
    for a cap low enough."""
    grid = Grid(48, 40, 1.0, 0.8)
    influence = Influence(grid, 1.0)
    interference = surface((48, 40), 5.0, 4)
    solution = solve(influence, interference, hardness_pa=hardness)
    force = solution.pressure.sum() * grid.cell_area
    area = np.count_nonzero(solution.contact) * grid.cell_area
    elastic = hardness * influence.apply(np.ones(grid.shape)).max()
    most, least = (hardness * grid.cell_area * np.count_nonzero(z > 0) for z in (interference, interference - elastic))
    assert least * (1 - 1e-12) <= force <= hardness * area * (1 + 1e-12)
    assert hardness * area <= most * (1 + 1e-12)
    assert (least == most) == (hardness == 1e-5)
    assert force == pytest.approx(hardness * area, rel=1e-2)


@pytest.mark.parametrize(("shape", "length"), [((12, 10), 0.0), ((48, 40), 5.0)])
@pytest.mark.parametrize("hardness", [0.05, 0.3])
def test_loaded_again_the_residual_surface_is_elastic(surface, shape, length: float, hardness: float) -> None:
    """The unloaded surface z - u_plastic has the same pressures at the same plane without yielding. At a higher plane
    it is elastic; at a lower one it yields again."""
    influence = Influence(Grid(*shape, 1.0, 1.0), 1.0)
    heights = surface(shape, length, 5)
    first = solve(influence, heights, TOLERANCE, hardness_pa=hardness)
    assert np.any(first.plastic_displacement)
    residual_surface = heights - first.plastic_displacement
    again = solve(influence, residual_surface, TOLERANCE)
    allowed = 100 * TOLERANCE * heights.max()
    np.testing.assert_allclose(again.pressure, first.pressure, rtol=0, atol=allowed)
    np.testing.assert_allclose(again.gap, first.gap, rtol=0, atol=allowed)
    partly = solve(influence, residual_surface - 0.1, TOLERANCE, hardness_pa=hardness)
    assert partly.pressure.max() < hardness
    assert not np.any(partly.plastic_displacement)
    deeper = solve(influence, residual_surface + 0.1, TOLERANCE, hardness_pa=hardness)
    np.testing.assert_allclose(
        first.plastic_displacement + deeper.plastic_displacement,
        solve(influence, heights + 0.1, TOLERANCE, hardness_pa=hardness).plastic_displacement,
        rtol=0, atol=2 * allowed,
    )  # fmt: skip


@pytest.mark.parametrize(("shape", "length"), [((12, 10), 0.0), ((48, 40), 5.0)])
@pytest.mark.parametrize("hardness", [0.2, math.inf])
def test_force_is_the_derivative_of_the_work(surface, shape, length: float, hardness: float) -> None:
    """Loading takes the elastic and plastic work W = 1/2 sum p B p + H sum u_plastic, if no yielded node unloads. So
    dW = F d(penetration), by the trapezoidal rule up to the square of the step."""
    influence, step = Influence(Grid(*shape, 1.0, 0.8), 1.0), 2e-3
    heights = surface(shape, length, 6)
    less, more = (solve(influence, heights + d, TOLERANCE, hardness_pa=hardness) for d in (0.0, step))
    assert np.all(more.plastic_displacement >= less.plastic_displacement)
    works = [
        0.5 * np.sum(s.pressure * influence.apply(s.pressure)) + np.sum(s.pressure * s.plastic_displacement)
        for s in (less, more)
    ]
    assert works[1] - works[0] == pytest.approx((less.pressure.sum() + more.pressure.sum()) / 2 * step, rel=1e-4)


def rough(index: float, load: float) -> ContactSolution:
    """A periodic cell of ten waves under a load p / (E* h'), E* = 1, that yields at h' / index."""
    generator, k = np.random.default_rng(3), np.fft.fftfreq(80) * 80
    q = np.hypot(k[:, None], k)
    spectrum = np.where((q >= 4) & (q <= 10), np.maximum(q, 1.0) ** -1.8, 0.0)
    heights = np.fft.ifft2(np.fft.fft2(generator.standard_normal((80, 80))) * spectrum).real
    slope = math.hypot(*(np.sqrt(np.mean((2 * np.pi / 80 * np.fft.ifft2(1j * w * np.fft.fft2(heights)).real) ** 2))
                         for w in (k[:, None], k)))  # fmt: skip
    grid = Grid(80, 80, 1.0, 1.0)
    hardness = 1 / index if index else math.inf
    return solve_load(
        Influence(grid, 1.0, periodic=True), cell_heights(heights / slope, grid), load, 1e-8, None, hardness
    )


def test_the_share_of_the_real_area_at_the_hardness() -> None:
    """None at an index of 0.3. At 1, Persson's exp(-2) of the elastic area is above H at most. What yields gives load
    to neighbours: more than that yields, up to twice as much."""
    assert rough(0.0, 0.02).yielded_share == rough(0.3, 0.02).yielded_share == 0.0
    elastic, yielding = rough(0.0, 0.02), rough(1.0, 0.02)
    above = np.count_nonzero(elastic.pressure > 1.0) / elastic.shares.sum()
    assert 0.02 < above < math.exp(-2.0)
    assert above < yielding.yielded_share < 2 * above
    assert yielding.shares.mean() > elastic.shares.mean()
