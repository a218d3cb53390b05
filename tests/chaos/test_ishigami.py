"""The Ishigami function, whose expansion is known: truncation errors, fits that reach them, Sobol' indices."""

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from roughslip.chaos.basis import legendre_polynomials, truncated
from roughslip.chaos.expansion import expand, expand_adaptively
from roughslip.chaos.indices import multi_indices
from roughslip.chaos.sensitivity import sensitivity
from workflow.benchmarks.chaos_generic import ishigami

A, B = 7.0, 0.1
ALONE = np.array([(1 + B * np.pi**4 / 5) ** 2 / 2, A**2 / 8, 0.0])
FIRST_AND_THIRD = 8 * B**2 * np.pi**8 / 225
VARIANCE = A**2 / 8 + B * np.pi**4 / 5 + B**2 * np.pi**8 / 18 + 0.5
LEGENDRE = ("legendre",) * 3


def coefficients(indices):
    """Exact, from one-dimensional ones: f = s(x_1) (1 + b q(x_3)) + a t(x_2); 60 Gauss points, so that s and t, whose
    coefficients fall as (pi/2)^n / n!, are integrated to rounding."""
    nodes, weights = leggauss(60)
    polynomials = legendre_polynomials(nodes, int(indices.max())) * weights / 2
    sine, square, fourth = (
        polynomials @ f for f in (np.sin(np.pi * nodes), np.sin(np.pi * nodes) ** 2, (np.pi * nodes) ** 4)
    )
    first, second, third = indices.T
    found = np.where(second == 0, sine[first] * ((third == 0) + B * fourth[third]), 0.0)
    return found + np.where((first == 0) & (third == 0), A * square[second], 0.0)


def truncation_error(degree):
    """Share of the variance in terms above a total degree, summed term by term up to degree 30."""
    indices = multi_indices(3, 30)
    return float(np.sum(coefficients(indices)[indices.sum(axis=1) > degree] ** 2)) / VARIANCE


@pytest.mark.parametrize(("degree", "error"), [(4, 0.252), (6, 1.825e-2), (8, 3.36e-4), (10, 1.88e-6)])
def test_truncation_errors(degree, error):
    assert truncation_error(degree) == pytest.approx(error, rel=3e-3)


@pytest.mark.parametrize("degree", [4, 6, 8, 10])
def test_a_fit_misses_what_its_degree_must_miss(degree):
    """Judged at 1e5 points, which know the mean square of a residual of this kind to 2 %. Twenty samples a term add
    their twentieth, and more near the ends, where they are few; leave-one-out knows no better than 700 samples do."""
    rng = np.random.default_rng([1, degree])
    basis = truncated(LEGENDRE, degree)
    points = rng.uniform(-1, 1, (20 * len(basis.indices), 3))
    found = expand(points, ishigami(points), basis)
    fresh = rng.uniform(-1, 1, (100_000, 3))
    expected = ishigami(fresh)
    missed = np.mean((found(fresh) - expected) ** 2) / expected.var()
    exact = truncation_error(degree)
    assert 0.96 * exact < missed < 1.35 * exact
    assert found.fit.corrected_leave_one_out == pytest.approx(missed, rel=0.25)


def test_the_degree_is_chosen_that_predicts_best():
    """From 1000 samples the 455 terms of degree 12 are the best; of 450 they are too many. There the correction, which
    takes what is left for noise, is wary: 285 terms of degree 10 would do, degree 8 is taken."""
    rng = np.random.default_rng(3)
    points, fresh = rng.uniform(-1, 1, (1000, 3)), rng.uniform(-1, 1, (5000, 3))
    found, errors = expand_adaptively(points, ishigami(points), LEGENDRE, range(13))
    one_by_one = [expand(points, ishigami(points), truncated(LEGENDRE, degree)) for degree in range(13)]
    missed = [np.mean((one(fresh) - ishigami(fresh)) ** 2) for one in one_by_one]
    assert found.basis.indices.sum(axis=1).max() == np.argmin(errors) == np.argmin(missed) == 12
    np.testing.assert_array_equal(errors, [one.fit.corrected_leave_one_out for one in one_by_one])
    found, errors = expand_adaptively(points[:450], ishigami(points[:450]), LEGENDRE, range(13))
    assert errors[12] == np.inf
    assert found.fit.corrected_leave_one_out == errors.min() < 0.02


def test_sobol_indices_in_closed_form():
    """Ishigami and Homma 1990. Degree 24 leaves out less than 1e-13 of the variance."""
    assert truncation_error(24) < 1e-13
    indices = multi_indices(3, 24)
    found = sensitivity(indices, coefficients(indices))
    both = FIRST_AND_THIRD * np.array([1, 0, 1])
    assert found.mean == pytest.approx(A / 2, rel=1e-13)
    assert found.variance == pytest.approx(VARIANCE, rel=1e-12)
    np.testing.assert_allclose(found.first, ALONE / VARIANCE, atol=1e-12)
    np.testing.assert_allclose(found.total, (ALONE + both) / VARIANCE, atol=1e-12)


def test_sobol_indices_of_a_sparse_fit():
    """Its error share of 2e-5 at most moves an index by twice its root."""
    points = np.random.default_rng(4).uniform(-1, 1, (200, 3))
    found = expand(points, ishigami(points), truncated(LEGENDRE, 10), sparse=True)
    assert found.fit.corrected_leave_one_out < 2e-5
    shares = sensitivity(found.basis.indices, found.fit.coefficients)
    np.testing.assert_allclose(shares.first, ALONE / VARIANCE, atol=2 * np.sqrt(2e-5))
    assert len(found.basis.indices) < 60
