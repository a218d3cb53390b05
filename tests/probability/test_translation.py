"""Translation of Gaussian variables: table, Hermite series, correlation there and back."""

import math

import numpy as np
import pytest
from scipy.special import betaincinv, factorial

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.friction.process import FrictionProcess
from roughslip.probability import (
    BetaDistribution,
    FamilyDistribution,
    QuantileDistribution,
    empirical_distribution,
    translate,
)
from roughslip.probability import translation as module

BETA = FamilyDistribution("beta", 2.0, (2.1, 5.0))
SKEWED = FamilyDistribution("lognormal", 1.0, (1.0,), mirrored=True)
RHO = np.linspace(-1.0, 1.0, 41)


def table_of(marginal):
    """The translation with the table and the series of friction processes."""
    return FrictionProcess(marginal, 1.0).translation()


def test_the_beta_of_the_paper():
    """Shares of the first four Hermite polynomials and the largest change of the correlation on [0, 1]."""
    translation = translate(BETA)
    np.testing.assert_allclose(translation.shares[:4], [0.97146, 0.02369, 0.00427, 0.00050], atol=5e-6)
    rho = np.linspace(0.0, 1.0, 4097)
    assert np.max(np.abs(translation.correlation(rho) - rho)) == pytest.approx(0.0078, abs=5e-5)
    assert translation.left_out < 1e-12
    assert translation.quadrature_error < 1e-14


def test_a_gaussian_stays_as_it_is():
    translation = translate(FamilyDistribution("gaussian", 3.0))
    g = np.linspace(-8.0, 8.0, 33)
    np.testing.assert_allclose(translation.apply(g), 3.0 * g, atol=1e-13)
    np.testing.assert_allclose(translation.correlation(RHO), RHO, atol=1e-14)


@pytest.mark.parametrize("s", [0.2, 0.7, 1.0])
def test_lognormal_in_closed_form(s):
    """c_n^2 proportional to s^(2n) / n!, rho_z = (exp(s^2 rho) - 1) / (exp(s^2) - 1)."""
    translation = translate(FamilyDistribution("lognormal", 1.0, (s,)))
    n = np.arange(1, 6)
    # cut off at 8.5, the second moment misses Phi(-(8.5 - 2 s)), 4e-11 for s = 1
    np.testing.assert_allclose(translation.shares[:5], s ** (2 * n) / factorial(n) / math.expm1(s**2), atol=1e-10)
    np.testing.assert_allclose(translation.correlation(RHO), np.expm1(s**2 * RHO) / math.expm1(s**2), atol=2e-10)


def test_uniform_and_exponential_in_closed_form():
    """Uniform: rho_z = (6 / pi) asin(rho / 2) and its inverse (Pearson). Exponential: at least 1 - pi^2 / 6."""
    uniform, friction = FamilyDistribution("beta", 1.0, (1.0, 1.0)), BetaDistribution(1.0, 1.0, 0.0, 1.0)
    for translation, error in ((translate(uniform), 1e-10), (table_of(friction), 1e-7)):
        r = RHO[RHO >= 0]
        np.testing.assert_allclose(translation.correlation(RHO), 6 / math.pi * np.arcsin(RHO / 2), atol=error)
        np.testing.assert_allclose(translation.gaussian_correlation(r), 2 * np.sin(math.pi * r / 6), atol=error)
    exponential = translate(FamilyDistribution("weibull", 1.0, (1.0,)))
    assert exponential.least_correlation == pytest.approx(1 - math.pi**2 / 6, abs=1e-10)


@pytest.mark.parametrize(
    "marginal", [BETA, SKEWED, FamilyDistribution("beta", 1.0, (0.3, 0.4)), FamilyDistribution("weibull", 1.0, (0.6,))]
)
def test_correlation_against_a_double_integral(marginal):
    """E z(g) z(rho g + sqrt(1 - rho^2) h) by the trapezoidal rule in both variables, without series or table.

    256 nodes a side resolve every one of these far below 1e-7 but the beta with unbounded density.
    """
    translation = translate(marginal)
    g = np.linspace(-8.5, 8.5, 257)
    weight = np.exp(-(g**2) / 2) * (g[1] - g[0]) / math.sqrt(2 * math.pi)
    z = marginal.from_gaussian(g)
    for rho in (-0.9, -0.3, 0.5, 0.95):
        second = marginal.from_gaussian(rho * g[:, None] + math.sqrt(1 - rho**2) * g[None, :])
        product = (weight * z) @ second @ weight / marginal.standard_deviation**2
        assert translation.correlation(rho) == pytest.approx(product, abs=2e-7)
    least = np.sum(weight * z * z[::-1]) / marginal.standard_deviation**2
    assert translation.least_correlation == pytest.approx(least, abs=1e-6)


