"""Distributions of Beta type and of measured values; translation of Gaussian variables: table, series, correlation."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from scipy import stats
from scipy.special import factorial, log_ndtr, ndtri

from roughslip.errors import IllPosedError
from roughslip.friction.process import FrictionProcess
from roughslip.probability import BetaDistribution, beta_moments, empirical_distribution, translate

UM = 1e-6


@dataclass(frozen=True)
class Lognormal:
    """(exp(s g) - E) / deviation, or mirrored: of deviation one, with closed forms of its correlations."""

    s: float
    mirrored: bool = False
    standard_deviation = 1.0

    def from_gaussian(self, normal):
        sign, square = -1.0 if self.mirrored else 1.0, self.s**2
        values = np.exp(sign * self.s * normal) - math.exp(square / 2)
        return sign * values / math.sqrt(math.exp(square) * math.expm1(square))


@dataclass(frozen=True)
class Weibull:
    """Of shape k and a deviation; mirrored it is a plateau with valleys, no height above its top."""

    k: float
    standard_deviation: float = 1.0
    mirrored: bool = False

    def from_gaussian(self, normal):
        sign, exact = -1.0 if self.mirrored else 1.0, stats.weibull_min(self.k)
        values = (-log_ndtr(-sign * normal)) ** (1 / self.k) - exact.mean()
        return sign * self.standard_deviation * values / exact.std()

    def quantile(self, probability):
        return self.from_gaussian(ndtri(probability))


PLATEAU = Weibull(1.5, UM, mirrored=True)


def plateau(n):
    return PLATEAU.from_gaussian(np.random.default_rng(1).standard_normal(n))


@pytest.mark.parametrize(("a", "b"), [(2.1, 5.0), (5.0, 2.1), (1.0, 1.0), (0.3, 3.0), (90.0, 300.0)])
def test_a_beta_is_that_of_scipy_in_both_tails(a, b):
    """Of a deviation given, about its mean; and its first four moments."""
    distribution, exact = BetaDistribution.of_moments(a, b, 0.3, UM), stats.beta(a, b)
    p = np.array([1e-12, 1e-5, 0.03, 0.5, 0.9])
    lower, upper = ((x - exact.mean()) / exact.std() for x in (exact.ppf(p), exact.isf(p)))
    np.testing.assert_allclose(distribution.from_gaussian(ndtri(p)), UM * lower, rtol=1e-7, atol=1e-12 * UM)
    np.testing.assert_allclose(distribution.from_gaussian(-ndtri(p)), UM * upper, rtol=1e-7, atol=1e-12 * UM)
    assert (distribution.mean, distribution.standard_deviation) == (pytest.approx(0.3), pytest.approx(UM, rel=1e-9))
    mean, std, *shape = beta_moments(a, b)
    assert (mean, std, *shape) == pytest.approx((exact.mean(), exact.std(), *exact.stats("sk")), rel=1e-9, abs=1e-12)


def test_a_beta_is_finite_where_scipy_is_not():
    """betaincinv of scipy 1.17 is NaN at these shapes below p = 1e-16, where x is the end of the support."""
    (a, b), scores = (1.035035428873854, 0.688317738616233), np.array([-8.5, -8.4])
    np.testing.assert_allclose(BetaDistribution(a, b, 0.0, 1.0).centred(scores), -a / (a + b), rtol=1e-14)
    np.testing.assert_allclose(BetaDistribution(b, a, 0.0, 1.0).centred(-scores), a / (a + b), rtol=1e-14)


def test_an_empirical_distribution_follows_the_values():
    """Quantiles within sampling error, 5 standard errors sqrt(p (1 - p) / n) / density, and curvature."""
    values = plateau(50_000)
    fitted = empirical_distribution(values + 3 * UM)
    assert fitted.standard_deviation == pytest.approx(values.std(), rel=1e-12)
    every = fitted.from_gaussian(ndtri((np.arange(20_000) + 0.5) / 20_000))
    assert np.mean(every) == pytest.approx(0.0, abs=1e-4 * UM)
    p = np.array([0.001, 0.01, 0.1, 0.5, 0.9, 0.99])
    density = 1e-4 * p / (PLATEAU.quantile(1.00005 * p) - PLATEAU.quantile(0.99995 * p))
    error = 5 * np.sqrt(p * (1 - p) / 50_000) / density
    assert np.all(np.abs(fitted.from_gaussian(ndtri(p)) - PLATEAU.quantile(p)) < error + 0.004 * UM)


def test_normal_values_have_a_normal_empirical_distribution_and_every_tail_is_one():
    """Values at the normal scores of their ranks: x = g to the interpolation of steep ends, times the deviation. Beyond
    the outermost node, which leaves ten values, x is linear in the normal score."""
    n = 20_000
    fitted = empirical_distribution(stats.norm.ppf((np.arange(n) + 0.5) / n), standard_deviation=2.0)
    np.testing.assert_allclose(fitted.values, 2.0 * fitted.normal, atol=2e-4)
    assert fitted.standard_deviation == pytest.approx(2.0, rel=1e-12)
    fitted = empirical_distribution(plateau(2000))
    beyond = fitted.normal > stats.norm.isf(10 / 2000)
    slopes = np.diff(fitted.values[beyond]) / np.diff(fitted.normal[beyond])
    np.testing.assert_allclose(slopes, slopes[0], rtol=1e-9)
    assert slopes[0] > 0.0


@pytest.mark.parametrize("others", [[0.0], [30.0], 140 * [5.0]])
def test_mirrored_values_have_the_mirrored_distribution(others):
    """And those in another unit that of the unit; an outlier far beyond one end, whose tail begins there, too.

    Or 4.5 % of the values equal to the highest, so that ranks reach less far at that end."""
    values = np.append(np.round(plateau(3000) / UM, 2), others)
    plain = empirical_distribution(values)
    mirrored, other = empirical_distribution(-values), empirical_distribution(2.0**-20 * values)
    np.testing.assert_allclose(mirrored.values, -plain.values[::-1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(other.values, 2.0**-20 * plain.values, rtol=1e-12)
    wider = empirical_distribution(values, standard_deviation=3.0 * values.std())
    np.testing.assert_allclose(wider.values, 3.0 * plain.values, rtol=1e-12)


@pytest.mark.parametrize("rounding", [1e-16, 1e-7])
def test_a_plateau_that_differs_by_rounding_is_the_plateau(rounding):
    """Of Sq, as removal of a plane and files of single precision leave it: the same table as without.

    A pair of other values as close as TIE may become a tie or cease to be one, which moves a rank by half: 1e-5."""
    generator = np.random.default_rng(0)
    g = generator.standard_normal(40_000)
    flat = np.where((g > 0.2) & (g < 0.8), 0.5, g)
    exact = empirical_distribution(flat * UM)
    fitted = empirical_distribution((flat + rounding * generator.standard_normal(g.size)) * UM)
    np.testing.assert_allclose(fitted.values, exact.values, rtol=0, atol=1e-5 * UM)
    with pytest.raises(IllPosedError, match="at least 100, or Gaussian"):
        empirical_distribution(g[:50])
    clipped = np.minimum(g, 1.0) + rounding * generator.standard_normal(g.size)
    with pytest.raises(IllPosedError, match=r"clipped.*take Gaussian heights"):
        empirical_distribution(clipped * UM)


BETA = BetaDistribution.of_moments(2.1, 5.0, 0.0, 2.0)
SKEWED = Lognormal(1.0, mirrored=True)
RHO = np.linspace(-1.0, 1.0, 41)


@pytest.mark.parametrize("s", [0.2, 1.0])
def test_lognormal_in_closed_form(s):
    """c_n^2 proportional to s^(2n) / n!, rho_z = (exp(s^2 rho) - 1) / (exp(s^2) - 1)."""
    translation = translate(Lognormal(s))
    n = np.arange(1, 6)
    # cut off at 8.5, the second moment misses Phi(-(8.5 - 2 s)), 4e-11 for s = 1
    np.testing.assert_allclose(translation.shares[:5], s ** (2 * n) / factorial(n) / math.expm1(s**2), atol=1e-10)
    np.testing.assert_allclose(translation.correlation(RHO), np.expm1(s**2 * RHO) / math.expm1(s**2), atol=2e-10)


def test_uniform_and_exponential_in_closed_form():
    """Uniform: rho_z = (6 / pi) asin(rho / 2) and its inverse (Pearson). Exponential: at least 1 - pi^2 / 6."""
    uniform = BetaDistribution(1.0, 1.0, 0.0, 1.0)
    for translation, error in ((translate(uniform), 1e-10), (FrictionProcess(uniform, 1.0).translation(), 1e-7)):
        r = RHO[RHO >= 0]
        np.testing.assert_allclose(translation.correlation(RHO), 6 / math.pi * np.arcsin(RHO / 2), atol=error)
        np.testing.assert_allclose(translation.gaussian_correlation(r), 2 * np.sin(math.pi * r / 6), atol=error)
    exponential = translate(Weibull(1.0))
    assert exponential.least_correlation == pytest.approx(1 - math.pi**2 / 6, abs=1e-10)


@pytest.mark.parametrize("marginal", [BETA, SKEWED, BetaDistribution(0.3, 0.4, 0.0, 1.0), Weibull(0.6)])
def test_correlation_against_a_double_integral_and_back(marginal):
    """E z(g) z(rho g + sqrt(1 - rho^2) h) by the trapezoidal rule in both variables, without series or table.

    256 nodes a side resolve every one of these far below 1e-7 but the beta with unbounded density. The table is right
    to 1e-5 of the range of heights, and constant beyond its ends.
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
    wanted = np.linspace(translation.least_correlation, 1.0, 301)
    rho = translation.gaussian_correlation(wanted)
    np.testing.assert_allclose(translation.correlation(rho), wanted, atol=1.1e-12)
    assert np.all(np.diff(rho) > 0.0)
    with pytest.raises(IllPosedError, match="allows none below"):
        translation.gaussian_correlation(np.array([0.3, translation.least_correlation - 1e-3]))
    g = np.random.default_rng(1).uniform(-6.0, 6.0, 50_000)
    exact = marginal.from_gaussian(g)
    assert np.max(np.abs(translation.apply(g) - exact)) < 1e-5 * np.ptp(exact)
    np.testing.assert_array_equal(translation.apply(np.array([-50.0, 50.0])), translation.values[[0, -1]])
