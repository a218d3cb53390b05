"""The cheapest acceptable change against closed forms: roots, corners of the cost, and tangents of the boundary."""

import numpy as np
import pytest

from roughslip.errors import ParameterError
from roughslip.probability.cheapest import ACCURACY, cheapest_change, rays

WIDE = np.array([2.0, 2.0])


def test_of_one_parameter_it_is_the_root():
    direction, cost = cheapest_change(lambda u: u[0] <= -0.7, np.array([2.0]), np.array([-3.0]), np.array([1.0]))
    assert direction[0] * cost == pytest.approx(-0.7, abs=ACCURACY * 3.0)
    assert cost == pytest.approx(1.4, abs=2 * ACCURACY * 3.0)


@pytest.mark.parametrize(("weights", "change"), [([1.0, 3.0], [0.6, 0.0]), ([3.0, 1.0], [0.0, 0.6])])
def test_behind_a_straight_boundary_only_the_cheaper_parameter_changes(weights, change):
    """The cost is linear, and so least at a corner."""
    direction, cost = cheapest_change(lambda u: u.sum() >= 0.6, np.array(weights), -WIDE, WIDE)
    np.testing.assert_allclose(direction * cost, change, atol=0.01)


def test_behind_a_hyperbola_the_parameters_share_the_cost():
    """u v >= 1/4 with weights 1 and 2: w_1 u = w_2 v by Lagrange, so u = 1/sqrt(2), v = 1/(2 sqrt(2)), cost sqrt(2)."""
    direction, cost = cheapest_change(lambda u: u[0] > 0 and u[0] * u[1] >= 0.25, np.array([1.0, 2.0]), -WIDE, WIDE)
    assert cost == pytest.approx(np.sqrt(2.0), abs=0.01)
    np.testing.assert_allclose(direction * cost, [np.sqrt(0.5), np.sqrt(0.125)], atol=0.05)


def test_of_three_parameters_two_may_change():
    """u + v + w >= 1 and w at most 0.2 from its range; v does nothing at a weight of 5."""
    low, high = np.full(3, -2.0), np.array([0.4, 2.0, 0.2])
    found = cheapest_change(lambda u: u.sum() >= 1.0, np.array([1.0, 5.0, 1.0]), low, high)
    change = found[0] * found[1]
    assert change.sum() == pytest.approx(1.0, abs=0.02)
    assert found[1] == pytest.approx(0.4 + 0.2 + 5 * 0.4, rel=0.1)


def test_nothing_to_change_and_nothing_within_the_ranges():
    assert cheapest_change(lambda u: True, np.ones(2), -WIDE, WIDE)[1] == 0.0
    assert cheapest_change(lambda u: u[0] > 5.0, np.ones(2), -WIDE, WIDE) is None


def test_the_first_rays_are_all_of_their_division_and_change_few_parameters_first():
    """4 n rays of two parameters, 4 n^2 + 2 of three."""
    assert len(rays(2, 8)) == 32
    assert len(rays(3, 4)) == 66
    assert [sum(part != 0 for part in ray) for ray in rays(3, 4)[:7]] == [1] * 6 + [2]


def test_ranges_without_the_present_values_are_refused():
    for weights, low in (([1.0, -1.0], -WIDE), ([1.0, 1.0], 0.1 * WIDE), ([1.0] * 4, np.full(4, -1.0))):
        with pytest.raises(ParameterError, match="one to three parameters"):
            cheapest_change(lambda u: True, np.array(weights), low, np.full(len(weights), 2.0))
