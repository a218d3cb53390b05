"""Tests of normality that keep their level when the cycles of a run hang together."""

import math

import numpy as np
import pytest
from scipy import stats

from roughslip.errors import IllPosedError, ParameterError
from roughslip.oscillator import normality as module
from roughslip.oscillator.normality import NULLS, anderson_darling, normality


def sequences(rng, runs, events, rho):
    """(runs, events) stationary first-order Gaussian sequences."""
    values = rng.standard_normal((runs, events))
    for k in range(1, events):
        values[:, k] = rho * values[:, k - 1] + math.sqrt(1 - rho**2) * values[:, k]
    return values


def judged(values, seed=0):
    owner = np.repeat(np.arange(len(values)), values.shape[1])
    return normality(0.003 + 1e-4 * values.ravel(), owner, np.random.default_rng(seed))


def test_statistics_of_independent_events_are_the_textbook_ones():
    values = np.random.default_rng(0).gamma(30.0, size=(40, 50))
    found, n = judged(values), values.size
    assert found.anderson_darling == pytest.approx(anderson_darling(values.ravel()), rel=1e-9)
    # scipy standardises by n - 1: (n - 1) / n in the square of z, of which A^2 changes by as much at most
    ad = stats.anderson(values.ravel(), "norm", method="interpolate").statistic
    assert found.anderson_darling == pytest.approx(ad, rel=20 / n)
    jb = n / 6 * found_skewness(values) ** 2 + n / 24 * stats.kurtosis(values.ravel()) ** 2
    assert stats.jarque_bera(values.ravel()).statistic == pytest.approx(jb, rel=1e-12)
    # noise of rho, 1 / sqrt(n), to the third power at 98 lags
    assert found.jarque_bera == pytest.approx(jb, rel=0.01)
    assert found.jarque_bera_p == pytest.approx(stats.chi2.sf(found.jarque_bera, 2), rel=1e-9)


def found_skewness(values):
    return stats.skew(values.ravel())


def test_autocorrelation_and_effective_numbers(monkeypatch):
    """rho^k of a first-order sequence; S_m = (1 + rho^m) / (1 - rho^m) for long runs."""
    rho, values = 0.7, sequences(np.random.default_rng(1), 400, 200, 0.7)
    monkeypatch.setattr(module, "NULLS", 1)
    found = judged(values)
    # weights (n - k) / n of the estimate, and noise of some sqrt((1 + rho^2) / (1 - rho^2) / 80000) = 0.006
    assert found.autocorrelation[:4] == pytest.approx(rho ** np.arange(4), abs=0.03)
    for power, effective in ((3, found.effective_skewness), (4, found.effective_kurtosis)):
        assert values.size / effective == pytest.approx((1 + rho**power) / (1 - rho**power), rel=0.05)


@pytest.mark.parametrize("rho", [0.0, 0.8])
def test_the_level_holds_for_dependent_normal_events(rho, monkeypatch):
    """80 ensembles at 5 %; of dependent ones a test that takes them for independent rejects a third."""
    monkeypatch.setattr(module, "NULLS", 39)
    trials, rejected, naive = 80, np.zeros(2, int), 0
    for trial in range(trials):
        values = sequences(np.random.default_rng([2, trial]), 20, 40, rho)
        found = judged(values, trial)
        rejected += np.array([found.jarque_bera_p, found.anderson_darling_p]) <= 0.05
        naive += stats.jarque_bera(values.ravel()).pvalue < 0.05
    limit = stats.binom.ppf(0.999, trials, 0.05)
    assert np.all(rejected <= limit)
    assert rejected.sum() > 0
    if rho > 0:
        assert naive > limit


def test_a_skew_law_is_found():
    """Gamma(30) has the skewness 0.37: at 2000 events six standard errors and more."""
    found = judged(np.random.default_rng(3).gamma(30.0, size=(40, 50)))
    assert found.jarque_bera_p < 1e-6
    assert found.anderson_darling_p == 1 / (NULLS + 1)


def test_runs_may_be_of_any_length_and_order():
    """Only the order within a run matters."""
    rng = np.random.default_rng(4)
    lengths = rng.integers(1, 30, 25)
    owner = np.repeat(np.arange(25), lengths)
    position = rng.standard_normal(owner.size)
    order = np.argsort(rng.permutation(25)[owner], kind="stable")
    found = normality(position, owner, np.random.default_rng(5))
    moved = normality(position[order], owner[order], np.random.default_rng(5))
    np.testing.assert_allclose(moved.autocorrelation, found.autocorrelation, rtol=1e-9, atol=1e-12)
    assert moved.anderson_darling == pytest.approx(found.anderson_darling, rel=1e-9)
    assert found.autocorrelation.size == lengths.max()


def test_refuses_what_tells_nothing():
    rng = np.random.default_rng(6)
    with pytest.raises(IllPosedError, match="too few"):
        judged(rng.random((9, 11)))
    with pytest.raises(IllPosedError, match="no scatter"):
        judged(np.zeros((10, 20)))
    with pytest.raises(ParameterError):
        normality(np.full(200, np.nan), np.arange(200), rng)
    with pytest.raises(ParameterError):
        normality(np.zeros(200), np.arange(199), rng)
