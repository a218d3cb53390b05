"""Censored regression: derivatives, known truths, and least squares as its limit."""

import numpy as np
import pytest
from scipy.special import ndtr

from roughslip.chaos.censored import (
    censored_regression,
    completed,
    derivatives,
    expected,
    log_likelihood,
)
from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.chaos.regression import least_squares
from roughslip.errors import ConvergenceError, IllPosedError, ParameterError

BETA, SIGMA = np.array([-0.5, 1.0, 0.4, 0.0, -0.3, 0.2]), 0.6


def problem(samples, seed=0, shift=0.0):
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
    rows, contact = rows_of(*problem(200)[:2])
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
            basis, y, _ = problem(samples, seed)
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


def test_least_squares_with_zero_out_of_contact_are_wrong_where_it_is_right():
    basis, y, _ = problem(20_000)
    plain = np.linalg.lstsq(basis, y, rcond=None)[0]
    assert np.max(np.abs(plain - BETA)) > 0.3
    assert np.max(np.abs(censored_regression(basis, y).coefficients - BETA)) < 0.04  # four standard errors


def test_with_all_in_contact_it_is_least_squares():
    """Parameters are found to 1e-8 of their standard errors, here 0.03."""
    basis, _, r = problem(300, shift=20.0)
    fit, plain = censored_regression(basis, r), least_squares(basis, r)
    np.testing.assert_allclose(fit.coefficients, plain.coefficients, atol=1e-9)
    assert fit.scatter == pytest.approx(np.sqrt(np.mean((r - basis @ plain.coefficients) ** 2)), rel=1e-8)


def test_least_squares_of_expected_values_give_the_coefficients_again():
    """The maximum is a fixed point of expectation and maximisation (Dempster, Laird and Rubin 1977)."""
    basis, y, _ = problem(500)
    fit = censored_regression(basis, y)
    again = least_squares(basis, expected(fit, basis @ fit.coefficients, y))
    np.testing.assert_allclose(again.coefficients, fit.coefficients, atol=1e-8)


@pytest.mark.parametrize("factor", [1e-18, 1e9, 1e18])
def test_units_do_not_matter(factor):
    basis, y, _ = problem(400)
    fit, scaled = censored_regression(basis, y), censored_regression(basis, factor * y)
    np.testing.assert_allclose(scaled.coefficients, factor * fit.coefficients, rtol=1e-9)
    assert scaled.scatter == pytest.approx(factor * fit.scatter, rel=1e-9)
    assert scaled.iterations == fit.iterations


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
    monkeypatch.setattr("roughslip.chaos.censored.STEPS", 2)
    basis, y, _ = problem(200)
    with pytest.raises(ConvergenceError) as caught:
        censored_regression(basis, y)
    assert caught.value.work == 2
    assert caught.value.residual > 1e-16


BASIS, Y, _ = problem(200)


@pytest.mark.parametrize(
    ("basis", "y", "error", "message"),
    [
        (BASIS, np.where(np.cumsum(Y > 0) <= 6, Y, 0.0), IllPosedError, "6 of 200 samples are in contact"),
        (BASIS, 0 * Y, IllPosedError, "0 of 200"),
        (np.column_stack([BASIS, BASIS[:, 1]]), Y, IllPosedError, "dependent"),
        (BASIS, BASIS @ BETA, IllPosedError, "no scatter"),  # the likelihood grows without bound
        (BASIS, BASIS @ BETA + 20.0, IllPosedError, "no scatter"),
        (BASIS, np.where(np.arange(200) == 3, np.nan, Y), ParameterError, "finite"),
        (BASIS, np.where(np.arange(200) == 3, np.inf, Y), ParameterError, "finite"),
        (BASIS, Y[1:], ParameterError, "for each row"),
    ],
)
def test_problems_without_a_solution_are_refused(basis, y, error, message):
    with pytest.raises(error, match=message):
        censored_regression(basis, y)
