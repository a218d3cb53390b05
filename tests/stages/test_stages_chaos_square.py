"""Distributions at the centre: refits, distances to Monte Carlo and their intervals."""

import numpy as np
import pytest
from scipy import stats

from roughslip.chaos.distribution import cumulative_given_contact
from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.chaos.regression import wild_coefficients
from roughslip.errors import IllPosedError
from roughslip.stages.result_tables.centre_distribution import (
    BLOCK,
    REFIT_BLOCKS,
    REPLICATES,
    SETTLED,
    Expansion,
    Reference,
    apart,
    draw,
    expanded_rows,
    refits,
    refused_rows,
    sampled_rows,
)

INDICES = multi_indices(2, 2)


def expansion(method, truth, samples=300, seed=0):
    """Pressures that follow a polynomial `truth` exactly: p = r^+."""
    basis = hermite_basis(np.random.default_rng(seed).standard_normal((samples, 2)), INDICES)
    return Expansion(method, basis, np.maximum(basis @ truth, 0), INDICES)


TRUTH = np.array([-2e7, 4e7, 1e7, 5e6, 0.0, 3e6])


def test_refits_without_signs_are_the_fit_and_without_residuals_too():
    rng = np.random.default_rng(1)
    basis, weights, values = rng.standard_normal((50, 4)), rng.uniform(0.1, 1, 50), rng.standard_normal(50)
    fitted = np.linalg.lstsq(np.sqrt(weights)[:, None] * basis, np.sqrt(weights) * values, rcond=None)[0]
    np.testing.assert_allclose(wild_coefficients(basis, values, weights, np.zeros((50, 2))).T, [fitted] * 2, rtol=1e-12)
    signs = rng.choice([-1.0, 1.0], (50, 3))
    exact = basis @ np.arange(4.0)
    np.testing.assert_allclose(wild_coefficients(basis, exact, weights, signs).T, [np.arange(4.0)] * 3, atol=1e-12)


def test_refits_scatter_as_new_samples_would_with_four_samples_a_coefficient():
    """sigma sqrt(x' (X'X)^-1 x) at new points; the mean ratio over 50 points is known to some 4 %."""
    rng = np.random.default_rng(2)
    basis, new = rng.standard_normal((200, 50)), rng.standard_normal((50, 50))
    values = basis @ np.ones(50) + rng.standard_normal(200)
    signs = rng.choice([-1.0, 1.0], (200, 400))
    found = np.std(new @ wild_coefficients(basis, values, np.ones(200), signs), axis=1)
    true = np.sqrt(np.einsum("ni,ij,nj->n", new, np.linalg.inv(basis.T @ basis), new))
    assert np.mean(found / true) == pytest.approx(1.0, abs=0.1)  # plain residuals would give sqrt(1 - 50/200) = 0.87


def test_an_expansion_that_fits_exactly_has_refits_that_do_not_move():
    one = expansion("equation_8", TRUTH)
    fit = one.fit()
    np.testing.assert_allclose(fit.coefficients, TRUTH, atol=1e-6 * 4e7)
    levels = np.array([1e6, 1e7, 5e7])
    curves = refits(one, fit, levels, [3], [4])
    assert curves.shape == (REPLICATES, 3)
    assert np.max(np.abs(curves)) < 1e-3  # a draw that lies on a level


def test_refits_are_of_the_scatter_of_their_samples():
    one = expansion("equation_8", TRUTH)
    noise = 5e6 * np.random.default_rng(3).standard_normal(len(one.pressure))
    noisy = Expansion("equation_8", one.basis, np.where(one.pressure > 0, np.abs(one.pressure + noise), 0.0), INDICES)
    levels = np.array([1e6, 1e7, 5e7])
    curves = refits(noisy, noisy.fit(), levels, [3], [4])
    np.testing.assert_array_equal(curves, refits(noisy, noisy.fit(), levels, [3], [4]))
    assert np.all(np.std(curves, axis=0) > 1e-4)
    contact = noisy.pressure > 0
    count = np.count_nonzero(contact)
    signs = np.random.default_rng([4]).choice([-1.0, 1.0], (count, REPLICATES))  # the first of them by hand
    refit = wild_coefficients(noisy.basis[contact], noisy.pressure[contact], np.ones(count), signs)[:, 0]
    pressures = [draw(noisy, one, REFIT_BLOCKS * BLOCK, [3]) for one in (refit, noisy.fit().coefficients)]
    refit, fit = (cumulative_given_contact(pressure, levels) for pressure in pressures)
    np.testing.assert_allclose(curves[0], refit - fit, atol=1e-4)  # a draw may change sides of a level by rounding


def test_draws_are_a_function_of_their_number():
    one = expansion("equation_8", TRUTH)
    many = draw(one, TRUTH, 2 * BLOCK + 10, [7])
    assert len(many) == 2 * BLOCK + 10
    np.testing.assert_array_equal(draw(one, TRUTH, BLOCK + 5, [7]), many[: BLOCK + 5])
    share = np.mean(many > 0)
    normal = np.random.default_rng(0).standard_normal((100_000, 2))
    assert share == pytest.approx(np.mean(hermite_basis(normal, INDICES) @ TRUTH > 0), abs=0.01)  # 4 standard errors


