"""Distributions of the pressure at the centre: empirical ones, designs of the equations, intervals of distances."""

import math

import numpy as np
import pytest
from scipy import stats

from roughslip.chaos.centre_distribution import (
    BLOCK,
    BLOCKS,
    KOLMOGOROV_975,
    SETTLED,
    EdgeCorrection,
    Equation,
    Reference,
    between,
    changes_by_refits,
    distance,
    drawn_rows,
    expanded_rows,
    fit_equation,
    given_rows,
    in_contact,
    resolved_by_designs,
    sampled_rows,
    share_up_to,
)
from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.errors import IllPosedError
from roughslip.probability.estimate import NORMAL_95


def test_cumulative_counts_positive_pressures_at_most_each_level():
    pressure = np.array([[0.0, 3.0, 1.0], [0.0, 3.0, np.inf]])
    levels = np.array([0.0, 0.5, 1.0, 2.9, 3.0, 1e300])
    assert np.array_equal(share_up_to(in_contact(pressure), levels), [0, 0, 0.25, 0.25, 0.75, 0.75])


TRUTH = np.array([-2e7, 4e7, 1e7, 5e6, 0.0, 3e6])


def designs(count, scale=1.0):
    """Variables and pressures of designs whose trial pressure follows the polynomial TRUTH exactly."""
    xi = np.random.default_rng(0).standard_normal((count, 300, 2))
    basis = [hermite_basis(each, multi_indices(2, 2)) for each in xi]
    return xi, np.array([np.maximum(each @ TRUTH, 0.0) for each in basis]) * scale


def test_an_equation_is_fitted_to_each_design_in_contact_and_drawn_at_the_same_variables():
    """Eq. (8) finds the polynomial, eq. (9) the logarithm of an exponential one; blocks have seeds of their own."""
    xi, pressures = designs(2)
    eight = fit_equation(xi, pressures, 2, logarithm=False)
    for fit in eight.fits:
        np.testing.assert_allclose(fit.coefficients, TRUTH, atol=1e-6)
    drawn = eight.draw([3])
    assert drawn.shape == (2, BLOCKS * BLOCK)
    np.testing.assert_allclose(drawn[0], drawn[1], atol=1e-3)
    block = np.random.default_rng([3, 1]).standard_normal((BLOCK, 2))
    np.testing.assert_allclose(drawn[0, BLOCK : 2 * BLOCK], eight.pressure(block)[0], rtol=1e-12)
    nine = fit_equation(xi, np.exp(1e-8 * (pressures + 1.0)), 2, logarithm=True)
    at = np.random.default_rng(1).standard_normal((50, 2))
    assert np.all(nine.pressure(at) > 0)
    with pytest.raises(IllPosedError, match="design 2 of 2: 0 of 300 samples are in contact"):
        fit_equation(xi, [pressures[0], 0 * pressures[1]], 2, logarithm=False)
    far = Equation(True, multi_indices(1, 1), (fit_equation(xi[:1, :, :1], pressures[:1], 1, logarithm=True).fits[0],))
    assert np.isfinite(far.pressure(np.array([[1e6], [-1e6]]))).all()  # beyond what a double holds


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
        apart, low, most = sampled_rows(pressure, 2000, reference(seed=seed))["distance_in_contact"]
        assert low <= apart <= most
        held += low <= true <= most
        high.append(most - apart)
    assert held >= 0.89 * 120
    assert pytest.approx(stats.kstwobign.ppf(0.975), abs=5e-4) == KOLMOGOROV_975
    assert np.mean(high) == pytest.approx(0.98 * np.sqrt(1 / 400 + 1 / 1000), rel=0.02)


class Drawn:
    """An expansion that draws given pressures, and the same without each of its groups."""

    def __init__(self, pressures):
        self.pressures = pressures

    def draw(self, generator, count, *, left_out):
        return self.pressures


def without_correction(groups):
    return EdgeCorrection(np.ones((groups, 1)), np.ones((groups, 1)), np.arange(groups))


def test_rows_of_an_expansion_have_at_least_the_error_of_the_reference_and_the_jackknife_of_its_refits():
    one = reference(surfaces=20_000)
    pressure = np.random.default_rng(6).exponential(1.1, 20_000)
    still = expanded_rows(Drawn(np.tile(pressure, (21, 1))), pressure, without_correction(20), [1], one)
    apart, low, high = still["distance_in_contact"]
    assert high - apart == pytest.approx(0.98 / np.sqrt(one.contacts), rel=1e-3)
    tail, _, most = still["tail_error"]
    assert most - tail == pytest.approx(1.96 / np.log(10) / np.sqrt(SETTLED), rel=1e-3)
    scales = np.concatenate([[1.0], 1.0 + 0.02 * np.random.default_rng(7).standard_normal(20)])
    moving = Drawn(pressure * scales[:, None])
    wider = expanded_rows(moving, pressure, without_correction(20), [1], one)
    moved, share = changes_by_refits(moving, without_correction(20), [1], one.levels)
    assert share == 0.0
    far = np.quantile(np.max(np.abs(moved), axis=1), 0.95)
    assert wider["distance_in_contact"][0] == apart
    assert wider["distance_in_contact"][1] <= low
    assert wider["distance_in_contact"][2] == pytest.approx(high + far)
    assert np.all((wider["cumulative"][1] >= 0) & (wider["cumulative"][2] <= 1))


