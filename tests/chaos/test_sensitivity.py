"""Moments and Sobol' indices, against closed forms."""

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from roughslip.chaos.basis import legendre_polynomials
from roughslip.chaos.indices import multi_indices
from roughslip.chaos.sensitivity import sensitivity
from roughslip.errors import IllPosedError, ParameterError


def test_a_product_of_three():
    """prod (1 + x_i): mean 1, variance (4/3)^3 - 1; x_1 alone 1/3, and of all that is left without x_1, (4/3)^2 - 1,
    the rest is in its total."""
    nodes, weights = leggauss(3)
    one = legendre_polynomials(nodes, 1) @ (weights / 2 * (1 + nodes))
    indices = multi_indices(3, 3)
    coefficients_ = np.where(indices.max(axis=1) <= 1, np.prod(one[np.minimum(indices, 1)], axis=1), 0.0)
    found = sensitivity(indices, coefficients_)
    variance = (4 / 3) ** 3 - 1
    np.testing.assert_allclose(found.first, np.full(3, 1 / 3 / variance), rtol=1e-13)
    np.testing.assert_allclose(found.total, np.full(3, 1 - ((4 / 3) ** 2 - 1) / variance), rtol=1e-13)


@pytest.mark.parametrize("scale", [1e-200, 1e9])
def test_shares_do_not_depend_on_the_unit(scale):
    indices, c = multi_indices(3, 2), np.random.default_rng(1).standard_normal(10)
    found, scaled = sensitivity(indices, c), sensitivity(indices, scale * c)
    np.testing.assert_allclose(scaled.first, found.first, rtol=1e-14)
    np.testing.assert_allclose(scaled.total, found.total, rtol=1e-14)
    assert scaled.mean == pytest.approx(scale * found.mean, rel=1e-14)


def test_a_constant_has_no_shares():
    with pytest.raises(IllPosedError, match="constant"):
        sensitivity(multi_indices(2, 1), np.array([3.0, 0.0, 0.0]))


@pytest.mark.parametrize("c", [np.ones(4), np.array([1.0, np.nan, 0.0])])
def test_coefficients_that_do_not_fit_are_refused(c):
    with pytest.raises(ParameterError):
        sensitivity(multi_indices(2, 1), c)
