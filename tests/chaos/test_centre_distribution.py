"""Distributions of the pressure at the centre: refits, intervals of distances, several designs."""

import math

import numpy as np
import pytest
from scipy import stats

from roughslip.chaos.centre_distribution import (
    BLOCK,
    REFIT_BLOCKS,
    REPLICATES,
    SETTLED,
    Expansion,
    Reference,
    apart,
    design_pressures,
    designed_rows,
    draw,
    expanded_rows,
    refits,
    refused_rows,
    sampled_rows,
)
from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.chaos.regression import wild_coefficients
from roughslip.chaos.sampling import cumulative_given_contact, kolmogorov_distance
from roughslip.errors import IllPosedError

INDICES = multi_indices(2, 2)


def exact_expansion(method, truth, samples=300, seed=0):
    """Pressures that follow a polynomial `truth` exactly: p = r^+."""
    basis = hermite_basis(np.random.default_rng(seed).standard_normal((samples, 2)), INDICES)
    return Expansion(method, basis, np.maximum(basis @ truth, 0), INDICES)


TRUTH = np.array([-2e7, 4e7, 1e7, 5e6, 0.0, 3e6])


def test_refits_scatter_as_new_samples_would_with_four_samples_a_coefficient():
    """sigma sqrt(x' (X'X)^-1 x) at new points; the mean ratio over 50 points is known to some 4 %.

    Without signs, and without residuals, refits are the fit.
    """
    rng = np.random.default_rng(2)
    basis, new, weights = rng.standard_normal((200, 50)), rng.standard_normal((50, 50)), np.ones(200)
    exact = basis @ np.ones(50)
    values, signs = exact + rng.standard_normal(200), rng.choice([-1.0, 1.0], (200, 400))
    spread = np.std(new @ wild_coefficients(basis, values, weights, signs), axis=1)
    true = np.sqrt(np.einsum("ni,ij,nj->n", new, np.linalg.inv(basis.T @ basis), new))
    assert np.mean(spread / true) == pytest.approx(1.0, abs=0.1)  # plain residuals would give sqrt(1 - 50/200) = 0.87
    np.testing.assert_allclose(wild_coefficients(basis, exact, weights, signs), 1.0, atol=1e-12)
    fitted = np.linalg.lstsq(basis, values, rcond=None)[0]
    np.testing.assert_allclose(wild_coefficients(basis, values, weights, 0 * signs).T, [fitted] * 400, rtol=1e-9)


@pytest.mark.slow
def test_refits_are_of_the_scatter_of_their_samples():
    one = exact_expansion("equation_8", TRUTH)
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


def test_pressures_of_the_exponential_stay_finite_and_too_few_samples_in_contact_are_refused():
    """The cubic exponent of eq. (9) exceeds what a double holds sooner or later."""
    values = exact_expansion("equation_9", TRUTH).at(np.array([[1e4], [-1e4]]) * np.eye(6)[0], np.eye(6)[0])
    assert np.all((values > 0) & np.isfinite(values))
    with pytest.raises(IllPosedError):
        exact_expansion("equation_8", TRUTH - 1e8 * np.eye(6)[0]).fit()
    rows = refused_rows(np.arange(3.0), (0.1, 0.05, 0.2))
    assert rows.pop("contact_probability") == (0.1, 0.05, 0.2)
    assert all(np.isnan(value).all() for row in rows.values() for value in row)


def reference(surfaces=5000, share=0.2, seed=0):
    rng = np.random.default_rng([11, seed])
    pressure = rng.exponential(1.0, surfaces) * (rng.random(surfaces) < share)
    return Reference(pressure, surfaces, np.quantile(pressure[pressure > 0], np.linspace(0.001, 0.999, 200)))


def test_tail_error_is_the_largest_logarithm_of_a_ratio_where_the_reference_knows_the_probability():
    one = reference(surfaces=20_000)
    F = one.cumulative
    assert one.tail_from == SETTLED / one.contacts == SETTLED / np.count_nonzero(one.pressure)
    assert reference(surfaces=1_100_000).tail_from == 0.001
    assert np.isnan(reference(surfaces=1000).tail_error(F, F))  # 200 contacts, of which 200 are all
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