def test_left_out_expansions_take_the_correction_that_has_not_seen_their_group():
    """A fifth of the nodes of cells lose contact, independently, in 20 groups of 100. The expansions are equal, so the
    correction alone moves: its share has the standard error sqrt(p q / n) of 2000, by quantiles sqrt(2) of it."""
    rng = np.random.default_rng(12)
    cells = rng.random((2000, 1))
    points = np.where(rng.random((2000, 1)) < 0.2, 0.0, cells)
    uniform = Drawn(np.tile((np.arange(20_000) + 0.5) / 20_000, (21, 1)))
    edges = EdgeCorrection(cells, points, np.arange(2000) % 20)
    curves, error = changes_by_refits(uniform, edges, [1], np.array([0.5]))
    assert error == pytest.approx(math.sqrt(2 * 0.2 * 0.8 / 2000), rel=0.4)
    assert curves.std() > 0


def test_a_correction_maps_quantiles_to_quantiles():
    """Cells p to points f(p) = max(p - 1, 0): at samples exactly, between them linearly, monotone, and no change of
    what is out of contact."""
    cells = np.array([[0.5, 0.0], [0.0, 0.8], [3.0, 0.0], [7.0, 0.0]])
    edges = EdgeCorrection(cells, np.maximum(cells - 1, 0), np.arange(4))
    drawn = np.array([0.0, 0.3, 0.8, 1.9, 3.0, 5.0, 7.0, 9.0])
    np.testing.assert_allclose(edges.apply(drawn), [0, 0, 0, 1, 2, 4, 6, 8], atol=1e-15)
    np.testing.assert_array_equal(EdgeCorrection(cells, cells, np.arange(4)).apply(drawn), drawn)


def test_the_distance_of_two_samples_is_that_of_scipy():
    """With and without ties, of either length; the samples are in ascending order."""
    rng = np.random.default_rng(14)
    for first, second in ((300, 1000), (1000, 300), (1, 7)):
        for rounded in (np.asarray, np.round):
            one, other = np.sort(rounded(rng.normal(0.3, 2.0, first))), np.sort(rounded(rng.normal(0, 2.0, second)))
            assert distance(one, other) == pytest.approx(
                stats.ks_2samp(one, other, method="asymp").statistic, abs=1e-15
            )


def test_numbers_of_several_designs_are_their_mean_with_students_interval():
    """Three designs, of the reference's own pressures and of these scaled by 0.7 and 1.3."""
    one = reference(surfaces=200_000)
    own = np.sort(one.pressure[one.pressure > 0])
    pressures = np.stack([own, own * 0.7, own * 1.3])
    rows = drawn_rows(pressures, one)
    distances = np.array([0.0, *(distance(own * scale, own) for scale in (0.7, 1.3))])
    mean, low, high = rows["distance_in_contact"]
    assert mean == pytest.approx(distances.mean(), rel=1e-9)
    student = 4.302653 * distances.std(ddof=1) / math.sqrt(3)  # t(0.975, 2) = 4.302653
    assert high - mean == pytest.approx(math.hypot(student, 0.98 / math.sqrt(one.contacts)), rel=1e-4)
    assert low == 0.0
    curve, lowest, highest = rows["cumulative"]
    assert np.all((lowest <= curve) & (curve <= highest))
    assert between({"a": pressures, "b": pressures})[0] == 0.0
    assert between({"a": pressures[:2], "b": pressures[1:]})[0] == pytest.approx(
        (distances[1] + distance(own * 0.7, own * 1.3)) / 2
    )
    assert np.isnan(between({"a": pressures})).all()


def test_equations_in_contact_are_compared_with_the_solved_samples_and_each_with_its_design():
    """Scaled by 2, an exponential law has half the probability near zero: one factor of two in the tail."""
    one = reference(surfaces=200_000)
    own = np.sort(one.pressure[one.pressure > 0])
    designs, levels = [own, 2.0 * own], Reference(one.pressure, one.surfaces, np.quantile(own, [0.02, 0.05, 0.08]))
    rows = given_rows(np.stack([2.0 * own, 4.0 * own]), len(own), designs, levels, resolved_by_designs(designs))
    assert resolved_by_designs([own[:1000], own]) == 5 / 1000
    ratio, *_ = rows["tail_error_of_design"]
    assert ratio == pytest.approx(math.log10(2.0), rel=0.1)
    expected = np.mean([distance(scale * own, own) for scale in (2.0, 4.0)])
    assert rows["distance"][0] == pytest.approx(expected)
    assert NORMAL_95 / 2 * math.sqrt(2 / len(own)) < rows["distance"][2] - rows["distance"][0]
