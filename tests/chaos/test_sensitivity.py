"""Moments and Sobol' indices, against closed forms."""

import numpy as np
import pytest

from roughslip.chaos.hermite import multi_indices
from roughslip.chaos.sensitivity import sensitivity, sensitivity_along, sensitivity_to_directions, share_of_modes
from roughslip.errors import IllPosedError, ParameterError


def test_a_product_of_three():
    """prod (1 + xi_i): mean 1, variance 7. Each variable alone explains 1; without it the variance 3 is left."""
    indices = multi_indices(3, 3)
    found = sensitivity(indices, np.where(indices.max(axis=1) <= 1, 1.0, 0.0))
    assert (found.mean, found.variance) == pytest.approx((1.0, 7.0))
    np.testing.assert_allclose(found.first, np.full(3, 1 / 7), rtol=1e-13)
    np.testing.assert_allclose(found.total, np.full(3, 4 / 7), rtol=1e-13)


@pytest.mark.parametrize("scale", [1e-200, 1e9])
def test_shares_do_not_depend_on_the_unit(scale):
    indices, c = multi_indices(3, 2), np.random.default_rng(1).standard_normal(10)
    found, scaled = sensitivity(indices, c), sensitivity(indices, scale * c)
    np.testing.assert_allclose(scaled.first, found.first, rtol=1e-14)
    np.testing.assert_allclose(scaled.total, found.total, rtol=1e-14)
    assert scaled.mean == pytest.approx(scale * found.mean, rel=1e-14)


def test_modes_behind_one_rotated_variable():
    """He_2((xi_1 + xi_2) / sqrt 2) / sqrt 2 = (He_2(xi_1) + He_2(xi_2)) / sqrt 8 + xi_1 xi_2 / sqrt 2: variances 1/4,
    1/4 and 1/2. The third mode is in no variable."""
    indices, directions = multi_indices(1, 2), np.array([[0.5**0.5, 0.5**0.5, 0.0]])
    found = sensitivity_to_directions(indices, np.array([3.0, 0.0, 2.0]), directions)
    assert (found.mean, found.variance) == (3.0, 4.0)
    np.testing.assert_allclose(found.first, [0.25, 0.25, 0.0], atol=1e-12)
    np.testing.assert_allclose(found.total, [0.75, 0.75, 0.0], atol=1e-12)


def test_functions_of_one_direction_are_expansions_in_one_rotated_variable():
    """Node by node as the indices behind a rotated variable, of a cubic of mixed coefficients; all modes are all."""
    generator = np.random.default_rng(8)
    direction = generator.standard_normal((4, 3))
    direction /= np.linalg.norm(direction, axis=0)
    coefficients = generator.standard_normal((4, 3))
    first, total = sensitivity_along(direction, coefficients)
    for node in range(3):
        known = sensitivity_to_directions(multi_indices(1, 3), coefficients[:, node], direction[:, node][None])
        np.testing.assert_allclose(first[:, node], known.first, rtol=1e-9)
        np.testing.assert_allclose(total[:, node], known.total, rtol=1e-9)
    np.testing.assert_allclose(share_of_modes(direction, coefficients, 4), 1.0, rtol=1e-12)
    np.testing.assert_allclose(share_of_modes(direction, coefficients, 1), first[0], rtol=1e-12)
    squares = direction[0] ** 2 + direction[1] ** 2  # of He_2 alone: their share of d, squared
    np.testing.assert_allclose(share_of_modes(direction, np.eye(4)[:, [2, 2, 2]], 2), squares**2, rtol=1e-12)


@pytest.mark.parametrize("directions", [np.eye(3), np.linalg.qr(np.random.default_rng(6).standard_normal((5, 3)))[0].T])
def test_terms_that_are_not_there_have_the_coefficient_zero(directions):
    """Turned, an expansion in a few terms is one of full degree. Without a turn, modes are the variables."""
    complete = multi_indices(3, 3)
    kept = complete[:, 1] % 2 == 0
    c = np.where(kept, np.random.default_rng(4).standard_normal(len(complete)), 0.0)
    expected = sensitivity_to_directions(complete, c, directions)
    found = sensitivity_to_directions(complete[kept], c[kept], directions)
    for other in (expected, sensitivity(complete, c))[: 1 + (len(directions[0]) == 3)]:
        np.testing.assert_allclose(found.first, other.first, atol=1e-12)
        np.testing.assert_allclose(found.total, other.total, atol=1e-12)


LINEAR, DIRECTIONS = multi_indices(2, 1), np.eye(3)[:, :2]


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: sensitivity(LINEAR, np.array([3.0, 0.0, 0.0])), IllPosedError, "constant"),
        (lambda: sensitivity(LINEAR, np.ones(4)), ParameterError, "for each term"),
        (lambda: sensitivity(LINEAR, np.array([1.0, np.nan, 0.0])), ParameterError, "finite"),
        (lambda: sensitivity_to_directions(LINEAR, np.ones(3), np.ones((2, 3))), ParameterError, "orthonormal"),
        (lambda: sensitivity_along(DIRECTIONS, np.ones((3, 1))), ParameterError, "do not match"),
        (lambda: sensitivity_along(2 * DIRECTIONS, np.ones((3, 2))), ParameterError, "unit length"),
        (lambda: sensitivity_along(DIRECTIONS, np.eye(3)[:, :1] * [1, 1]), IllPosedError, "constant"),
    ],
)
def test_expansions_without_shares_are_refused(call, error, message):
    with pytest.raises(error, match=message):
        call()
