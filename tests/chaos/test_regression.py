"""Least squares: exact polynomials, quality by brute-force refits. Censored: derivatives, known truths, limits."""

import dataclasses
import math

import numpy as np
import pytest
import scipy.linalg
from scipy.special import ndtr

from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.chaos.regression import (
    Fit,
    censored_regression,
    completed,
    derivatives,
    expected,
    least_squares,
    log_likelihood,
    orthonormal,
)
from roughslip.errors import ConvergenceError, IllPosedError, ParameterError

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


BETA, SIGMA = np.array([-0.5, 1.0, 0.4, 0.0, -0.3, 0.2]), 0.6


def censored_problem(samples, seed=0, shift=0.0):
    """y : of r = BETA' psi + SIGMA e, of which some two fifths are positive."""
    generator = np.random.default_rng([1978, seed])
    basis = hermite_basis(generator.standard_normal((samples, 2)), multi_indices(2, 2))
    r = basis @ BETA + shift + SIGMA * generator.standard_normal(samples)
    return basis, np.maximum(r, 0.0), r


def rows_of(basis, y):
    contact = y > 0
    return np.column_stack([basis, -np.where(contact, y, 0.0)]), contact


def test_derivatives_are_those_of_the_likelihood():
    """Central differences of step d err by d^2 / 6 times a third derivative, some K = 200, and by rounding over d."""
    rows, contact = rows_of(*censored_problem(200)[:2])
    at = np.array([-0.4, 1.0, 0.3, 0.1, -0.2, 0.1, 1.3])

    def score(parameters):
        slope, _ = derivatives(rows, contact, parameters)
        return rows.T @ slope + contact.sum() / parameters[-1] * np.eye(7)[-1]

    d = 1e-5 * np.eye(7)
    _, weight = derivatives(rows, contact, at)
    information = (rows.T * weight) @ rows
    information[-1, -1] += contact.sum() / at[-1] ** 2
    for i, step in enumerate(d):
        by_likelihood = (log_likelihood(rows, contact, at + step) - log_likelihood(rows, contact, at - step)) / 2e-5
        assert by_likelihood == pytest.approx(score(at)[i], abs=1e-6)
        np.testing.assert_allclose((score(at + step) - score(at - step)) / 2e-5, -information[i], atol=1e-6)


def test_the_likelihood_is_that_of_the_model():
    """One sample in contact at y = 0.7 and one out of it, prediction 0.2, sigma 0.5; the constant is left out."""
    rows, contact = rows_of(np.ones((2, 1)), np.array([0.7, 0.0]))
    density = np.exp(-0.5 * ((0.7 - 0.2) / 0.5) ** 2) / 0.5
    out = ndtr(-0.2 / 0.5)
    assert log_likelihood(rows, contact, np.array([0.4, 2.0])) == pytest.approx(np.log(density * out), rel=1e-14)


@pytest.mark.slow
def test_errors_fall_with_the_root_of_the_samples_and_are_as_large_as_the_information_says():
    """40 repetitions of 7 parameters: a root mean square of 280 numbers is known to 1 / sqrt(560) = 4.2 %."""
    errors = {}
    for samples in (400, 3600):
        scaled = []
        for seed in range(40):
            basis, y, _ = censored_problem(samples, seed)
            fit = censored_regression(basis, y)
            rows, contact = rows_of(basis, y / fit.unit)
            _, weight = derivatives(rows, contact, fit.parameters)
            information = (rows.T * weight) @ rows
            information[-1, -1] += contact.sum() / fit.parameters[-1] ** 2
            true = np.append(BETA / SIGMA, fit.unit / SIGMA)
            scaled.append((fit.parameters - true) / np.sqrt(np.diag(np.linalg.inv(information))))
            errors.setdefault(samples, []).append(np.append(fit.coefficients - BETA, fit.scatter - SIGMA))
        assert np.sqrt(np.mean(np.square(scaled))) == pytest.approx(1.0, abs=0.17)  # four of these
    ratio = np.sqrt(np.mean(np.square(errors[400])) / np.mean(np.square(errors[3600])))
    assert ratio == pytest.approx(3.0, rel=4 * 0.042 * np.sqrt(2))


def test_with_all_in_contact_it_is_least_squares():
    """Parameters are found to 1e-8 of their standard errors, here 0.03."""
    basis, _, r = censored_problem(300, shift=20.0)
    fit, plain = censored_regression(basis, r), least_squares(basis, r)
    np.testing.assert_allclose(fit.coefficients, plain.coefficients, atol=1e-9)
    assert fit.scatter == pytest.approx(np.sqrt(np.mean((r - basis @ plain.coefficients) ** 2)), rel=1e-8)


def test_least_squares_of_expected_values_give_the_coefficients_again():
    """The maximum is a fixed point of expectation and maximisation (Dempster, Laird and Rubin 1977)."""
    basis, y, _ = censored_problem(500)
    fit = censored_regression(basis, y)
    again = least_squares(basis, expected(fit, basis @ fit.coefficients, y))
    np.testing.assert_allclose(again.coefficients, fit.coefficients, atol=1e-8)


@pytest.mark.parametrize("factor", [1e-18, 1e9, 1e18])
def test_units_of_a_censored_target_do_not_matter(factor):
    basis, y, _ = censored_problem(400)
    fit, scaled = censored_regression(basis, y), censored_regression(basis, factor * y)
    np.testing.assert_allclose(scaled.coefficients, factor * fit.coefficients, rtol=1e-9)
    assert scaled.scatter == pytest.approx(factor * fit.scatter, rel=1e-9)


def test_draws_out_of_contact_have_the_law_of_what_is_not_positive():
    """Kolmogorov distance of 2000 evenly spread probabilities from the uniform law: some log(2000) / 2000."""
    predicted, y = np.full(2000, 0.3), np.zeros(2000)
    y[0] = 5.0
    drawn = completed(predicted, 0.6, y)
    assert drawn[0] == 5.0
    probability = np.sort(ndtr((drawn[1:] - 0.3) / 0.6) / ndtr(-0.5))
    assert np.max(np.abs(probability - (np.arange(1999) + 0.5) / 1999)) < 0.004
    far = completed(np.array([-1e3, 60.0]), 1.0, np.zeros(2))  # far out of contact, and in contact but for chance
    assert far[0] == pytest.approx(-1e3, abs=4)
    assert -1.0 < far[1] <= 0.0


def test_too_many_steps_are_an_error(monkeypatch):
    monkeypatch.setattr("roughslip.chaos.regression.STEPS", 2)
    basis, y, _ = censored_problem(200)
    with pytest.raises(ConvergenceError) as caught:
        censored_regression(basis, y)
    assert caught.value.work == 2
    assert caught.value.residual > 1e-16


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda basis, y: (basis, np.where(np.cumsum(y > 0) <= 6, y, 0.0)), "6 of 200 samples are in contact"),
        (lambda basis, y: (np.column_stack([basis, basis[:, 1]]), y), "dependent"),
        (lambda basis, _: (basis, basis @ BETA), "no scatter"),  # the likelihood grows without bound
        (lambda basis, _: (basis, basis @ BETA + 20.0), "no scatter"),
    ],
)
def test_problems_without_a_maximum_are_refused(change, message):
    with pytest.raises(IllPosedError, match=message):
        censored_regression(*change(*censored_problem(200)[:2]))
