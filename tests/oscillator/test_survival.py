"""Censored lifetimes against textbook values, intervals that cover as often as they say."""

import math

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import isotonic_regression

from roughslip.errors import IllPosedError, ParameterError
from roughslip.oscillator.survival import (
    Spells,
    crossing,
    damping_band,
    falling_share,
    mean_lifetime,
)


def test_mean_lifetime_by_hand():
    """Two ends in 30 periods; chi-square with 6 and 4 degrees of freedom."""
    lifetime = mean_lifetime(Spells(np.array([5.0, 10.0, 15.0]), np.array([True, False, True])))
    assert lifetime == pytest.approx([15, 60 / stats.chi2.ppf(0.975, 6), 60 / stats.chi2.ppf(0.025, 4)], rel=1e-12)
    value, low, high = mean_lifetime(Spells(np.array([30.0]), np.array([False])))
    assert (value, high) == (math.inf, math.inf)
    assert low == pytest.approx(30 / -math.log(0.025), rel=1e-12)  # P(no end) = 2.5 % there
    with pytest.raises(IllPosedError, match="no run"):
        mean_lifetime(Spells(np.empty(0), np.empty(0, bool)))


@pytest.mark.slow
def test_the_interval_of_the_mean_covers_it_as_often_as_it_says():
    """Lifetimes of mean 40 cut off at 25, 20 a trial: between exact (0.95) and conservative."""
    rng, trials = np.random.default_rng(0), 2000
    drawn = 40 * rng.standard_exponential((trials, 20))
    held = 0
    for row in drawn:
        _, low, high = mean_lifetime(Spells(np.minimum(row, 25), row < 25))
        held += low <= 40 <= high
    assert held / trials >= 0.95 - 4 * math.sqrt(0.95 * 0.05 / trials)
    assert held / trials <= 0.985


def test_falling_share_is_the_isotonic_regression():
    assert falling_share(np.array([1, 0.5, 0.7, 0.2])) == pytest.approx([1, 0.6, 0.6, 0.2], rel=1e-15)
    shares = np.random.default_rng(1).random((20, 9))
    expected = [isotonic_regression(row, increasing=False).x for row in shares]
    np.testing.assert_allclose(falling_share(shares), expected, rtol=1e-13)


def test_crossing_by_hand():
    damping = np.array([0.1, 0.2, 0.4])
    shares = np.array([[1.0, 0.8, 0.0], [1.0, 0.5, 0.5], [0.4, 0.2, 0.0], [0.9, 0.9, 0.6]])
    np.testing.assert_allclose(crossing(damping, shares, 0.5), [0.275, np.nan, np.nan, np.nan])
    np.testing.assert_allclose(crossing(damping, shares[:2], 0.9), [0.15, 0.12])


@pytest.mark.slow
def test_band_of_normal_tolerances():
    """Every run survives up to a damping of its own, normal of mean 0.3 and deviation 0.02. The quantile at a share p
    of n runs errs by sqrt(p (1 - p) / n) / phi deviations; intervals hold the truth in 19 of 20 trials."""
    damping, levels, runs = np.linspace(0.22, 0.38, 33), (0.9, 0.5, 0.1), 200
    truth = 0.3 + 0.02 * stats.norm.ppf(1 - np.array(levels))
    error = 0.02 * np.sqrt([0.09 / runs, 0.25 / runs, 0.09 / runs]) / stats.norm.pdf(stats.norm.ppf(levels))
    trials, held = 40, 0
    for trial in range(trials):
        rng = np.random.default_rng([2, trial])
        survived = damping < 0.3 + 0.02 * rng.standard_normal((runs, 1))
        band = damping_band(damping, survived, levels, rng)
        assert np.all(np.abs(band[:, 0] - truth) < 4.5 * error)
        held += np.count_nonzero((band[:, 1] <= truth) & (truth <= band[:, 2]))
    # the three levels of a trial are correlated, at most alike
    assert held / (3 * trials) == pytest.approx(0.95, abs=4 * math.sqrt(0.95 * 0.05 / trials))


def test_what_the_ensemble_does_not_hold_is_refused():
    rng = np.random.default_rng(3)
    damping, survived = np.linspace(0.1, 0.5, 5), np.ones((10, 5), bool)
    with pytest.raises(IllPosedError, match="widen them"):
        damping_band(damping, survived, (0.5,), rng)
    with pytest.raises(ParameterError, match="ascend"):
        damping_band(damping[::-1], survived, (0.5,), rng)
    # Half of 200 runs outlive the last damping in 2.7 % of all replicates where 86 do, in 6.8 % where 89 do (binomial).
    last = np.arange(200)[:, None] < [200, 86]
    assert damping_band(damping[:2], last, (0.5,), rng)[0, 0] == pytest.approx(0.1 + 0.1 * 0.5 / 0.57)
    last[:89, 1] = True
    with pytest.raises(IllPosedError, match="widen them"):
        damping_band(damping[:2], last, (0.5,), rng)
