"""Least squares: exact polynomials, quality by brute-force refits."""

import dataclasses
import math

import numpy as np
import pytest
import scipy.linalg

from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.chaos.regression import (
    Fit,
    least_squares,
    orthonormal,
)
from roughslip.errors import IllPosedError, ParameterError

QUALITY = [field.name for field in dataclasses.fields(Fit)]


def noisy_problem(samples=30, terms=6):
    rng = np.random.default_rng(1)
    basis = rng.standard_normal((samples, terms)) * 10.0 ** np.arange(terms)
    return basis, rng.standard_normal(samples) + basis[:, 0], rng.random(samples) + 0.1


def weighted_solution(basis, target, weights):
    root = np.sqrt(weights)
    scale = np.linalg.norm(root[:, None] * basis, axis=0)
    return np.linalg.lstsq(root[:, None] * basis / scale, root * target, rcond=None)[0] / scale


@pytest.mark.parametrize("weighted", [False, True])
def test_a_polynomial_of_the_basis_is_recovered(weighted):
    """Coefficients err by the condition number, some 10, times rounding."""
    rng = np.random.default_rng(2)
    basis = hermite_basis(rng.standard_normal((80, 3)), multi_indices(3, 3))
    exact = rng.standard_normal(20)
    fit = least_squares(basis, basis @ exact, rng.random(80) + 0.1 if weighted else None)
    assert fit.condition_number < 50
    np.testing.assert_allclose(fit.coefficients, exact, atol=1e-13 * fit.condition_number)
    assert fit.leave_one_out < 1e-25
    assert fit.samples == 80


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


def test_samples_at_one_point_are_left_out_together():
    """By refits without any sample of the point: what leave-one-out means where targets of a point scatter."""
    basis, target, _ = noisy_problem()
    point = np.repeat(np.arange(30), np.random.default_rng(7).integers(1, 4, 30))
    basis, target = basis[point], target[point] + 0.5 * np.random.default_rng(8).standard_normal(len(point))
    fit = least_squares(basis, target)
    ones, squares = np.ones(len(target)), np.empty(len(target))
    for number in range(30):
        others, own = point != number, point == number
        without = weighted_solution(basis[others], target[others], ones[others])
        squares[own] = (target[own] - basis[own] @ without) ** 2
    whole = weighted_solution(basis, target, ones)
    assert fit.samples == 30
    np.testing.assert_allclose(fit.coefficients, whole, rtol=1e-10)
    assert fit.leave_one_out == pytest.approx(squares.mean() / target.var(), rel=1e-10)


@pytest.mark.parametrize("apart", [0.0, 1e-12, 1e-7])
def test_leave_one_out_does_not_praise_a_fit_through_every_point(apart):
    """Ten powers through ten and two points, each there twice, of a bent target: the error would be 1e-13 where 0.1 is
    true. Apart by less than copies in single precision are."""
    rng = np.random.default_rng(3)
    xi = np.linspace(-1.6, 1.6, 12)
    xi = rng.permutation(np.concatenate([xi, xi + apart]))
    fit = least_squares(hermite_basis(xi[:, None], multi_indices(1, 9)), np.abs(xi))
    assert fit.samples == 12
    assert fit.leave_one_out > 0.01


def test_a_weight_of_zero_leaves_a_sample_out():
    basis, target, weights = noisy_problem()
    weights[[3, 17]] = 0.0
    kept = weights > 0
    fit, without = least_squares(basis, target, weights), least_squares(basis[kept], target[kept], weights[kept])
    for name in QUALITY:
        np.testing.assert_allclose(getattr(fit, name), getattr(without, name), rtol=1e-12, err_msg=name)


