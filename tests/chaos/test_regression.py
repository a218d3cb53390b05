"""Least squares: exact polynomials, quality by brute-force refits.

The basis: which terms, in which order, and their orthonormality under standard normals.
"""

import math
import warnings
from itertools import product

import numpy as np
import pytest
from numpy.polynomial.hermite_e import hermegauss
from scipy import stats

from roughslip.chaos.hermite import even_terms, hermite_basis, multi_indices
from roughslip.chaos.regression import Regression, least_squares
from roughslip.errors import IllPosedError


def noisy_problem(samples=30, terms=6):
    rng = np.random.default_rng(1)
    basis = rng.standard_normal((samples, terms)) * 10.0 ** np.arange(terms)
    return basis, rng.standard_normal(samples) + basis[:, 0], rng.random(samples) + 0.1


def weighted_solution(basis, target, weights):
    root = np.sqrt(weights)
    scale = np.linalg.norm(root[:, None] * basis, axis=0)
    return np.linalg.lstsq(root[:, None] * basis / scale, root * target, rcond=None)[0] / scale


def test_residuals_left_out_are_those_of_refits():
    basis, target, weights = noisy_problem()
    fit = least_squares(basis, target, weights)
    deleted = np.empty(len(target))
    for k in range(len(target)):
        others = np.arange(len(target)) != k
        deleted[k] = target[k] - basis[k] @ weighted_solution(basis[others], target[others], weights[others])
    mean = np.average(target, weights=weights)
    variance = np.average((target - mean) ** 2, weights=weights)
    kept = np.average(deleted**2, weights=weights)
    assert fit.leave_one_out == pytest.approx(kept / variance, rel=1e-11)
    solution = weighted_solution(basis, target, weights)
    np.testing.assert_allclose(fit.coefficients, solution, rtol=1e-11)


GROUPS = 5


def grouped_problem():
    generator = np.random.default_rng(2001)
    rows, values = generator.standard_normal((60, 4)), generator.standard_normal(60)
    return rows, values, generator.uniform(0.2, 1.0, 60), np.arange(60) % GROUPS


@pytest.mark.parametrize("scale", [1.0, 1e9])
def test_fits_without_groups_are_fits_to_the_others(scale):
    """Without one group and without two; so are the predictions of each sample. Scales of terms do not matter."""
    rows, values, weights, group = grouped_problem()
    columns = np.array([1.0, 1 / scale, scale, 3.0])
    regression = Regression(rows * columns, weights, group + 7)
    pairs = regression.without_pairs(values) * columns
    for g, h in product(range(1 + GROUPS), repeat=2):
        keep = (group != g - 1) & (group != h - 1)
        expected = weighted_solution(rows[keep], values[keep], weights[keep])
        np.testing.assert_allclose(pairs[g, h], expected, rtol=0, atol=1e-13)
    fit = regression.fit(values)
    np.testing.assert_allclose(fit.predicted, np.einsum("kp,kp->k", rows, pairs[0, 1 + group]), rtol=0, atol=1e-12)
    mean = np.average(values, weights=weights)
    missed, variance = (np.average((values - part) ** 2, weights=weights) for part in (fit.predicted, mean))
    assert fit.leave_one_out == pytest.approx(missed / variance, rel=1e-11)
    np.testing.assert_allclose(fit.coefficients * columns, pairs[0, 0], rtol=0, atol=1e-13)


@pytest.mark.parametrize("cosine", [0.0, 0.6, 1 - 1e-10])
def test_condition_number_of_two_columns(cosine):
    """Unit columns at an angle have the singular values sqrt(1 +- cos); 1 - cos keeps six digits of the last case."""
    first, second = np.eye(5)[:2]
    basis = np.column_stack([1e-3 * first, 7e4 * (cosine * first + math.sqrt(1 - cosine**2) * second)])
    basis = np.linalg.qr(np.random.default_rng(5).standard_normal((5, 5)))[0] @ basis  # no sample alone in a column
    fit = least_squares(basis, np.arange(5.0))
    assert fit.condition_number == pytest.approx(math.sqrt((1 + cosine) / (1 - cosine)), rel=1e-5)


