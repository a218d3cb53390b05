"""Least-angle regression: its path by definition, its figures by refits, what it finds and what it refuses."""

import numpy as np
import pytest

from roughslip.chaos import sparse
from roughslip.chaos.basis import truncated
from roughslip.chaos.regression import least_squares
from roughslip.chaos.sparse import sparse_least_squares
from roughslip.errors import IllPosedError, ParameterError


def problem(samples=60, variables=4, degree=4, seed=1, noise=0.1):
    rng = np.random.default_rng([seed, samples])
    points = rng.uniform(-1, 1, (samples, variables))
    basis = truncated(("legendre",) * variables, degree)(points)
    target = np.exp(points[:, 0]) + points[:, 1] * points[:, 2] + noise * rng.standard_normal(samples)
    return basis, target, rng.random(samples) + 0.2


def least_angle_path(basis, target, weights, steps):
    """By definition: from the present fit to the least-squares fit of the active columns, until another column is as
    correlated with what remains (Efron et al. 2004, section 2), every length found by bisection."""
    root = np.sqrt(weights / weights.sum())
    x = root[:, None] * basis
    x = x - np.outer(root, root @ x)
    x[:, 1:] /= np.linalg.norm(x[:, 1:], axis=0)
    rest = root * target - root * (root @ (root * target))
    active = [int(np.argmax(np.abs(x.T @ rest)))]
    while len(active) < steps:
        move = x[:, active] @ np.linalg.lstsq(x[:, active], rest, rcond=None)[0]
        others = np.setdiff1d(np.arange(1, x.shape[1]), active)

        def ahead(length, rest=rest, move=move, others=others, active=active):
            c = np.abs(x.T @ (rest - length * move))
            return c[others].max() - c[active].max()

        low, high = 0.0, 1.0
        for _ in range(80):
            middle = (low + high) / 2
            low, high = (middle, high) if ahead(middle) < 0 else (low, middle)
        rest = rest - high * move
        active.append(int(others[np.argmax(np.abs(x.T @ rest)[others])]))
    return [0, *active]


@pytest.mark.parametrize("weighted", [False, True])
def test_terms_enter_in_the_order_of_least_angles(weighted):
    basis, target, weights = problem()
    weights = weights if weighted else np.ones(len(target))
    path = [column for column, *_ in sparse._path(basis, target, weights, 59)]
    assert path[:25] == least_angle_path(basis, target, weights, 24)


@pytest.mark.parametrize("weighted", [False, True])
def test_errors_on_the_path_are_those_of_refits(weighted):
    """Up to twenty terms of sixty samples, condition numbers below 100."""
    basis, target, weights = problem()
    weights = weights if weighted else None
    columns = [column for column, *_ in sparse._path(basis, target, np.ones(60) if weights is None else weights, 59)]
    found = sparse_least_squares(basis, target, weights)
    for count in range(1, 21):
        fit = least_squares(basis[:, columns[:count]], target, weights)
        assert found.errors[count - 1] == pytest.approx(fit.corrected_leave_one_out, rel=1e-10)
    assert np.array_equal(found.active, columns[: len(found.active)])
    np.testing.assert_array_equal(
        found.fit.coefficients, least_squares(basis[:, found.active], target, weights).coefficients
    )


def test_the_smallest_of_nearly_equal_sets_is_chosen():
    basis, target, _ = problem(samples=200)
    found = sparse_least_squares(basis, target)
    limit = found.errors.min() * (1 + sparse.ALIKE * np.sqrt(2 / 200))
    assert len(found.active) == np.flatnonzero(found.errors <= limit)[0] + 1
    assert 4 <= len(found.active) < 25  # 1, x, x^2, y z at the least


def test_a_sparse_polynomial_is_found_from_fewer_samples_than_candidates():
    """Six of 1771 terms from 150 samples, exactly: coefficients to the rounding of a well-conditioned fit."""
    rng = np.random.default_rng(2)
    candidates = truncated(("hermite",) * 20, 3)
    points = rng.standard_normal((150, 20))
    basis, terms = candidates(points), np.array([0, 3, 25, 100, 700, 1500])
    exact = np.array([2.0, -1.0, 0.5, 1.0, 0.3, -0.7])
    found = sparse_least_squares(basis, basis[:, terms] @ exact)
    coefficients = np.zeros(1771)
    coefficients[found.active] = found.fit.coefficients
    expected = np.zeros(1771)
    expected[terms] = exact
    np.testing.assert_allclose(coefficients, expected, atol=1e-12)
    assert found.fit.leave_one_out < 1e-24
    assert set(terms) <= set(found.active)
    assert len(found.errors) < 20  # nothing is left to explain once all six are in


