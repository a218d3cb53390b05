"""Truncated sets of terms: against lists by definition, their order, and what they refuse."""

import math
from itertools import product

import numpy as np
import pytest

from roughslip.chaos import indices
from roughslip.chaos.indices import even_terms, multi_indices
from roughslip.errors import ParameterError


@pytest.mark.parametrize("norm", [1.0, 0.75, 0.5, 0.2])
@pytest.mark.parametrize("interaction", [None, 1, 2])
@pytest.mark.parametrize(("variables", "degree"), [(3, 4), (2, 9), (4, 4), (1, 6), (3, 0)])
def test_the_set_is_that_of_the_definition(variables, degree, norm, interaction):
    """Of all exponents, those of the norm and the order. x y with q = 1/2 has norm 4: on the edge of degree 4."""
    found = multi_indices(variables, degree, norm=norm, interaction=interaction)
    most = variables if interaction is None else interaction
    expected = {
        alpha
        for alpha in product(range(degree + 1), repeat=variables)
        if sum(a**norm for a in alpha) ** (1 / norm) <= degree + 1e-9 and sum(a > 0 for a in alpha) <= most
    }
    assert len(found) == len(expected)
    assert {tuple(row) for row in found.tolist()} == expected


def test_terms_on_the_edge_of_the_norm_are_in():
    assert [1, 1] in multi_indices(2, 4, norm=0.5).tolist()
    assert [1, 1] not in multi_indices(2, 3, norm=0.5).tolist()
    assert 64 ** (1 / 3) < 4  # rounded, and yet 2 + 2 belongs
    assert [8, 8] in multi_indices(2, 64, norm=1 / 3).tolist()


def test_terms_come_by_total_degree_and_high_powers_of_early_variables_first():
    rows = multi_indices(3, 3, norm=0.8, interaction=2).tolist()
    assert rows == sorted(rows, key=lambda row: (sum(row), [-a for a in row]))
    assert rows[0] == [0, 0, 0]


def test_nothing_is_listed_that_is_dropped(monkeypatch):
    """500 variables have 21 084 251 terms of degree 3, of which 1501 are powers: the tree must not see the others."""
    visits = []
    grow = indices._grow
    monkeypatch.setattr(indices, "_grow", lambda *state: (visits.append(state[0]), grow(*state))[1])
    assert multi_indices(500, 3, interaction=1).shape == (1501, 500)
    assert len(visits) == 1501
    visits.clear()
    assert multi_indices(500, 3, norm=0.5).shape == (1501, 500)
    assert len(visits) == 1501


@pytest.mark.parametrize(("variables", "degree"), [(500, 2), (500, 15), (20, 15), (2, 1000)])
def test_sets_too_large_are_refused_before_they_are_listed(variables, degree):
    assert math.comb(variables + degree, degree) > indices.MOST_TERMS
    with pytest.raises(ParameterError, match="lower the degree, the norm or the interaction order"):
        multi_indices(variables, degree)


def test_the_largest_set_is_allowed(monkeypatch):
    monkeypatch.setattr(indices, "MOST_TERMS", 35)
    assert len(multi_indices(3, 4)) == 35
    monkeypatch.setattr(indices, "MOST_TERMS", 34)
    with pytest.raises(ParameterError, match="more than 34 terms"):
        multi_indices(3, 4)


@pytest.mark.parametrize(
    "wrong", [{"norm": 0.0}, {"norm": 1.1}, {"norm": math.nan}, {"interaction": 0}, {"degree": -1}, {"variables": 0}]
)
def test_impossible_truncations_are_refused(wrong):
    with pytest.raises(ParameterError):
        multi_indices(**{"variables": 2, "degree": 2} | wrong)


def test_exponents_are_integers():
    assert multi_indices(2, 2).dtype == np.int64


def test_even_terms_keep_their_value_under_every_symmetry_and_the_others_do_not():
    """Of one symmetry that turns two of eight variables: the C(9, 3) = 84 cubics in the other six, and the three
    products of two of the two with 1 or one of the six."""
    odd = np.array([[0, 0], [1, 0], [0, 1], [0, 0], [0, 0], [1, 1], [0, 0], [0, 0]])
    complete = multi_indices(8, 3)
    assert len(even_terms(complete, odd[:, :1])) == 84 + 3 * 7
    kept = {tuple(term) for term in even_terms(complete, odd)}
    points = np.random.default_rng(2).standard_normal((4, 8))
    for term in complete:
        values = [np.prod((points * signs) ** term, axis=1) for signs in (-1.0) ** odd.T]
        same = all(np.allclose(value, np.prod(points**term, axis=1)) for value in values)
        assert same == (tuple(term) in kept)
    assert len(even_terms(complete, odd[:, :0])) == 165


def test_signs_of_other_variables_are_refused():
    with pytest.raises(ParameterError, match="each of 3 variables"):
        even_terms(multi_indices(3, 2), np.zeros((2, 1)))
