"""Bases of mixed variables: orthonormality, closed forms, and points that do not belong to them."""

import math
from itertools import product

import numpy as np
import pytest
from numpy.polynomial.hermite_e import hermegauss
from numpy.polynomial.legendre import leggauss, legval
from scipy.stats import norm

from roughslip.chaos.basis import Basis, hermite_polynomials, legendre_polynomials, truncated
from roughslip.chaos.indices import multi_indices
from roughslip.errors import ParameterError

MIXED = ("legendre", "hermite", "legendre")


def test_mixed_terms_are_orthonormal():
    """Five Gauss points are exact to degree 9, two terms have 8 in a variable. Rounding: sums of 125 terms."""
    rules = {"legendre": leggauss(5), "hermite": hermegauss(5)}
    points = np.array(list(product(*(rules[family][0] for family in MIXED))))
    weights = np.prod(list(product(*(rules[f][1] / rules[f][1].sum() for f in MIXED))), axis=1)
    values = truncated(MIXED, 4)(points)
    np.testing.assert_allclose(values.T @ (weights[:, None] * values), np.eye(35), atol=1e-13)


def test_legendre_polynomials_are_normalised():
    """Against Clenshaw's recurrence; at the ends P_n(1) = 1 and P_n(-1) = (-1)^n."""
    x = np.linspace(-1, 1, 41)
    values = legendre_polynomials(x, 15)
    for n in range(16):
        reference = math.sqrt(2 * n + 1) * legval(x, np.eye(16)[n])
        np.testing.assert_allclose(values[n], reference, rtol=1e-13, atol=1e-13)
        assert values[n, -1] == pytest.approx(math.sqrt(2 * n + 1), rel=1e-14)
    np.testing.assert_allclose(values[2], math.sqrt(5) * (3 * x**2 - 1) / 2, atol=1e-14)


def test_a_term_is_the_product_of_its_families():
    points = np.random.default_rng(1).uniform(-1, 1, (6, 3))
    one = {"legendre": legendre_polynomials, "hermite": hermite_polynomials}
    basis = truncated(MIXED, 4, norm=0.8)
    for term, exponents in zip(basis(points).T, basis.indices, strict=True):
        factors = [one[f](points[:, v], 4)[e] for v, (f, e) in enumerate(zip(MIXED, exponents, strict=True))]
        np.testing.assert_allclose(term, np.prod(factors, axis=0), rtol=1e-14)


def test_a_subset_keeps_its_columns():
    points = np.random.default_rng(2).uniform(-1, 1, (6, 3))
    basis = truncated(MIXED, 3)
    chosen = np.array([7, 0, 12])
    assert np.array_equal(basis.subset(chosen)(points), basis(points)[:, chosen])


def test_a_large_basis_of_many_variables():
    """500 variables, 1501 terms: powers alone, so that every column is one polynomial of one variable."""
    points = np.random.default_rng(3).standard_normal((20, 500))
    basis = truncated(("hermite",) * 500, 3, interaction=1)
    values = basis(points)
    assert values.shape == (20, 1501)
    assert np.array_equal(values[:, 1:501], points)
    assert np.array_equal(values[:, 1001:], hermite_polynomials(points, 3)[3])


@pytest.mark.parametrize("a", [-1.5, 0.0, 0.7])
def test_the_positive_part_of_a_normal_has_its_closed_form_coefficients(a):
    """(a + xi)^+: c_0 = a Phi(a) + phi(a), c_1 = Phi(a), and from its second derivative, a delta at -a, c_n sqrt(n!) =
    He_(n-2)(-a) phi(a). Gauss-Legendre on (-a, -a + 40) is exact but for rounding: the integrand is entire there and
    e^-800 beyond."""
    nodes, weights = leggauss(400)
    half = 20.0
    xi = -a + half * (nodes + 1)
    values = hermite_polynomials(xi, 12)
    found = values @ (half * weights * norm.pdf(xi) * (a + xi))
    expected = [a * norm.cdf(a) + norm.pdf(a), norm.cdf(a)]
    lower = hermite_polynomials(np.array(-a), 10)
    expected += [
        norm.pdf(a) * lower[n - 2] * math.sqrt(math.factorial(n - 2) / math.factorial(n)) for n in range(2, 13)
    ]
    np.testing.assert_allclose(found, expected, atol=1e-14)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.zeros((4, 2)), "table of 3 variables"),
        (np.zeros(3), "table of 3 variables"),
        (np.array([[0.0, np.nan, 0.0]]), "finite"),
        (np.array([[1.0 + 1e-12, 0.0, 0.0]]), r"\[-1, 1\]"),
    ],
)
def test_points_that_do_not_belong_to_the_basis_are_refused(points, message):
    with pytest.raises(ParameterError, match=message):
        truncated(MIXED, 2)(points)


def test_a_normal_variable_has_no_bounds():
    assert truncated(("hermite",), 1)(np.array([[7.5]]))[0, 1] == 7.5


@pytest.mark.parametrize("families", [("hermite",), ("hermite", "laguerre")])
def test_families_that_do_not_fit_are_refused(families):
    with pytest.raises(ParameterError):
        Basis(multi_indices(2, 2), families)
