"""Pressures at a few nodes, from solves that stop when these are known."""

import math

import numpy as np
import pytest

from roughslip.contact import Influence, point_pressures, solve
from roughslip.contact.at_nodes import LARGER_MESH, solve_at
from roughslip.contact.influence import gathered
from roughslip.contact.kernels import gap_errors
from roughslip.grid import Grid

CENTRE = (np.array([32, 32, 31, 31]), np.array([32, 31, 32, 31]))


def rough(seed, n=64):
    """Heights of unit scatter with a correlation length of a tenth of the edge."""
    wave = np.hypot(*np.meshgrid(np.fft.fftfreq(n), np.fft.rfftfreq(n), indexing="ij"))
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((n, n)))
    heights = np.fft.irfft2(noise * np.exp(-((wave * n * 0.1 * math.pi) ** 2) / 4 * 0.4), (n, n))
    return heights / heights.std()


@pytest.mark.parametrize("shape", [(12, 12, 1.0), (24, 24, 1.0), (10, 60, 1.0), (16, 16, 4.0), (12, 12, 0.1)])
def test_inverse_of_b_is_an_m_matrix(shape):
    """No entry off the diagonal is positive, rows have positive sums, and the bound of K_ii holds."""
    nx, ny, aspect = shape
    influence = Influence(Grid(nx, ny, 1.0, aspect), 1.0)
    inverse = np.linalg.inv(gathered(influence.coefficients, *np.indices((nx, ny)).reshape(2, -1)))
    diagonal = np.diag(inverse)
    assert (inverse - np.diag(diagonal)).max() <= 1e-12 * diagonal.max()
    assert inverse.sum(axis=1).min() > 0
    assert diagonal.max() <= LARGER_MESH * influence.approximate_inverse.max()


@pytest.mark.parametrize(("plane", "hardness"), [(0.0, math.inf), (1.0, math.inf), (-2.0, math.inf), (0.5, 0.3)])
def test_pressures_lie_within_their_bounds(plane, hardness):
    """Against full solves: the same nodes in contact, pressures within bounds that are as narrow as asked."""
    influence = Influence(Grid(64, 64, 1.0, 1.0), 1.0)
    methods = set()
    for seed in range(12):
        interference = rough(seed) - plane
        full = solve(influence, interference, 1e-10, hardness_pa=hardness)
        found = solve_at(influence, interference, CENTRE, 1e-3, 1e-10, hardness_pa=hardness)
        true, highest = full.pressure[CENTRE], full.pressure.max()
        np.testing.assert_array_equal(found.pressure > 0, true > 0)
        assert np.all((found.low - 1e-9 * highest <= true) & (true <= found.high + 1e-9 * highest))
        assert np.all(np.abs(found.pressure - true) <= 1.1e-3 * true)
        assert found.work <= full.work
        methods.add(found.method)
    assert methods & {"bounded", "dense"}


@pytest.mark.parametrize("plane", [0.0, 1.0])
def test_pressures_without_the_mesh_error_are_those_of_full_solves(plane):
    """At nodes whose neighbour is out of contact, within the 1e-3 of the bounds, of the largest."""
    influence = Influence(Grid(64, 64, 1.0, 1.0), 1.0)
    for seed in range(10):
        interference = rough(seed) - plane
        full = solve(influence, interference, 1e-10).pressure
        edge = (full[1:-1, 1:-1] > 0) & (full[2:, 1:-1] == 0)
        nodes = tuple(1 + np.argwhere(edge)[:: max(1, np.count_nonzero(edge) // 4)].T)
        found = solve_at(influence, interference, nodes, 1e-3, 1e-10, points=True)
        assert np.all(found.low > 0)
        expected = point_pressures(full, nodes)
        np.testing.assert_allclose(found.pressure, expected, rtol=0, atol=1e-3 * expected.max())
        assert np.abs(found.pressure - full[nodes]).max() > 0.02 * expected.max()


def test_nodes_below_the_plane_need_no_solve():
    """u = B p is not negative, so a node that starts below the plane stays out of contact."""
    interference = np.ones((64, 64))
    interference[CENTRE] = 0.0
    found = solve_at(Influence(Grid(64, 64, 1.0, 1.0), 1.0), interference, CENTRE)
    assert found.method == "none"
    assert not found.pressure.any()


def test_bounds_save_most_of_the_work():
    """Of 40 surfaces at the median, the centre takes less than half the products of full solves at 1e-6."""
    influence = Influence(Grid(64, 64, 1.0, 1.0), 1.0)
    full = sum(solve(influence, rough(seed), 1e-6).work for seed in range(40))
    assert sum(solve_at(influence, rough(seed), CENTRE, tolerance=1e-6).work for seed in range(40)) < full / 2


def test_errors_of_gaps_are_the_largest_on_each_side():
    """No node below the cap may lie above the plane, none under pressure below it."""
    rng = np.random.default_rng(3)
    for cap in (math.inf, 0.7):
        pressure, gap = np.clip(rng.uniform(-1.0, 1.0, (9, 7)), 0.0, cap), rng.standard_normal((9, 7))
        gap[pressure == cap], gap[pressure == 0] = -9.0, gap[pressure == 0] + 9.0  # neither counts
        up, down = -gap[pressure < cap].min(), gap[pressure > 0].max()
        assert gap_errors(pressure, gap, cap) == (up, down)
    assert gap_errors(np.zeros((3, 3)), np.ones((3, 3)), math.inf) == (0.0, 0.0)


def test_bounds_end_solves_of_heights_in_micrometres():
    """The same surfaces in metres and pascals: the same work, and pressures in the unit of E* over length."""
    for seed in range(4):
        one = solve_at(Influence(Grid(64, 64, 1.0, 1.0), 1.0), rough(seed), CENTRE, 1e-3, 1e-10)
        small = solve_at(Influence(Grid(64, 64, 1e-6, 1e-6), 1e11), 1e-6 * rough(seed), CENTRE, 1e-3, 1e-10)
        assert (small.method, small.work) == (one.method, one.work)
        assert one.method != "fft"
        np.testing.assert_allclose(small.pressure, 1e11 * one.pressure, rtol=2e-3)
