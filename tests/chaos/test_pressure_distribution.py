"""Empirical distributions: against scipy where it has them, else by definition."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from roughslip.chaos.distribution import (
    NORMAL_95,
    cumulative_given_contact,
    kolmogorov_distance,
    quantile_levels,
    wilson_interval,
)
from roughslip.errors import IllPosedError, ParameterError


@settings(derandomize=True, max_examples=50, deadline=None)
@given(st.floats(1e-3, 1e6), st.floats(0, 1))
def test_wilson_ends_are_where_the_score_test_rejects(trials, share):
    """(share - p)^2 = z^2 p (1 - p) / n at both ends, also for the fractions that weights give."""
    for end in wilson_interval(share * trials, trials):
        assert 0 <= end <= 1
        assert (share - end) ** 2 == pytest.approx(NORMAL_95**2 * end * (1 - end) / trials, rel=1e-6, abs=1e-13)


def test_without_trials_nothing_is_known():
    low, high = wilson_interval(np.zeros(2), np.array([0.0, 1e-9]))
    np.testing.assert_allclose([low, high], [[0, 0], [1, 1]], atol=1e-9)


def test_cumulative_counts_positive_pressures_at_most_each_level():
    pressure = np.array([[0.0, 3.0, 1.0], [0.0, 3.0, 7.0]])
    levels = np.array([0.0, 0.5, 1.0, 2.9, 3.0, 7.0, 9.0])
    assert np.array_equal(cumulative_given_contact(pressure, levels), [0, 0, 0.25, 0.25, 0.75, 1, 1])


def test_an_infinite_pressure_lies_above_every_level():
    pressure = np.array([1.0, np.inf, 2.0, 0.0, np.inf])
    assert np.array_equal(cumulative_given_contact(pressure, np.array([1.5, 1e300])), [0.25, 0.5])
    assert kolmogorov_distance(pressure, np.array([0.0, 1.0, 2.0])) == pytest.approx(0.4, rel=1e-15)


def test_levels_are_quantiles_dense_in_both_tails():
    """On 1 ... n the linear quantile at q is 1 + (n - 1) q."""
    n, count, lowest = 1001, 20, 1e-3
    pressure = np.concatenate([np.zeros(500), np.arange(1.0, n + 1)])
    levels = quantile_levels(np.random.default_rng(1).permutation(pressure), lowest, count)
    probability = (levels - 1) / (n - 1)
    assert len(levels) == 2 * count - 1
    assert probability[[0, count - 1, -1]] == pytest.approx([lowest, 0.5, 1 - lowest], rel=1e-12)
    np.testing.assert_allclose(probability + probability[::-1], 1.0, rtol=1e-12)
    np.testing.assert_allclose(np.diff(np.log(probability[:count])), math.log(0.5 / lowest) / (count - 1), rtol=1e-9)


@pytest.mark.parametrize("digits", [None, 1, 0])
@pytest.mark.parametrize("sizes", [(50, 50), (200, 31), (1, 1)])
def test_kolmogorov_distance_with_and_without_ties(sizes, digits):
    rng = np.random.default_rng(2)
    first, second = rng.standard_normal(sizes[0]), 0.3 + 1.5 * rng.standard_normal(sizes[1])
    if digits is not None:
        first, second = np.maximum(first, 0.0).round(digits), np.maximum(second, 0.0).round(digits)
    ours = kolmogorov_distance(first, second)
    assert ours == pytest.approx(stats.ks_2samp(first, second).statistic, abs=1e-15)
    assert kolmogorov_distance(second, first) == ours
    assert kolmogorov_distance(first, np.repeat(first, 3)) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(("successes", "trials"), [(3, 2), (-1, 2), (np.nan, 2), (1, np.inf), (0, -1)])
def test_impossible_counts_are_refused(successes, trials):
    with pytest.raises(ParameterError):
        wilson_interval(successes, trials)


@pytest.mark.parametrize(
    "function",
    [
        lambda p: cumulative_given_contact(p, np.array([1.0])),
        quantile_levels,
        lambda p: kolmogorov_distance(np.ones(3), p),
    ],
)
def test_samples_without_contact_or_with_nan_are_refused(function):
    with pytest.raises(IllPosedError, match="no sample is in contact"):
        function(np.zeros(0))
    with pytest.raises(ParameterError, match="NaN"):
        function(np.array([1.0, np.nan, 2.0]))
