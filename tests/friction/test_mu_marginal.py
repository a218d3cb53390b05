"""Marginals of the friction process: Beta with its paper's shapes, and what was measured."""

import math

import numpy as np
import pytest
from scipy.special import betaincinv, ndtr
from scipy.stats import beta as beta_distribution

from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction.process import BetaMarginal, EmpiricalMarginal, FrictionProcess
from roughslip.friction.translation import translate

GRID = np.linspace(0.0, 1.0, 1001)


@pytest.mark.parametrize(("a", "b"), [(2.1, 5.0), (0.3, 3.0), (0.5, 0.5), (90.0, 300.0)])
def test_moments_of_beta(a, b):
    marginal = BetaMarginal(a, b, -1.0, 3.0)
    law = beta_distribution(a, b, loc=-1.0, scale=4.0)
    assert marginal.mean == pytest.approx(law.mean(), rel=1e-13)
    assert marginal.standard_deviation == pytest.approx(law.std(), rel=1e-12)
    again = BetaMarginal.of_moments(a, b, marginal.mean, marginal.standard_deviation)
    assert (again.lower, again.upper) == (pytest.approx(-1.0, abs=1e-12), pytest.approx(3.0, abs=1e-12))


@pytest.mark.parametrize(("a", "b"), [(2.1, 5.0), (0.3, 3.0), (0.5, 0.5)])
def test_table_error_is_a_bound(a, b):
    """Linear interpolation between the table's nodes against scipy's quantile."""
    marginal = BetaMarginal(a, b, -1.0, 1.0)
    table = translate(marginal)
    z = np.random.default_rng(3).uniform(-6.0, 6.0, 20_000)
    worst = np.max(np.abs(table.apply(z) + marginal.mean - (2.0 * betaincinv(a, b, ndtr(z)) - 1.0)))
    assert 0.3 * table.table_error < worst <= 1.01 * table.table_error < 1e-5


def test_series_of_the_uniform_distribution():
    """Phi(z) has the correlation (6 / pi) asin(r / 2), a closed form of Pearson."""
    table = translate(BetaMarginal(1.0, 1.0, 0.0, 1.0))
    r = np.linspace(0.0, 1.0, 11)
    assert table.correlation(r) == pytest.approx(6.0 / math.pi * np.arcsin(r / 2.0), abs=1e-7)
    target = np.linspace(0.0, 1.0, 11)
    assert table.gaussian_correlation(target) == pytest.approx(2.0 * np.sin(math.pi * target / 6.0), abs=1e-7)


def test_quantiles_of_a_beta_distribution_are_that_distribution():
    """A thousand quantiles give its table to a hundredth of the scatter, chords between them near the ends included."""
    beta = BetaMarginal(2.1, 5.0, 0.1, 0.7)
    measured = EmpiricalMarginal(betaincinv(2.1, 5.0, GRID), beta.mean, beta.standard_deviation)
    exact, found = translate(beta), translate(measured)
    inner = np.abs(exact.normal) < 3.0
    assert found.friction[inner] == pytest.approx(exact.friction[inner], abs=0.01 * beta.standard_deviation)
    z = np.random.default_rng(0).standard_normal(10**6)
    values = found.apply(z)
    assert values.mean() == pytest.approx(0.0, abs=5e-3 * beta.standard_deviation)  # 5 standard errors of 1e6 draws
    assert values.std() == pytest.approx(beta.standard_deviation, rel=5e-3)
    assert found.weights[:2] == pytest.approx(exact.weights[:2], abs=1e-3)


def test_moments_of_the_quantiles_do_not_matter():
    """Shift and unit of what was measured go; a distribution mirrored is mirrored."""
    q = betaincinv(2.1, 5.0, GRID)
    z = np.linspace(-3.0, 3.0, 13)
    plain = EmpiricalMarginal(q, 0.3, 0.05).centred(z)
    assert EmpiricalMarginal(40.0 + 7.0 * q, 0.3, 0.05).centred(z) == pytest.approx(plain, abs=1e-11)
    assert EmpiricalMarginal(-q[::-1], 0.3, 0.05).centred(-z) == pytest.approx(-plain, abs=1e-11)


def test_an_empirical_marginal_without_scatter_is_nothing():
    assert not np.any(translate(EmpiricalMarginal(GRID, 0.3, 0.0)).friction)


def test_steps_are_refused():
    """Two values only: nearly all the variance in a step, whose series converges as 1 / n."""
    with pytest.raises(IllPosedError, match="close to steps"):
        translate(EmpiricalMarginal(np.where(GRID < 0.5, 0.0, 1.0), 0.3, 0.05))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"a": 0.0}, r"\.a "),
        ({"b": math.nan}, r"\.b "),
        ({"lower": 0.5, "upper": 0.4}, "support"),
        ({"upper": math.inf}, "support"),
    ],
)
def test_beta_refuses(change, message):
    with pytest.raises(ParameterError, match=message):
        BetaMarginal(**({"a": 2.1, "b": 5.0, "lower": 0.1, "upper": 0.7} | change))


@pytest.mark.parametrize(
    ("quantiles", "mean", "std", "error", "message"),
    [
        (np.arange(5.0), 0.3, 0.1, ParameterError, "quantiles"),
        (-GRID, 0.3, 0.1, ParameterError, "quantiles"),
        (np.full(20, np.nan), 0.3, 0.1, ParameterError, "quantiles"),
        (GRID, 0.3, -0.1, ParameterError, "standard deviation"),
        (GRID, math.nan, 0.1, ParameterError, "mean"),
        (np.full(20, 0.3), 0.3, 0.1, IllPosedError, "all equal"),
    ],
)
def test_empirical_refuses(quantiles, mean, std, error, message):
    with pytest.raises(error, match=message):
        EmpiricalMarginal(quantiles, mean, std)


@pytest.mark.parametrize("length", [0.0, -1.0, math.inf, math.nan])
def test_process_refuses(length):
    with pytest.raises(ParameterError, match="correlation_length_m"):
        FrictionProcess(BetaMarginal(2.1, 5.0, 0.0, 1.0), length)
