"""Ensemble statistics: moments and intervals as in scipy."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from roughslip.oscillator.cycles import REPLICATES, count_difference, reattachment_statistics, row_of
from roughslip.oscillator.motion import simulate
from tests.oscillator.motions import LAW, STUDY, machine


def statistics_of(position, seed=0):
    owner = np.repeat(np.arange(len(position)), position.shape[1])
    return reattachment_statistics(position.ravel(), owner, np.random.default_rng(seed))


def test_count_difference_by_hand():
    stochastic = np.array([[40, 0], [42, 0], [44, 0], [42, 0], [40, 0], [44, 0], [42, 1], [42, 7]])
    counts = count_difference(np.array([47, 3]), stochastic)
    assert np.array_equal(counts.mean, [42, 1])
    assert np.array_equal(counts.difference, [5, 2])
    assert counts.standard_error == pytest.approx([math.sqrt(16 / 7 / 8), math.sqrt(42 / 7 / 8)], rel=1e-14)
    assert counts.high - counts.difference == pytest.approx(stats.t.ppf(0.975, 7) * counts.standard_error, rel=1e-12)
    assert counts.difference - counts.low == pytest.approx(stats.t.ppf(0.975, 7) * counts.standard_error, rel=1e-12)


def test_where_slip_is_too_stiff_to_follow_the_share_of_stick_slip_is_not_known():
    """At 1e-7 kg a loop takes more steps than there are; all other counts of a motion stand."""
    made, motion = machine(1e-4), simulate(STUDY, LAW, duration_periods=20.0)
    stiff = replace(made, oscillator=replace(made.oscillator, mass_kg=1e-7))
    known, unknown = (row_of(one, motion) for one in (made, stiff))
    assert 0.0 < known[3] <= 1.0
    assert math.isnan(unknown[3])
    assert unknown[:3] == known[:3]


@pytest.mark.parametrize("sign", [1, -1])
def test_moments_are_the_textbook_ones(sign):
    """About 0.012 with a scatter of 1e-4: sums about the mean of all lose no digits to that ratio."""
    position = 0.012 + sign * 1e-4 * np.random.default_rng(2).gamma(3.0, size=(20, 15))
    statistics = statistics_of(position)
    sample = position.ravel()
    assert statistics.mean[0] == pytest.approx(sample.mean(), rel=1e-14)
    assert statistics.std[0] == pytest.approx(sample.std(), rel=1e-12)
    assert statistics.skewness[0] == pytest.approx(stats.skew(sample), rel=1e-11)
    assert statistics.kurtosis[0] == pytest.approx(stats.kurtosis(sample), rel=1e-11)
    normal = stats.norm(sample.mean(), sample.std())
    assert statistics.distance_to_normal[0] == pytest.approx(stats.kstest(sample, normal.cdf).statistic, rel=1e-10)
    assert (statistics.events, statistics.realisations) == (300, 20)
    for name in ("mean", "std", "skewness", "kurtosis", "distance_to_normal"):
        value, low, high = getattr(statistics, name)
        assert low < value < high


def test_intervals_are_percentiles_of_resampled_runs():
    """The same draws, with every event of a run repeated as often as its run was drawn; sums differ in rounding.

    They are widened to Student's of 8 degrees of freedom for the mean and 8 / 3 for the others, and those of log std
    are reflected.
    """
    position = np.random.default_rng(13).gamma(2.0, size=(9, 7))
    statistics = statistics_of(position, seed=14)
    drawn = np.random.default_rng(14).multinomial(9, np.full(9, 1 / 9), size=REPLICATES)
    samples = np.array([np.repeat(position, counts, axis=0).ravel() for counts in drawn])
    replicates = {
        "mean": samples.mean(axis=1),
        "std": samples.std(axis=1),
        "skewness": stats.skew(samples, axis=1),
        "kurtosis": stats.kurtosis(samples, axis=1),
    }
    for name, values in replicates.items():
        freedom = 8.0 if name == "mean" else 8.0 / 3.0
        margin = stats.t.ppf(0.975, freedom) / stats.norm.ppf(0.975) * math.sqrt(9 / 8)
        value, *ends = np.log(statistics.std) if name == "std" else getattr(statistics, name)
        away = np.quantile(np.log(values) if name == "std" else values, [0.025, 0.975]) - value
        expected = value + margin * (-away[::-1] if name == "std" else away)
        np.testing.assert_allclose(ends, expected, rtol=1e-9)
    values, whole = np.sort(position.ravel()), stats.norm(position.mean(), position.std())
    moved = []
    for sample, mean, std in zip(samples, replicates["mean"], replicates["std"], strict=True):
        normals = stats.norm(mean, std).cdf(values) - whole.cdf(values)
        for side in ("left", "right"):
            steps = np.searchsorted(np.sort(sample), values, side) / 63 - np.searchsorted(values, values, side) / 63
            moved.append(np.max(np.abs(steps - normals)))
    radius = np.quantile(np.max(np.reshape(moved, (-1, 2)), axis=1), 0.95)
    distance = statistics.distance_to_normal
    assert distance[1:] == pytest.approx([max(distance[0] - radius, 0.0), distance[0] + radius], rel=1e-10)
