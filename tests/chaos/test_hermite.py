"""The basis: which terms, in which order, their orthonormality under standard normals, and Sobol' indices."""

import math
from itertools import product

import numpy as np
import pytest
from numpy.polynomial.hermite_e import hermegauss, hermeval
from scipy.special import ndtri

from roughslip.chaos.hermite import (
    HermiteBasis,
    even_terms,
    hermite_basis,
    hermite_polynomials,
    multi_indices,
    sobol_indices,
)
from roughslip.chaos.regression import least_squares
from roughslip.errors import IllPosedError, InaccurateWarning, ParameterError


@pytest.mark.parametrize(("variables", "degree"), [(8, 3), (1, 0), (1, 7), (5, 0), (3, 4), (101, 1)])
def test_terms_are_all_exponents_up_to_the_degree(variables, degree, monkeypatch):
    """Ordered by total degree and then by high powers of early variables, so that lower degrees lead. As many as are
    allowed are."""
    monkeypatch.setattr("roughslip.chaos.hermite.MOST_TERMS", math.comb(variables + degree, degree))
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
    # terms of several variables start from earlier ones, here from the first of all, which is no constant
    np.testing.assert_allclose(hermite_basis(xi, multi_indices(3, 3)[1:]), basis[:, 1:], rtol=1e-14)


def test_polynomials_are_normalised_hermite_polynomials():
    """The reference evaluates the same polynomial by Clenshaw's recurrence; both lose a few digits to cancellation."""
    x = np.linspace(-4, 4, 41)
    values = hermite_polynomials(x, 10)
    for n in range(11):
        reference = hermeval(x, np.eye(11)[n]) / math.sqrt(math.factorial(n))
        np.testing.assert_allclose(values[n], reference, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(values[3], (x**3 - 3 * x) / math.sqrt(6), rtol=1e-13, atol=1e-13)


def test_sums_are_those_of_all_terms():
    """Terms are added four at a time: 4, 5, 6 and 7 of them leave 0 to 3. More points than a block."""
    rng = np.random.default_rng(8)
    points = rng.standard_normal((300, 2))
    for terms in (4, 5, 6, 7):
        basis, coefficients = HermiteBasis(multi_indices(2, 3)[:terms]), rng.standard_normal((terms, 3))
        expected = coefficients.T @ basis.by_term(points)
        np.testing.assert_allclose(basis.sums(points, coefficients), expected, rtol=1e-12, atol=1e-12)


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
    with pytest.raises(ParameterError, match="each of 8 variables"):
        even_terms(complete, odd[:2])


def test_indices_of_a_product_of_three():
    """prod (1 + xi_i) has variance 7. Each variable alone explains 1; without it the variance 3 is left."""
    indices = multi_indices(3, 3)
    first, total = sobol_indices(indices, np.where(indices.max(axis=1) <= 1, 1.0, 0.0), np.eye(3))
    np.testing.assert_allclose(first, np.full(3, 1 / 7), rtol=1e-12)
    np.testing.assert_allclose(total, np.full(3, 4 / 7), rtol=1e-12)


def test_indices_of_an_expansion_that_predicts_nothing_come_with_a_warning():
    """The function of Ishigami and Homma has uniform inputs: as one of normal variables its degree 8 from 2000 samples
    misses more than the variance, and its first index is not 0.314. Where 500 samples give all terms, none is said."""
    x = np.random.default_rng(1).uniform(-np.pi, np.pi, (2000, 3))
    response = np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    terms = multi_indices(3, 8)
    fit = least_squares(hermite_basis(ndtri(0.5 + x / (2 * np.pi)), terms), response)
    assert fit.leave_one_out > 1.0
    with pytest.warns(InaccurateWarning, match=f"misses {fit.leave_one_out:.0%} of the variance of left-out samples"):
        first, _ = sobol_indices(terms, fit)
    assert abs(first[0] - 0.314) > 0.1
    xi, terms = np.random.default_rng(2).standard_normal((500, 3)), multi_indices(3, 3)
    first, total = sobol_indices(terms, least_squares(hermite_basis(xi, terms), np.prod(1 + xi, axis=1)))
    np.testing.assert_allclose((first, total), [np.full(3, 1 / 7), np.full(3, 4 / 7)], rtol=1e-10)


def test_modes_behind_one_rotated_variable():
    """He_2((xi_1 + xi_2) / sqrt 2) / sqrt 2 = (He_2(xi_1) + He_2(xi_2)) / sqrt 8 + xi_1 xi_2 / sqrt 2: variances 1/4,
    1/4 and 1/2. The third mode is in no variable."""
    directions = np.array([[0.5**0.5, 0.5**0.5, 0.0]])
    first, total = sobol_indices(multi_indices(1, 2), np.array([3.0, 0.0, 2.0]), directions)
    np.testing.assert_allclose(first, [0.25, 0.25, 0.0], atol=1e-12)
    np.testing.assert_allclose(total, [0.75, 0.75, 0.0], atol=1e-12)


@pytest.mark.parametrize("directions", [np.eye(3), np.linalg.qr(np.random.default_rng(6).standard_normal((5, 3)))[0].T])
def test_terms_that_are_not_there_have_the_coefficient_zero(directions):
    """Turned, an expansion in a few terms is one of full degree. Without a turn, shares are sums of squares."""
    complete = multi_indices(3, 3)
    kept = complete[:, 1] % 2 == 0
    c = np.where(kept, np.random.default_rng(4).standard_normal(len(complete)), 0.0)
    indices = sobol_indices(complete[kept], 1e9 * c[kept], directions)
    np.testing.assert_allclose(indices, sobol_indices(complete, c, directions), atol=1e-12)
    if len(directions[0]) == 3:
        present = complete > 0
        alone = present & (present.sum(axis=1) == 1)[:, None]
        np.testing.assert_allclose(indices, np.stack([c**2 @ alone, c**2 @ present]) / np.sum(c[1:] ** 2), atol=1e-12)


def test_expansions_without_shares_are_refused():
    linear, modes = multi_indices(2, 1), np.eye(2)
    with pytest.raises(IllPosedError, match="constant"):
        sobol_indices(linear, np.array([3.0, 0.0, 0.0]), modes)
    with pytest.raises(ParameterError, match="coefficients has 4 P"):
        sobol_indices(linear, np.ones(4), modes)
    with pytest.raises(ParameterError, match="orthonormal"):
        sobol_indices(linear, np.ones(3), np.ones((2, 3)))