def test_a_copy_of_a_candidate_does_not_enter():
    basis, target, _ = problem()
    doubled = np.column_stack([basis, basis[:, 1:], basis[:, 1] + basis[:, 2]])
    found, alone = sparse_least_squares(doubled, target), sparse_least_squares(basis, target)
    np.testing.assert_allclose(found.errors, alone.errors, rtol=1e-8)
    np.testing.assert_array_equal(found.active, alone.active)


def test_candidates_without_variation_do_not_enter():
    basis, target, _ = problem()
    basis[:, 7] = 3.0
    assert 7 not in sparse_least_squares(basis, target).active


def test_copies_of_samples_are_one_with_their_weights():
    basis, target, _ = problem(samples=40)
    times = np.random.default_rng(5).integers(1, 4, 40)
    found = sparse_least_squares(np.repeat(basis, times, axis=0), np.repeat(target, times))
    weighted = sparse_least_squares(basis, target, times.astype(float))
    assert np.array_equal(found.active, weighted.active)
    np.testing.assert_allclose(found.errors, weighted.errors, rtol=1e-9)


@pytest.mark.parametrize("apart", [0.0, 1e-7])
def test_copies_with_noise_do_not_let_it_fit_their_points(apart):
    """Sixty points, each there twice with a target of its own: nothing can be told apart from noise, where terms
    through every point once were told to miss 1e-3 of the variance."""
    rng = np.random.default_rng(6)
    points = np.repeat(rng.standard_normal((60, 20)), 2, axis=0) + apart * rng.standard_normal((120, 20))
    basis = truncated(("hermite",) * 20, 2)(points)
    found = sparse_least_squares(basis, np.repeat(rng.standard_normal(60), 2) + 1e-3 * rng.standard_normal(120))
    assert found.fit.samples == 60
    assert found.fit.corrected_leave_one_out > 0.3
    assert len(found.active) < 30


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_the_unit_of_the_target_does_not_matter(scale):
    basis, target, _ = problem()
    found, scaled = sparse_least_squares(basis, target), sparse_least_squares(basis, scale * target)
    assert np.array_equal(found.active, scaled.active)
    np.testing.assert_allclose(scaled.fit.coefficients, scale * found.fit.coefficients, rtol=1e-10)


def test_a_path_ends_when_no_set_gets_better(monkeypatch):
    """Each step costs a product with all candidates: 300 samples and 330 candidates would allow 299."""
    basis, target, _ = problem(samples=300, degree=7)
    short = sparse_least_squares(basis, target)
    assert len(short.errors) <= 1.5 * (np.argmin(short.errors) + 1) + sparse.PATIENCE + 1
    monkeypatch.setattr(sparse, "PATIENCE", 10_000)
    whole = sparse_least_squares(basis, target)
    assert len(short.errors) < len(whole.errors) / 2
    assert np.array_equal(short.active, whole.active)


def test_noise_explains_nothing():
    """165 candidates and 100 samples of noise: the honest answer is the mean, or nearly."""
    basis, _, _ = problem(samples=100, variables=3, degree=8)
    found = sparse_least_squares(basis, np.random.default_rng(7).standard_normal(100))
    assert len(found.active) < 12
    assert found.fit.corrected_leave_one_out > 0.7


@pytest.mark.parametrize(
    ("samples", "change", "error", "message"),
    [
        (19, lambda b, y, w: (b, y, None), IllPosedError, "19 effective samples are too few to choose"),
        (30, lambda b, y, w: (b, y, w**9), IllPosedError, "effective samples are too few to choose"),
        (30, lambda b, y, w: (b, 0 * y + 3, None), IllPosedError, "same on every sample"),
        (30, lambda b, y, w: (b[:, 1:], y, None), ParameterError, "column 0"),
        (30, lambda b, y, w: (b[:, :0], y, None), ParameterError, "column 0"),
        (30, lambda b, y, w: (b, y * np.nan, None), ParameterError, "finite"),
        (30, lambda b, y, w: (b, y, -w), ParameterError, "non-negative"),
        (30, lambda b, y, w: (b, y[1:], None), ParameterError, "target for each row"),
    ],
)
def test_impossible_problems_are_refused(samples, change, error, message):
    with pytest.raises(error, match=message):
        sparse_least_squares(*change(*problem(samples=samples)))


def test_sets_that_could_err_wildly_are_passed_over():
    """Eleven powers of a normal variable at 25 samples: the last ones are not seen where they are large."""
    rng = np.random.default_rng(9)
    xi = rng.standard_normal((25, 1))
    found = sparse_least_squares(truncated(("hermite",), 11)(xi), np.tanh(3 * xi[:, 0]))
    assert np.isinf(found.errors).any()
    assert found.fit.error_bound <= 10