def test_pressures_of_the_exponential_stay_finite():
    """Its cubic exponent exceeds what a double holds sooner or later."""
    one = expansion("equation_9", TRUTH)
    values = one.at(np.array([[1e4, 0, 0, 0, 0, 0], [-1e4, 0, 0, 0, 0, 0]]), np.eye(6)[0])
    assert np.isfinite(values).all()
    assert np.all(values > 0)


def test_too_few_samples_in_contact_for_the_paper_are_refused():
    with pytest.raises(IllPosedError):
        expansion("equation_8", TRUTH - 1e8 * np.eye(6)[0]).fit()
    rows = refused_rows(np.arange(3.0), (0.1, 0.05, 0.2))
    assert rows["contact_probability"] == (0.1, 0.05, 0.2)
    assert all(
        np.isnan(value).all() for name in ("cumulative", "distance_in_contact", "tail_error") for value in rows[name]
    )


def reference(surfaces=5000, share=0.2, seed=0):
    rng = np.random.default_rng([11, seed])
    pressure = rng.exponential(1.0, surfaces) * (rng.random(surfaces) < share)
    return Reference(pressure, surfaces, np.quantile(pressure[pressure > 0], np.linspace(0.001, 0.999, 200)))


def test_low_probabilities_are_those_that_the_reference_settles():
    one = reference()
    assert one.contacts == np.count_nonzero(one.pressure)
    assert one.tail_from == SETTLED / one.contacts
    assert reference(surfaces=400_000).tail_from == 0.001
    assert np.isnan(reference(surfaces=1000).tail_error(one.cumulative, one.cumulative))  # 200 contacts: 50 are 25 %


def test_tail_error_is_the_largest_logarithm_of_a_ratio_in_the_tail_alone():
    one = reference()
    F = one.cumulative
    assert one.tail_error(F, F) == 0.0
    assert one.tail_error(2 * F, F) == one.tail_error(F / 2, F) == pytest.approx(np.log10(2))
    low = (one.tail_from <= F) & (F <= 0.1)
    assert one.tail_error(np.where(low, F, 5 * F), F) == 0.0
    assert one.tail_error(0 * F, F) == pytest.approx(np.log10(F[low].max() * BLOCK))  # zero counts as one in a block


def test_the_interval_of_a_sampled_distance_holds_the_true_one():
    """Exponential laws of scale 1 and 1.3, which are max |e^-x - e^-x/1.3| = 0.0966 apart; 95 % of 120 trials, less
    three standard errors of 2 %."""
    x = np.linspace(0, 10, 10_001)
    true = np.max(np.abs(stats.expon.cdf(x) - stats.expon.cdf(x, scale=1.3)))
    rng, held, high = np.random.default_rng(5), 0, []
    for seed in range(120):
        pressure = rng.exponential(1.3, 2000) * (rng.random(2000) < 0.2)
        distance, low, most = sampled_rows(pressure, 2000, reference(seed=seed))["distance_in_contact"]
        assert low <= distance <= most
        held += low <= true <= most
        high.append(most - distance)
    assert held >= 0.89 * 120
    assert np.mean(high) == pytest.approx(0.98 * np.sqrt(1 / 400 + 1 / 1000), rel=0.02)


def test_rows_of_a_sampled_method_hold_their_values():
    one = reference()
    for row in sampled_rows(one.pressure, 5000, one).values():
        value, low, high = row
        assert np.all((low <= np.asarray(value) + 1e-15) & (np.asarray(value) <= high + 1e-15))


def test_rows_of_an_expansion_hold_their_values_and_have_at_least_the_error_of_the_reference():
    one = reference()
    pressure = np.random.default_rng(6).exponential(1.1, 20_000)
    still = expanded_rows(pressure, np.zeros((20, 200)), (0.2, 0.1, 0.3), one)
    distance, low, high = still["distance_in_contact"]
    assert high - distance == pytest.approx(0.98 / np.sqrt(one.contacts), rel=1e-3)
    tail, _, most = still["tail_error"]
    assert most - tail == pytest.approx(1.96 / np.log(10) / np.sqrt(SETTLED), rel=1e-3)
    moved = 0.02 * np.random.default_rng(7).standard_normal((20, 1)) * np.ones(200)
    wider = expanded_rows(pressure, moved, (0.2, 0.1, 0.3), one)
    assert wider["distance_in_contact"][0] == distance
    assert wider["distance_in_contact"][1] <= low
    far = np.quantile(np.abs(moved[:, 0]), 0.95)
    assert wider["distance_in_contact"][2] == pytest.approx(high + far)
    assert np.all((wider["cumulative"][1] >= 0) & (wider["cumulative"][2] <= 1))


def test_variants_whose_refits_move_together_are_surely_apart():
    """What their common samples do to both cancels."""
    rng = np.random.default_rng(8)
    first, second = rng.exponential(1.0, 5000), rng.exponential(2.0, 5000)
    moved = 0.1 * rng.standard_normal((50, 30))
    distance, low, high = apart(first, second, {"equation_8": moved, "equation_9": moved})
    assert low == distance == high == pytest.approx(0.25, abs=0.02)  # max |e^-x - e^-x/2| = 1/4
    _, low, high = apart(first, second, {"equation_8": moved, "equation_9": 0 * moved})
    assert low < distance < high
