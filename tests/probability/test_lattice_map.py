"""A probability on a lattice from few of its nodes: exact there, near between, and nothing is left to chance."""

import itertools

import numpy as np
import pytest
from scipy.special import ndtr

from roughslip.errors import ParameterError
from roughslip.probability.lattice_map import START, lattice_map

POINTS = 33


def band(i, j):
    """A band of chance that widens along a curve, as that of stick-slip does."""
    x, y = i / (POINTS - 1), j / (POINTS - 1)
    return float(ndtr((1.1 - x - 0.7 * y**2) / (0.01 + 0.05 * y)))


EVERY = np.array([[band(i, j) for j in range(POINTS)] for i in range(POINTS)])


def bilinear(every, points):
    """The map of a full lattice of fewer points, by straight lines between them."""
    at = np.arange(0, POINTS, (POINTS - 1) // (points - 1))
    whole = np.arange(POINTS)
    columns = np.array([np.interp(whole, at, row) for row in every[np.ix_(at, at)].T]).T
    return np.array([np.interp(whole, at, row) for row in columns])


def test_a_seventh_of_the_nodes_errs_less_than_a_full_lattice():
    """17 x 17 nodes and straight lines between them, against a seventh and a fifth of so many."""
    full = np.abs(bilinear(EVERY, 17) - EVERY).mean()
    for computed, share in ((40, 0.7), (56, 0.5)):
        found = lattice_map(band, POINTS, computed)
        assert found.is_computed.sum() == computed
        assert np.abs(found.probability - EVERY).mean() < share * full


def test_the_map_is_the_full_lattice_where_both_have_points():
    found = lattice_map(band, POINTS, 40)
    np.testing.assert_array_equal(found.probability[found.is_computed], EVERY[found.is_computed])
    whole = lattice_map(lambda i, j: EVERY[i, j], 5, 25)
    np.testing.assert_array_equal(whole.probability, EVERY[:5, :5])


def test_the_error_of_the_spline_is_that_at_the_last_third_of_the_nodes_added():
    """Of three nodes the last two, each as the map without it has it."""
    maps = [lattice_map(band, POINTS, START**2 + added) for added in (1, 2, 3)]
    errors = []
    for before, after in itertools.pairwise(maps):
        (node,) = np.argwhere(after.is_computed & ~before.is_computed)
        errors.append(abs(band(*node) - before.probability[tuple(node)]))
    assert maps[-1].prediction_error == pytest.approx(np.mean(errors), rel=1e-9)
    assert lattice_map(band, POINTS, START**2).prediction_error == 0.0


def test_each_node_is_asked_for_once_and_most_are_in_the_band():
    """Of the nodes added, three in five lie where the probability is neither 0 nor 1 to 2 %; of all, one in three."""
    asked = []
    lattice_map(lambda i, j: (asked.append((i, j)), band(i, j))[1], POINTS, 56)
    assert len(set(asked)) == len(asked) == 56
    inside = (EVERY > 0.02) & (EVERY < 0.98)
    assert inside.mean() < 0.33
    assert np.mean([inside[one] for one in asked[START**2 :]]) > 0.6


def test_a_probability_that_does_not_change_is_found_everywhere():
    for value in (0.0, 1.0, 0.3):
        found = lattice_map(lambda i, j, value=value: value, 9, 20)
        np.testing.assert_allclose(found.probability, value, atol=1e-9)
        assert found.prediction_error < 1e-9


@pytest.mark.parametrize(("points", "computed"), [(3, 9), (9, 15), (9, 82)])
def test_numbers_of_nodes_out_of_range_are_refused(points, computed):
    with pytest.raises(ParameterError, match="a map of"):
        lattice_map(band, points, computed)
