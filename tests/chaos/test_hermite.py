"""The basis: which terms, in which order, and their orthonormality under independent standard normals."""

import math
from itertools import product

import numpy as np
import pytest
from numpy.polynomial.hermite_e import hermegauss, hermeval
from numpy.polynomial.legendre import leggauss
from scipy.stats import norm

from roughslip.chaos.hermite import even_terms, hermite_basis, hermite_polynomials, multi_indices
from roughslip.errors import ParameterError


@pytest.mark.parametrize(("variables", "degree"), [(8, 3), (1, 0), (1, 7), (5, 0), (3, 4), (101, 1)])
def test_terms_are_all_exponents_up_to_the_degree(variables, degree):
    """Ordered by total degree and then by high powers of early variables, so that lower degrees lead."""
    indices = multi_indices(variables, degree)
    assert indices.shape == (math.comb(variables + degree, degree), variables)
    assert indices.dtype == np.int64
    assert len(np.unique(indices, axis=0)) == len(indices)
    assert indices.min() == 0
    assert indices.sum(axis=1).max() == degree
    rows = indices.tolist()
    assert rows == sorted(rows, key=lambda row: (sum(row), [-a for a in row]))


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


@pytest.mark.parametrize("a", [-1.5, 0.0, 0.7])
def test_the_positive_part_of_a_normal_has_its_closed_form_coefficients(a):
    """(a + xi)^+: c_0 = a Phi(a) + phi(a), c_1 = Phi(a), and c_n sqrt(n!) = He_(n-2)(-a) phi(a) for n >= 2.

    Gauss-Legendre on (-a, -a + 40) is exact but for rounding: the integrand is entire there and e^-800 beyond.
    """
    nodes, weights = leggauss(400)
    half = 20.0
    xi = -a + half * (nodes + 1)
    found = hermite_polynomials(xi, 12) @ (half * weights * norm.pdf(xi) * (a + xi))
    expected = [a * norm.cdf(a) + norm.pdf(a), norm.cdf(a)]
    lower = hermite_polynomials(np.array(-a), 10)
    expected += [
        norm.pdf(a) * lower[n - 2] * math.sqrt(math.factorial(n - 2) / math.factorial(n)) for n in range(2, 13)
    ]
    np.testing.assert_allclose(found, expected, atol=1e-14)


def test_even_terms_keep_their_value_under_every_symmetry_and_the_others_do_not():
    """A symmetry that changes the sign of two of eight variables keeps the C(9, 3) = 84 cubics in the other six. It
    also keeps the three products of two of the two, with 1 or one of the six."""
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


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: multi_indices(0, 3), "at least"),
        (lambda: multi_indices(8, -1), "at least"),
        (lambda: multi_indices(2, 2.5), "whole number"),
        (lambda: multi_indices(500, 15), "lower the degree"),  # before the terms are listed
        (lambda: hermite_basis(np.zeros((4, 3)), multi_indices(2, 2)), "2 variables"),
        (lambda: hermite_basis(np.zeros(2), multi_indices(2, 2)), "2 variables"),
        (lambda: hermite_basis(np.array([[np.inf, np.nan]]), multi_indices(2, 2)), "finite"),
        (lambda: even_terms(multi_indices(3, 2), np.zeros((2, 1))), "each of 3 variables"),
    ],
)
def test_impossible_bases_and_samples_are_refused(call, message):
    with pytest.raises(ParameterError, match=message):
        call()