def test_the_error_in_the_tail_is_as_uncertain_as_the_farther_end_of_its_curve():
    """Of few samples the lower end of the band is farther on a logarithm than the upper one."""
    known = reference(surfaces=20_000)
    pressure = np.random.default_rng(3).exponential(1.0, 3000) * (np.random.default_rng(4).random(3000) < 0.2)
    rows = sampled_rows(pressure, 3000, known)
    curve, low, high = rows["cumulative"]
    far, near = known.tail_error(low, curve), known.tail_error(high, curve)
    value, least, most = rows["tail_error"]
    assert far > near
    assert (most - value, least) == pytest.approx((far, max(value - far, 0.0)), rel=1e-12)


def test_rows_of_an_expansion_hold_their_values_and_have_at_least_the_error_of_the_reference():
    one = reference(surfaces=20_000)
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
    tail, least, most = expanded_rows(2.0 * pressure, 0 * moved, (0.2, 0.1, 0.3), one)["tail_error"]
    assert tail - least == pytest.approx(most - tail)  # log 2.2 is beyond the error, so that it is not cut
    assert least > 0.0
    assert np.all((wider["cumulative"][1] >= 0) & (wider["cumulative"][2] <= 1))


def test_numbers_of_several_designs_are_their_mean_with_students_interval():
    """Three designs, of the reference's own pressures and of these scaled by 0.7 and 1.3."""
    one = reference(surfaces=200_000)
    own = np.sort(one.pressure[one.pressure > 0])
    scale = 0.3
    rows = designed_rows(np.stack([own, own * (1 - scale), own * (1 + scale)]), (0.2, 0.1, 0.3), one)
    distances = np.array([0.0, *(kolmogorov_distance(own * (1 + sign * scale), own) for sign in (-1, 1))])
    mean, low, high = rows["distance_in_contact"]
    assert mean == pytest.approx(distances.mean(), rel=1e-9)
    student = 4.302653 * distances.std(ddof=1) / math.sqrt(3)  # t(0.975, 2) = 4.302653
    half = math.hypot(student, 0.98 / math.sqrt(one.contacts))
    assert high - mean == pytest.approx(half, rel=1e-4)
    assert low == 0.0
    curve, lowest, highest = rows["cumulative"]
    assert np.all((lowest <= curve) & (curve <= highest))


def test_variants_whose_refits_move_together_are_surely_apart():
    """What their common samples do to both cancels."""
    rng = np.random.default_rng(8)
    first, second = rng.exponential(1.0, 5000), rng.exponential(2.0, 5000)
    moved = 0.1 * rng.standard_normal((50, 30))
    distance, low, high = apart(first, second, {"equation_8": moved, "equation_9": moved})
    assert low == distance == high == pytest.approx(0.25, abs=0.02)  # max |e^-x - e^-x/2| = 1/4
    moved[:, 0] *= 0.1  # the distance changes by the most that a refit changes at any level
    _, low, high = apart(first, second, {"equation_8": moved, "equation_9": -moved})
    far = np.quantile(2 * np.abs(moved).max(axis=1), 0.95)
    assert (low, high) == pytest.approx((max(distance - far, 0.0), min(distance + far, 1.0)))
    _, low, high = apart(first, second, {"equation_8": moved / 50, "equation_9": -moved / 50})
    assert (distance - low, high - distance) == pytest.approx((far / 50, far / 50))


def test_pressures_of_several_designs_are_of_the_same_draws():
    designs = [
        exact_expansion("equation_8", TRUTH * np.array([1, scale, 1, 1, 1, 1]), seed=seed)
        for scale, seed in ((1, 0), (2, 1))
    ]
    fits = [design.fit() for design in designs]
    pressures = design_pressures(designs, fits, [4])
    for row, design, fit in zip(pressures, designs, fits, strict=True):
        np.testing.assert_allclose(row, draw(design, fit.coefficients, REFIT_BLOCKS * BLOCK, [4]), rtol=1e-9)
