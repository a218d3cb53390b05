"""Contact area from the shares of cells at the edge of a contact."""

import math

import numpy as np
import pytest

from roughslip.contact import Influence, solve, solve_load
from roughslip.contact.edge import contact_shares
from roughslip.grid import Grid


def areas_of_spheres(radius, shifts, seed, hardness=math.inf, room=1.0):
    """(shifts, 2) areas of nodes and of shares [cells], spheres of contact radius [cells] at random places."""
    n = 2 * math.ceil(radius * room) + 7
    influence = Influence(Grid(n, n, 1.0, 1.0), 1.0)
    generator, areas = np.random.default_rng(seed), []
    for _ in range(shifts):
        x, y = (np.arange(n) - n // 2 + shift for shift in generator.random(2) - 0.5)
        interference = 1 - (x[:, None] ** 2 + y**2) / (2 * radius**2)  # Hertz: a^2 = R d = radius^2 / 2 * 2
        pressure = solve(influence, interference, 1e-8, hardness_pa=hardness / radius).pressure
        areas.append((np.count_nonzero(pressure), contact_shares(pressure, hardness / radius).sum()))
    return np.array(areas)


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


@pytest.mark.slow
def test_order_of_the_area():
    """The excess of nodes falls with the cell; that of the shares is below a tenth of it from two cells a radius on."""
    radii, found = (2.0, 4.0, 8.0, 16.0), []
    for radius, shifts in zip(radii, (400, 200, 100, 50), strict=True):
        found.append(areas_of_spheres(radius, shifts, 2).mean(axis=0) / (math.pi * radius**2) - 1)
    nodes, shares = np.array(found).T
    order = -np.polyfit(np.log(radii), np.log(nodes), 1)[0]
    assert order == pytest.approx(1, abs=0.15)
    assert np.all(np.abs(shares) < 0.1 * nodes)


def test_full_contact_and_single_cells():
    """Cells beyond the mesh are no gap: full contact is whole. A lone cell and a pair have the tabled shares."""
    np.testing.assert_array_equal(contact_shares(np.ones((5, 4))), 1.0)
    pressure = np.zeros((7, 7))
    pressure[1, 1] = pressure[4, 4] = pressure[4, 5] = 1.0
    shares = contact_shares(pressure)
    assert shares[1, 1] == 0.498
    assert shares[4, 4] == shares[4, 5] == 0.647
    assert np.count_nonzero(shares) == 3


def test_mirrors_and_turns_of_a_contact():
    """Shares follow the mirror images and the transpose of a contact."""
    pressure = np.maximum(np.random.default_rng(3).standard_normal((12, 9)), 0.0)
    shares = contact_shares(pressure)
    np.testing.assert_array_equal(contact_shares(pressure[::-1]), shares[::-1])
    np.testing.assert_array_equal(contact_shares(np.ascontiguousarray(pressure.T)), shares.T)


@pytest.mark.parametrize("around", [(True, True), (True, False), (False, True)])
def test_rolled_along_a_period_the_shares_roll(around):
    """Cells of a period have no first and no last; across a free side they have. `around` in the order x, y."""
    pressure = np.maximum(np.random.default_rng(5).standard_normal((12, 9)), 0.0)
    shares = contact_shares(pressure, 2.0, around)
    for axis in (0, 1):
        rolled = contact_shares(np.roll(pressure, 4, axis), 2.0, around)
        assert np.array_equal(rolled, np.roll(shares, 4, axis)) == around[axis]
    np.testing.assert_array_equal(contact_shares(np.ascontiguousarray(pressure.T), 2.0, around[::-1]), shares.T)
    alone = contact_shares(pressure, 2.0)
    assert shares.sum() < alone.sum()
    np.testing.assert_array_equal(shares[1:-1, 1:-1], alone[1:-1, 1:-1])


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