@pytest.mark.parametrize("marginal", [BETA, SKEWED, FamilyDistribution("beta", 1.0, (0.3, 3.0))])
def test_inverse(marginal):
    translation = translate(marginal)
    wanted = np.linspace(translation.least_correlation, 1.0, 301)
    rho = translation.gaussian_correlation(wanted)
    np.testing.assert_allclose(translation.correlation(rho), wanted, atol=1.1e-12)
    assert np.all(np.diff(rho) > 0.0)
    assert translation.gaussian_correlation(0.0) == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(IllPosedError, match="allows none below"):
        translation.gaussian_correlation(np.array([0.3, translation.least_correlation - 1e-3]))


@pytest.mark.parametrize("marginal", [BETA, SKEWED, *(BetaDistribution(*ab, -1, 1) for ab in ((2.1, 5), (0.3, 3)))])
def test_table_error_is_a_bound(marginal):
    """Of heights, and of friction coefficients on their coarser table."""
    if isinstance(marginal, BetaDistribution):
        translation, exact = table_of(marginal), lambda g: marginal.scale * marginal.centred(g)
    else:
        translation, exact = translate(marginal), marginal.from_gaussian
    g = np.random.default_rng(1).uniform(-6.0, 6.0, 50_000)
    worst = np.max(np.abs(translation.apply(g) - exact(g)))
    assert 0.3 * translation.table_error < worst <= 1.01 * translation.table_error < 1e-5 * np.ptp(exact(g))
    far = translation.apply(np.array([-50.0, 50.0]))
    np.testing.assert_array_equal(far, translation.values[[0, -1]])


def test_an_empirical_marginal_translates():
    """Weibull heights measured, then translated to: shares within the sampling error of 40 000 heights."""
    law = FamilyDistribution("weibull", 1e-6, (1.5,), mirrored=True)
    heights = law.from_gaussian(np.random.default_rng(8).standard_normal(40_000))
    measured, exact = translate(empirical_distribution(heights)), translate(law)
    assert measured.left_out < 1e-5
    assert 1e-12 < measured.quadrature_error < 1e-6  # bends at the nodes
    np.testing.assert_allclose(measured.shares[:3], exact.shares[:3], atol=0.005)
    np.testing.assert_allclose(measured.correlation(RHO), exact.correlation(RHO), atol=0.01)


def test_steps_are_refused():
    with pytest.raises(IllPosedError, match="leaves out"):
        translate(FamilyDistribution("beta", 1.0, (0.02, 0.02)))
    with pytest.raises(IllPosedError, match="close to steps"):
        table_of(QuantileDistribution(np.repeat((0.0, 1.0), 500), 0.3, 0.05))


def test_quantiles_of_a_beta_give_its_table():
    """A thousand quantiles give the table to a hundredth of the scatter, chords between them near the ends included."""
    beta = BetaDistribution(2.1, 5.0, 0.1, 0.7)
    quantiles = betaincinv(2.1, 5.0, np.linspace(0.0, 1.0, 1001))
    exact, table = table_of(beta), table_of(QuantileDistribution(quantiles, beta.mean, beta.standard_deviation))
    inner = np.abs(exact.normal) < 3.0
    assert table.values[inner] == pytest.approx(exact.values[inner], abs=0.01 * beta.standard_deviation)
    values = table.apply(np.random.default_rng(0).standard_normal(10**6))
    assert values.mean() == pytest.approx(0.0, abs=5e-3 * beta.standard_deviation)  # 5 standard errors of 1e6 draws
    assert values.std() == pytest.approx(beta.standard_deviation, rel=5e-3)
    assert table.shares[:2] == pytest.approx(exact.shares[:2], abs=1e-3)
    assert not np.any(table_of(QuantileDistribution(quantiles, 0.3, 0.0)).values)


def test_a_decreasing_quantile_function_and_a_stalled_inverse_are_errors(monkeypatch):
    class Falling:
        standard_deviation = 1.0

        def from_gaussian(self, normal):
            return -normal

    with pytest.raises(ParameterError, match="increase"):
        translate(Falling())
    monkeypatch.setattr(module, "CORRELATION_ERROR", 0.0)
    monkeypatch.setattr(module, "WORST_CORRELATION_ERROR", 0.0)
    with pytest.raises(ConvergenceError, match="less skewed"):
        translate(SKEWED).gaussian_correlation(np.linspace(0.1, 0.9, 7))
