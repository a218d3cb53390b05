"""Statistics with intervals, against quantiles and tables."""

import math

import numpy as np
import pytest
from scipy import stats

from roughslip.probability import Estimate
from roughslip.probability.estimate import interval_margin, student_95, variance_margin

ROWS = np.exp(0.3 * np.random.default_rng(4).standard_normal((41, 2)))  # a sample and 40 replicates of two numbers
LOW, HIGH = np.quantile(ROWS[1:], (0.025, 0.975), axis=0)


def test_a_percentile_interval_and_its_margin():
    plain, wide = Estimate.from_rows(ROWS), Estimate.from_rows(ROWS, 1.5)
    np.testing.assert_allclose((plain.low, plain.high), (LOW, HIGH), rtol=1e-14)
    np.testing.assert_allclose(wide.low, ROWS[0] + 1.5 * (LOW - ROWS[0]), rtol=1e-14)
    np.testing.assert_allclose(wide.high, ROWS[0] + 1.5 * (HIGH - ROWS[0]), rtol=1e-14)
    np.testing.assert_array_equal(plain.rows, ROWS)
    assert plain.replicates.shape == (2, 40)


def test_an_estimate_is_shown_as_a_number_with_its_interval():
    one = Estimate(np.array(0.30012), np.array(0.2983), np.array(0.302444), np.zeros(400))
    assert repr(one) == "0.3001 [0.2983, 0.3024]"
    assert repr(Estimate.from_rows(ROWS)) == "Estimate of shape (2,)"


def test_an_interval_of_a_scale_is_reflected_on_the_logarithm():
    """As far above the value as the replicates lie below it, as a ratio."""
    found = Estimate.of_scale(ROWS, 1.5)
    low, high = np.quantile(np.log(ROWS[1:]), (0.025, 0.975), axis=0)
    np.testing.assert_allclose(found.low, ROWS[0] * np.exp(-1.5 * (high - np.log(ROWS[0]))), rtol=1e-13)
    np.testing.assert_allclose(found.high, ROWS[0] * np.exp(1.5 * (np.log(ROWS[0]) - low)), rtol=1e-13)
    np.testing.assert_allclose(found.rows, ROWS, rtol=1e-14)


def test_a_distance_lies_within_what_resampling_moves_the_curve():
    moved = np.linspace(0.0, 1.0, 101)
    for value, low in ((2.0, 1.05), (0.5, 0.0)):
        found = Estimate.of_distance(np.array([value, 3.0, 4.0]), moved)
        assert (found.value, found.low, found.high) == pytest.approx((value, low, value + 0.95))
        np.testing.assert_array_equal(found.rows, [value, 3.0, 4.0])


@pytest.mark.parametrize("samples", [3, 24, 1000])
def test_margins_for_few_samples(samples):
    """Student's quantile over the normal one; replicates of n numbers scatter by sqrt(1 - 1 / n) too little."""
    quantile = stats.t.ppf(0.975, samples - 1)
    assert student_95(samples) == pytest.approx(quantile, rel=1e-12)
    shown = stats.norm.ppf(0.975) * math.sqrt(1.0 - 1.0 / samples)
    assert interval_margin(samples) * shown == pytest.approx(quantile, rel=1e-12)
    fewer = stats.t.ppf(0.975, max((samples - 1) / 3, 1.0))
    assert interval_margin(samples, 1 / 3) * shown == pytest.approx(fewer, rel=1e-12)
    hidden = stats.chi2.cdf((samples - 1) / variance_margin(samples), samples - 1)  # a variance as much too small
    assert hidden == pytest.approx(0.1, rel=1e-9)
