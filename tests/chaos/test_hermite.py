"""The basis: which terms, in which order, and their orthonormality under independent standard normals."""

import math
from itertools import product

import numpy as np
import pytest
from numpy.polynomial.hermite_e import hermegauss, hermeval

from roughslip.chaos.basis import hermite_polynomials
from roughslip.chaos.hermite import hermite_basis
from roughslip.chaos.indices import multi_indices
from roughslip.errors import ParameterError


@pytest.mark.parametrize(("variables", "degree"), [(8, 3), (1, 0), (1, 7), (5, 0), (3, 4), (101, 1)])
def test_terms_are_all_exponents_up_to_the_degree(variables, degree):
    indices = multi_indices(variables, degree)
    assert len(indices) == math.comb(variables + degree, degree)
    assert len(np.unique(indices, axis=0)) == len(indices)
    assert indices.min() == 0
    assert indices.sum(axis=1).max() == degree


def test_the_paper_has_165_terms():
    assert multi_indices(8, 3).shape == (165, 8)


def test_lower_degrees_lead():
    indices = multi_indices(4, 3)
    assert np.array_equal(indices.sum(axis=1), np.repeat([0, 1, 2, 3], [1, 4, 10, 20]))
    assert np.array_equal(indices[1:5], np.eye(4))
    assert np.array_equal(indices[:15], multi_indices(4, 2))


def test_basis_is_orthonormal():
    """Products of two terms have degree 6 in a variable at most, for which 4 Gauss points are exact. Rounding: sums of
    64 terms up to 10."""
    points, weights = hermegauss(4)
    xi = np.array(list(product(points, repeat=3)))
    weight = np.prod(list(product(weights / math.sqrt(2 * math.pi), repeat=3)), axis=1)
    basis = hermite_basis(xi, multi_indices(3, 3))
    np.testing.assert_allclose(basis.T @ (weight[:, None] * basis), np.eye(20), atol=1e-13)


def test_polynomials_are_normalised_hermite_polynomials():
    """The reference evaluates the same polynomial by Clenshaw's recurrence; both lose a few digits to cancellation."""
    x = np.linspace(-4, 4, 41)
    values = hermite_polynomials(x, 10)
    for n in range(11):
        reference = hermeval(x, np.eye(11)[n]) / math.sqrt(math.factorial(n))
        np.testing.assert_allclose(values[n], reference, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(values[3], (x**3 - 3 * x) / math.sqrt(6), rtol=1e-13, atol=1e-13)


def test_a_term_is_the_product_of_its_polynomials():
    xi = np.random.default_rng(1).standard_normal((7, 3))
    indices = multi_indices(3, 4)
    values = hermite_polynomials(xi, 4)
    for term, exponents in zip(hermite_basis(xi, indices).T, indices, strict=True):
        expected = np.prod([values[e, :, v] for v, e in enumerate(exponents)], axis=0)
        np.testing.assert_allclose(term, expected, rtol=1e-15)  # the same factors, ones among them


def test_a_sample_does_not_depend_on_the_others():
    xi, indices = np.random.default_rng(2).standard_normal((50, 8)), multi_indices(8, 3)
    together = hermite_basis(xi, indices)
    assert np.array_equal(together[17:18], hermite_basis(xi[17:18], indices))


@pytest.mark.parametrize(("variables", "degree"), [(0, 3), (8, -1)])
def test_impossible_bases_are_refused(variables, degree):
    with pytest.raises(ParameterError, match="must be at least"):
        multi_indices(variables, degree)


@pytest.mark.parametrize("xi", [np.zeros((4, 3)), np.zeros(2), np.array([[0.0, np.nan]]), np.array([[np.inf, 0.0]])])
def test_samples_that_do_not_fit_are_refused(xi):
    with pytest.raises(ParameterError):
        hermite_basis(xi, multi_indices(2, 2))