def test_what_samples_do_not_determine_is_refused():
    """A column on one sample alone, one within rounding of another, one on one group alone, and a constant target."""
    basis, target, weights = noisy_problem()
    alone, alike, grouped = basis.copy(), basis.copy(), basis.copy()
    alone[1:, 2], alike[:, 1], grouped[5:, 2] = 0.0, basis[:, 0] + 1e-16 * basis[:, 2], 0.0
    for case, values, group, message in (
        (alone, target, None, "without sample 0"),
        (alike, target, None, "condition number"),
        (grouped, target, np.arange(30) // 5, "without a group of samples a coefficient is undetermined"),
        (basis, np.full(30, 0.1), None, "same on every sample"),
    ):
        with pytest.raises(IllPosedError, match=message):
            least_squares(case, values, weights, group)


def test_basis_is_orthonormal():
    """Products of two terms have degree 14 in a variable at most, for which 8 Gauss points are exact. Rounding: sums of
    512 terms up to 100. Cubes have a positive sign."""
    points, weights = hermegauss(8)
    xi = np.array(list(product(points, repeat=3)))
    weight = np.prod(list(product(weights / math.sqrt(2 * math.pi), repeat=3)), axis=1)
    high = hermite_basis(xi, multi_indices(3, 7))
    np.testing.assert_allclose(high.T @ (weight[:, None] * high), np.eye(120), atol=1e-11)
    basis = high[:, :20]
    np.testing.assert_allclose(basis[:, 10], (xi[:, 0] ** 3 - 3 * xi[:, 0]) / math.sqrt(6), rtol=1e-12, atol=1e-12)
    # terms of several variables start from earlier ones, here from the first of all, which is no constant
    np.testing.assert_allclose(hermite_basis(xi, multi_indices(3, 3)[1:]), basis[:, 1:], rtol=1e-14)


def test_a_sum_of_squares_above_the_variance_of_the_samples_is_warned_of():
    """exp(-x^2) has the variance 5^-1/2 - 1/3 = 0.114. Degree 14 misses a part in 1e-7 of 200 left-out samples, and its
    coefficients have thousands of times that variance; degree 2 of 2000 samples has less, and no warning."""
    for samples, degree, warns in ((200, 14, True), (2000, 2, False)):
        x = np.random.default_rng(0).standard_normal((samples, 1))
        basis, target = hermite_basis(x, multi_indices(1, degree)), np.exp(-(x[:, 0] ** 2))
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            fit = least_squares(basis, target)
            for plain in (basis[:, 1:] * 1e-3, np.vander(x[:, 0], 7, increasing=True)):
                least_squares(plain, target)  # no orthonormal terms: their squares say nothing
        assert (np.sum(fit.coefficients[1:] ** 2) > 10 * (5**-0.5 - 1 / 3)) == warns
        assert ["lower degree in `basis`" in str(one.message) for one in caught] == [True] * warns
    normal = stats.norm.ppf((np.arange(800) + 0.5) / 800)  # x expands itself, with a coefficient of 1 at any variance
    second, fourth = np.mean(normal**2), np.mean(normal**4)
    least = 1 / (1.1 * second + 4 * math.sqrt((fourth - second**2) / 800))
    for share in (1.01, 0.99):
        x = normal * math.sqrt(share * least)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            least_squares(np.column_stack([np.ones(800), x]), x)
        assert bool(caught) == (share < 1)


def test_correlated_variables_are_warned_of():
    """Their squares are no shares: of x + y with the correlation 0.9 the variance is 3.8, and the squares sum to 2."""
    rng = np.random.default_rng(1)
    first, second = rng.standard_normal((2, 500))
    together = np.column_stack([first, 0.9 * first + math.sqrt(1 - 0.9**2) * second])
    with pytest.warns(UserWarning, match=r"variables 0 and 1 of `xi` have the correlation 0\.[89]"):
        basis = hermite_basis(together, multi_indices(2, 1))
    coefficients = least_squares(basis, together.sum(axis=1)).coefficients
    np.testing.assert_allclose(coefficients, [0, 1, 1], atol=1e-12)
    hermite_basis(np.column_stack([first, second]), multi_indices(2, 1))  # a warning would be an error


def test_even_terms_keep_their_value_under_every_symmetry_and_the_others_do_not():
    """A symmetry that changes the sign of two of eight variables keeps the C(9, 3) = 84 cubics in the other six. It
    also keeps the three products of two of the two, with 1 or one of the six."""
    odd = np.array([[0, 0], [1, 0], [0, 1], [0, 0], [0, 0], [1, 1], [0, 0], [0, 0]])
    complete = multi_indices(8, 3)
    kept = {tuple(term) for term in even_terms(complete, odd)}
    points = np.random.default_rng(2).standard_normal((4, 8))
    for term in complete:
        values = [np.prod((points * signs) ** term, axis=1) for signs in (-1.0) ** odd.T]
        same = all(np.allclose(value, np.prod(points**term, axis=1)) for value in values)
        assert same == (tuple(term) in kept)