@pytest.mark.parametrize("factor", [1e-200, 1e200])
def test_only_ratios_of_weights_count(factor):
    basis, target, weights = noisy_problem()
    fit, scaled = least_squares(basis, target, weights), least_squares(basis, target, factor * weights)
    np.testing.assert_allclose(scaled.coefficients, fit.coefficients, rtol=1e-12)
    assert scaled.leave_one_out == pytest.approx(fit.leave_one_out, rel=1e-12)
    assert scaled.effective_samples == pytest.approx(fit.effective_samples, rel=1e-12)


@pytest.mark.parametrize(("condition", "by_cholesky"), [(90.0, True), (110.0, False), (1e7, False)])
def test_factors_are_orthonormal_and_give_the_columns_again(condition, by_cholesky, monkeypatch):
    """Singular values from 1 to 1 / condition. By Cholesky Q'Q errs by some ten times 1e-16 condition^2."""
    rng = np.random.default_rng(3)
    left, right = (np.linalg.qr(rng.standard_normal(shape))[0] for shape in ((300, 12), (12, 12)))
    columns = (left * np.geomspace(1.0, 1.0 / condition, 12)) @ right
    reflected = []
    by_reflections = scipy.linalg.qr
    monkeypatch.setattr(scipy.linalg, "qr", lambda *a, **k: reflected.append(1) or by_reflections(*a, **k))
    q, r = orthonormal(columns)
    assert bool(reflected) != by_cholesky
    np.testing.assert_allclose(q.T @ q, np.eye(12), rtol=0, atol=1e-15 * (condition**2 if by_cholesky else 10))
    np.testing.assert_allclose(q @ r, columns, rtol=0, atol=1e-15 * 10)
    assert not np.any(np.tril(r, -1))


@pytest.mark.parametrize("cosine", [0.0, 0.6, 1 - 1e-10])
def test_condition_number_of_two_columns(cosine):
    """Unit columns at an angle have the singular values sqrt(1 +- cos); 1 - cos keeps six digits of the last case."""
    first, second = np.eye(5)[:2]
    basis = np.column_stack([1e-3 * first, 7e4 * (cosine * first + math.sqrt(1 - cosine**2) * second)])
    basis = np.linalg.qr(np.random.default_rng(5).standard_normal((5, 5)))[0] @ basis  # no sample alone in a column
    fit = least_squares(basis, np.arange(5.0))
    assert fit.condition_number == pytest.approx(math.sqrt((1 + cosine) / (1 - cosine)), rel=1e-5)


BASIS, TARGET, WEIGHTS = noisy_problem()


def with_value(array, place, value):
    changed = array.copy()
    changed[place] = value
    return changed


@pytest.mark.parametrize(
    ("basis", "target", "weights", "message"),
    [
        (BASIS[:6], TARGET[:6], WEIGHTS[:6], "6 samples .* 6 coefficients"),
        (BASIS, TARGET, with_value(WEIGHTS, slice(6, None), 1e-9), r"30 samples \(5 effective\)"),
        (BASIS * [1, 1, 0, 1, 1, 1], TARGET, WEIGHTS, "vanishes on every sample"),
        (with_value(BASIS, np.s_[:, 1], BASIS[:, 0] + 1e-16 * BASIS[:, 2]), TARGET, WEIGHTS, "condition number"),
        (with_value(BASIS, np.s_[1:, 2], 0.0), TARGET, WEIGHTS, "without sample 0"),
        (BASIS, np.full(30, 0.1), WEIGHTS, "same on every sample"),
        (BASIS, np.zeros(30), WEIGHTS, "same on every sample, 0:"),
    ],
)
def test_ill_posed_problems_are_refused(basis, target, weights, message):
    with pytest.raises(IllPosedError, match=message):
        least_squares(basis, target, weights)


def test_inputs_that_do_not_match_are_refused():
    short, negative = WEIGHTS[:-1], with_value(WEIGHTS, 4, -1e-9)
    for target, weights in ((TARGET[:-1], short), (TARGET, short), (TARGET, negative)):
        with pytest.raises(ParameterError):
            least_squares(BASIS, target, weights)
