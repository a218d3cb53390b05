"""Contact area from the shares of cells at the edge of a contact.

Pressures at nodes near edges of contacts, against Hertz and Westergaard at random places of the mesh.

Pressures at a few nodes, from solves that stop when these are known."""

import itertools
import math

import numpy as np
import pytest

from roughslip.contact import Influence, point_pressures, solve, solve_load
from roughslip.contact.at_nodes import LARGER_MESH, solve_at
from roughslip.contact.edge import contact_shares
from roughslip.contact.influence import gathered
from roughslip.grid import Grid
from tests.contact.closed_forms import HERTZ_PEAK, SineWave


def spheres(radius, shifts, seed, hardness=math.inf, room=1.0):
    """Pressures under spheres of a contact radius [cells] at random places, one after another."""
    n = 2 * math.ceil(radius * room) + 7
    influence, generator = Influence(Grid(n, n, 1.0, 1.0), 1.0), np.random.default_rng(seed)
    for _ in range(shifts):
        x, y = (np.arange(n) - n // 2 + shift for shift in generator.random(2) - 0.5)
        interference = 1 - (x[:, None] ** 2 + y**2) / (2 * radius**2)  # Hertz: a^2 = R d = radius^2 / 2 * 2
        yield solve(influence, interference, 1e-8, hardness_pa=hardness / radius).pressure


def areas_of_spheres(radius, shifts, seed, hardness=math.inf, room=1.0):
    """(shifts, 2) areas of nodes and of shares [cells]."""
    pressed = spheres(radius, shifts, seed, hardness, room)
    return np.array([(np.count_nonzero(p), contact_shares(p, hardness / radius).sum()) for p in pressed])


@pytest.mark.parametrize(("radius", "shifts", "limit"), [(0.4, 400, 0.05), (1.0, 200, 0.03), (4.0, 60, 0.015)])
def test_area_of_hertz_contacts(radius, shifts, limit):
    """The mean over places is the Hertz area, from single cells on; the limit is 1 % and three standard errors.

    The standard error of the mean follows from the scatter over places.
    """
    areas = areas_of_spheres(radius, shifts, 1) / (math.pi * radius**2)
    error = areas[:, 1].std() / math.sqrt(shifts)
    assert error < limit
    assert areas[:, 1].mean() == pytest.approx(1, abs=0.01 + 3 * error)
    assert areas[:, 0].mean() > 1.05


def test_rolled_along_a_period_the_shares_roll():
    """Cells of a period have no first and no last; of a free mesh they have."""
    pressure = np.maximum(np.random.default_rng(5).standard_normal((12, 9)), 0.0)
    for around in (True, False):
        shares = contact_shares(pressure, 2.0, around)
        for axis in (0, 1):
            rolled = contact_shares(np.roll(pressure, 4, axis), 2.0, around)
            assert np.array_equal(rolled, np.roll(shares, 4, axis)) == around


def test_a_solution_knows_its_period():
    """A crest on the corner of a cell, of 25 nodes in four parts, has the shares of one in the middle, to rounding."""
    r2 = ((np.arange(24) - 12) ** 2)[:, None] + (np.arange(24) - 12) ** 2
    influence = Influence(Grid(24, 24, 1.0, 1.0), 1.0, periodic=True)
    middle, corner = (solve_load(influence, np.roll(-r2 / 50.0, shift, (0, 1)), 0.01).shares for shift in (0, 12))
    np.testing.assert_array_equal(corner, np.roll(middle, 12, (0, 1)))


def test_yielded_contact_is_the_area_above_the_plane():
    """A contact that yields nearly everywhere bears on the area above the plane, 2 pi radius^2: no edge is taken off.

    With H = 0.01 E* d / R the elastic displacement is of the order of H / E* of the radius.
    """
    areas = areas_of_spheres(3.0, 60, 4, hardness=0.01, room=1.5) / (2 * math.pi * 9)
    np.testing.assert_allclose(areas.mean(axis=0), 1, atol=0.015)


LEVELS = np.linspace(0.0, 0.9, 10)  # over the peak pressure


def exceeded(pressure: np.ndarray) -> np.ndarray:
    """Shares (2, levels) of nodes whose pressure is above the levels: of cells, and of points."""
    everywhere = tuple(part.ravel() for part in np.indices(pressure.shape))
    both = np.stack([pressure.ravel(), point_pressures(pressure, everywhere)])
    return np.mean(both[:, :, None] > LEVELS, axis=1)


def test_distribution_under_spheres():
    """At six cells a radius points have a tenth of the error of cells in contact, and a third in the distribution.

    p > t p0 on a share 1 - t^2 of the contact. Over 300 places that share has a standard error of 0.002, below a
    twelfth of the errors of cells.
    """
    found = [exceeded(pressure / (HERTZ_PEAK / 6.0)) * pressure.size for pressure in spheres(6.0, 300, 1)]
    cells, points = np.abs(np.mean(found, axis=0) / (math.pi * 6.0**2) - (1 - LEVELS**2))
    assert cells[0] > 0.03
    assert points[0] < 0.2 * cells[0]
    assert points.max() < 0.4 * cells.max()


@pytest.mark.parametrize("load", [0.3, 0.5, 0.8])
def test_distribution_on_a_sine_wave(load):
    """Edges exactly along the mesh, 32 cells a wave, every place of the edge in 64 steps: a tenth and a third are left.

    A step of the mesh moves a share by 2 / (64 x 32) = 0.001. With the peak p_0 = 2 p* sqrt(s), the pressure is above
    t p_0 on |x| < b_t, where s - sin^2(pi x / l) = (t^2 s) / (1 - sin^2(pi x / l)) (Johnson, section 13.2).
    """
    cells, steps, wave = 32, 64, SineWave(2e-7, 3e-5, load, 7e10)
    grid = Grid(cells, 1, wave.wavelength / cells, wave.wavelength / cells)
    influence, found = Influence(grid, wave.modulus, periodic=True), np.zeros((2, len(LEVELS)))
    for step in range(steps):
        x = grid.x() - wave.wavelength / 2 - (step + 0.5) / steps * grid.dx
        pressure = solve_load(influence, wave.heights(x)[:, None], wave.mean_pressure, 1e-10).pressure
        found += exceeded(pressure / wave.pressure(np.zeros(1))[0]) / steps
    root = (1 + load - np.sqrt((1 - load) ** 2 + 4 * load * LEVELS**2)) / 2  # sin^2(pi b_t / l)
    error = np.abs(found - 2 / math.pi * np.arcsin(np.sqrt(root)))
    assert wave.area_fraction == pytest.approx(2 / math.pi * math.asin(math.sqrt(root[0])))
    assert error[0, 0] > 0.008
    assert error[1, 0] < 0.1 * error[0, 0] + 0.001
    assert error[1].max() < 0.35 * error[0].max() + 0.001


def test_what_is_no_edge_keeps_its_pressure():
    """Out of contact, inside a full contact, and a lone cell, whose neighbours say nothing of its edge."""
    everywhere = tuple(part.ravel() for part in np.indices((7, 7)))
    lone = np.zeros((7, 7))
    lone[3, 3] = 2.0
    np.testing.assert_array_equal(point_pressures(lone, everywhere), lone.ravel())
    np.testing.assert_array_equal(point_pressures(np.full((7, 7), 3.0), everywhere), 3.0)
    assert not point_pressures(np.zeros((7, 7)), everywhere).any()


def test_a_straight_edge_along_the_mesh():
    """p^2 falls by 1 a cell to 0.25 at the last: s = 0.25 of a cell, 0.313 by the table.

    Further in the root is followed to 2 %, from 1.6 cells on the node keeps its pressure.
    """
    pressure = np.zeros((9, 5))
    pressure[3:] = np.sqrt(0.25 + np.arange(6))[:, None]
    found = point_pressures(pressure, (np.arange(9), np.full(9, 2)))
    np.testing.assert_allclose(found[3], math.sqrt(0.313), rtol=1e-12)
    np.testing.assert_array_equal(found[:3], 0.0)
    np.testing.assert_allclose(found[4:6], pressure[4:6, 2], rtol=0.02)
    np.testing.assert_array_equal(found[6:], pressure[6:, 2])


CENTRE = (np.array([32, 32, 31, 31]), np.array([32, 31, 32, 31]))


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
def test_pressures_lie_within_their_bounds(surface, plane, hardness):
    """Against full solves: the same nodes in contact, pressures within bounds that are as narrow as asked. To a loose
    tolerance the gap is that of the steps, in single precision."""
    influence = Influence(Grid(64, 64, 1.0, 1.0), 1.0)
    methods = set()
    for seed, tolerance in itertools.product(range(6), (1e-10, 1e-4)):
        interference = surface((64, 64), 6.4, seed) - plane
        full = solve(influence, interference, 1e-10, hardness_pa=hardness)
        found = solve_at(influence, interference[None], CENTRE, 1e-3, tolerance, hardness_pa=hardness)
        true, slack = full.pressure[CENTRE], (1e-9 if tolerance == 1e-10 else 1e-5) * full.pressure.max()
        np.testing.assert_array_equal(found.pressure[0] > 0, true > 0)
        assert np.all((found.low[0] - slack <= true) & (true <= found.high[0] + slack))
        by_residual = tolerance == 1e-4 and found.method[0] == "fft"  # the loose tolerance came before the precision
        assert by_residual or np.all(np.abs(found.pressure[0] - true) <= 1.1e-3 * true)
        assert found.work[0] <= full.work
        methods.update(found.method)
    assert methods & {"bounded", "dense"}


@pytest.mark.parametrize("plane", [0.0, 1.0])
def test_pressures_without_the_mesh_error_are_those_of_full_solves(surface, plane):
    """At nodes whose neighbour is out of contact, within the 1e-3 of the bounds, of the largest."""
    influence = Influence(Grid(64, 64, 1.0, 1.0), 1.0)
    for seed in range(5):
        interference = surface((64, 64), 6.4, seed) - plane
        full = solve(influence, interference, 1e-10).pressure
        edge = (full[1:-1, 1:-1] > 0) & (full[2:, 1:-1] == 0)
        nodes = tuple(1 + np.argwhere(edge)[:: max(1, np.count_nonzero(edge) // 4)].T)
        found = solve_at(influence, interference[None], nodes, 1e-3, 1e-10, points=True)
        assert np.all(found.low > 0)
        expected = point_pressures(full, nodes)
        np.testing.assert_allclose(found.pressure[0], expected, rtol=0, atol=1e-3 * expected.max())
        assert np.abs(found.pressure[0] - full[nodes]).max() > 0.02 * expected.max()


def test_bounds_save_most_of_the_work(surface):
    """Of 15 surfaces at the median, the centre takes less than 0.6 of the products of full solves at 1e-6."""
    influence = Influence(Grid(64, 64, 1.0, 1.0), 1.0)
    surfaces = np.array([surface((64, 64), 6.4, seed) for seed in range(15)])
    full = sum(solve(influence, each, 1e-6).work for each in surfaces)
    assert solve_at(influence, surfaces, CENTRE, tolerance=1e-6).work.sum() < 0.6 * full
