"""Isoprobabilistic transformation: Hermite series, the correlation it brings, and its correction beforehand."""

import math

import numpy as np
import pytest
import scipy.fft
from scipy.special import factorial
from scipy.stats import kstest

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.surface import translation as module
from roughslip.surface.empirical import empirical_marginal
from roughslip.surface.marginal import Marginal
from roughslip.surface.translation import corrected_correlation, nearest_correlation, translate

BETA = Marginal("beta", 2.0, (2.1, 5.0))
SKEWED = Marginal("lognormal", 1.0, (1.0,), mirrored=True)
RHO = np.linspace(-1.0, 1.0, 41)


def torus_lags(n, d=1.0):
    return d * np.minimum(np.arange(n), n - np.arange(n))


def test_the_paper_s_beta():
    """Shares of the first four Hermite polynomials and the largest change of the correlation on [0, 1]."""
    translation = translate(BETA)
    np.testing.assert_allclose(translation.shares[:4], [0.97146, 0.02369, 0.00427, 0.00050], atol=5e-6)
    assert translation.correlation_change == pytest.approx(0.0078, abs=5e-5)
    assert translation.left_out < 1e-12
    assert translation.quadrature_error < 1e-14


def test_gaussian_is_left_alone():
    translation = translate(Marginal("gaussian", 3.0))
    g = np.linspace(-8.0, 8.0, 33)
    np.testing.assert_allclose(translation.apply(g), 3.0 * g, atol=1e-13)
    np.testing.assert_allclose(translation.correlation(RHO), RHO, atol=1e-14)
    np.testing.assert_allclose(translation.gaussian_correlation(RHO), RHO, atol=1e-12)


@pytest.mark.parametrize("s", [0.2, 0.7, 1.0])
def test_lognormal_in_closed_form(s):
    """c_n^2 proportional to s^(2n) / n!, rho_z = (exp(s^2 rho) - 1) / (exp(s^2) - 1)."""
    translation = translate(Marginal("lognormal", 1.0, (s,)))
    n = np.arange(1, 6)
    # cut off at 8.5, the second moment misses Phi(-(8.5 - 2 s)), 4e-11 for s = 1
    np.testing.assert_allclose(translation.shares[:5], s ** (2 * n) / factorial(n) / math.expm1(s**2), atol=1e-10)
    np.testing.assert_allclose(translation.correlation(RHO), np.expm1(s**2 * RHO) / math.expm1(s**2), atol=2e-10)


def test_uniform_and_exponential_in_closed_form():
    """Uniform: rho_z = (6 / pi) asin(rho / 2). Exponential: least correlation 1 - pi^2 / 6."""
    uniform = translate(Marginal("beta", 1.0, (1.0, 1.0)))
    np.testing.assert_allclose(uniform.correlation(RHO), 6 / math.pi * np.arcsin(RHO / 2), atol=1e-11)
    exponential = translate(Marginal("weibull", 1.0, (1.0,)))
    assert exponential.least_correlation == pytest.approx(1 - math.pi**2 / 6, abs=1e-10)


@pytest.mark.parametrize(
    "marginal", [BETA, SKEWED, Marginal("beta", 1.0, (0.3, 0.4)), Marginal("weibull", 1.0, (0.6,))]
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
        product = (weight * z) @ second @ weight / marginal.rms_height_m**2
        assert translation.correlation(rho) == pytest.approx(product, abs=2e-7)
    least = np.sum(weight * z * z[::-1]) / marginal.rms_height_m**2
    assert translation.least_correlation == pytest.approx(least, abs=1e-6)


@pytest.mark.parametrize("marginal", [BETA, SKEWED, Marginal("beta", 1.0, (0.3, 3.0))])
def test_inverse(marginal):
    translation = translate(marginal)
    wanted = np.linspace(translation.least_correlation, 1.0, 301)
    rho = translation.gaussian_correlation(wanted)
    np.testing.assert_allclose(translation.correlation(rho), wanted, atol=1.1e-12)
    assert np.all(np.diff(rho) > 0.0)
    assert translation.gaussian_correlation(0.0) == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(IllPosedError, match="allows none below"):
        translation.gaussian_correlation(np.array([0.3, translation.least_correlation - 1e-3]))


def test_table_error_is_a_bound():
    for marginal in (BETA, SKEWED):
        translation = translate(marginal)
        g = np.random.default_rng(1).uniform(-6.0, 6.0, 50_000)
        worst = np.max(np.abs(translation.apply(g) - marginal.from_gaussian(g)))
        assert 0.3 * translation.table_error_m < worst <= 1.01 * translation.table_error_m
        assert translation.table_error_m < 1e-6 * np.max(np.abs(marginal.from_gaussian(np.array([-6.0, 6.0]))))
    far = translation.apply(np.array([-50.0, 50.0]))
    np.testing.assert_array_equal(far, translation.heights[[0, -1]])


@pytest.mark.parametrize("marginal", [BETA, Marginal("lognormal", 1.0, (0.6,), mirrored=True)])
def test_samples_have_marginal_and_covariance(marginal):
    """10 000 translated fields on a torus of 12 x 8 whose heights shall have exp(-r / 2).

    Covariance averaged over each torus, independent between samples: 35 distinct lags, |t| < 4.8 is 6e-5 together.
    Marginal of one node a sample: KS at 1e-6.
    """
    translation = translate(marginal)
    shape = (12, 8)
    wanted = np.exp(-np.hypot(*np.meshgrid(torus_lags(12), torus_lags(8), indexing="ij")) / 2)
    field = corrected_correlation(translation, wanted)
    assert field.deviation < 1e-10
    root = np.sqrt(np.maximum(scipy.fft.fft2(field.gaussian).real, 0.0))
    noise = np.random.default_rng([5, 10_000]).standard_normal((10_000, *shape))
    z = translation.apply(scipy.fft.ifft2(root * scipy.fft.fft2(noise)).real)

    power = np.abs(scipy.fft.fft2(z / marginal.rms_height_m)) ** 2 / z[0].size
    products = scipy.fft.ifft2(power).real[:, :7, :5]
    t = (products.mean(axis=0) - field.translated[:7, :5]) / (products.std(axis=0) / 100.0)
    assert np.max(np.abs(t)) < 4.8
    assert kstest(z[:, 3, 4], marginal.cdf).statistic < math.sqrt(-0.5 * math.log(0.5e-6) / 10_000)
    plane = marginal.quantile(1 - 30 / 100)
    assert np.mean(z[:, 0, 0] > plane) == pytest.approx(0.3, abs=5 * math.sqrt(0.21 / 10_000))


def test_uncorrected_correlation_would_show():
    change = translate(SKEWED).correlation_change
    rho = np.linspace(0.0, 1.0, 100_001)
    assert change == pytest.approx(np.max(rho - np.expm1(rho) / math.expm1(1.0)), abs=1e-7)
    assert change > 0.12


def test_what_can_be_had_is_exact():
    """A correlation made by translation comes back: nothing is cut, the deviation is rounding."""
    translation = translate(SKEWED)
    gaussian = np.exp(-((torus_lags(64) / 3.0) ** 2))
    wanted = translation.correlation(gaussian)
    found = corrected_correlation(translation, wanted)
    np.testing.assert_allclose(found.gaussian, gaussian, atol=1e-10)
    assert found.negative_share < 1e-11
    assert found.below_least == 0.0
    assert found.deviation < 1e-10


def test_below_the_least_correlation():
    """A cosine cannot be had by a lognormal marginal, whose correlations end at -exp(-1) for s = 1."""
    translation = translate(SKEWED)
    wanted = np.cos(2 * math.pi * np.arange(32) / 32)
    with pytest.raises(IllPosedError, match=r"below the least possible -0\.3679.* nearest deviates by 0\.\d+"):
        corrected_correlation(translation, wanted)
    nearest = nearest_correlation(translation, wanted)
    assert nearest.below_least == pytest.approx(1 - math.exp(-1), abs=1e-9)
    assert nearest.deviation >= nearest.below_least


def test_negative_spectrum():
    """A triangle, a valid correlation in itself, asks a skewed marginal for a Gaussian spectrum with negative parts."""
    translation = translate(Marginal("lognormal", 1.0, (1.5,)))
    wanted = np.maximum(1.0 - torus_lags(64) / 12.0, 0.0)
    assert scipy.fft.fft(wanted).real.min() > -1e-12
    with pytest.raises(IllPosedError, match="of the spectrum needed is negative"):
        corrected_correlation(translation, wanted)
    nearest = nearest_correlation(translation, wanted)
    assert nearest.negative_share > 1e-4
    asked = np.maximum(scipy.fft.fft(translation.gaussian_correlation(wanted)).real, 0.0)
    np.testing.assert_allclose(scipy.fft.fft(nearest.gaussian).real, asked * (64 / asked.sum()), atol=1e-12)
    assert nearest.below_least == 0.0
    assert scipy.fft.fft(nearest.gaussian).real.min() > -1e-12
    assert nearest.gaussian[0] == pytest.approx(1.0, abs=1e-13)
    assert nearest.deviation == pytest.approx(np.max(np.abs(nearest.translated - wanted)), rel=1e-12)
    np.testing.assert_allclose(nearest.translated, translation.correlation(nearest.gaussian), atol=1e-14)
    again = corrected_correlation(translation, nearest.translated)  # and that one can be had
    np.testing.assert_allclose(again.gaussian, nearest.gaussian, atol=1e-8)
    allowed = corrected_correlation(translation, wanted, negative_share=1.0)
    np.testing.assert_array_equal(allowed.gaussian, nearest.gaussian)


def test_an_empirical_marginal_translates():
    """Weibull heights measured, then translated to: shares within the sampling error of 40 000 heights."""
    law = Marginal("weibull", 1e-6, (1.5,), mirrored=True)
    heights = law.from_gaussian(np.random.default_rng(8).standard_normal(40_000))
    measured, exact = translate(empirical_marginal(heights)), translate(law)
    assert measured.left_out < 1e-5
    assert 1e-12 < measured.quadrature_error < 1e-6  # bends at the nodes
    np.testing.assert_allclose(measured.shares[:3], exact.shares[:3], atol=0.005)
    np.testing.assert_allclose(measured.correlation(RHO), exact.correlation(RHO), atol=0.01)


def test_steps_are_refused():
    with pytest.raises(IllPosedError, match="leave out"):
        translate(Marginal("beta", 1.0, (0.02, 0.02)))


def test_a_decreasing_quantile_function_is_refused():
    class Falling:
        rms_height_m = 1.0

        def from_gaussian(self, normal):
            return -normal

    with pytest.raises(ParameterError, match="increase"):
        translate(Falling())


def test_an_inverse_that_stalls_is_an_error(monkeypatch):
    monkeypatch.setattr(module, "CORRELATION_ERROR", 0.0)
    with pytest.raises(ConvergenceError, match="less skewed"):
        translate(SKEWED).gaussian_correlation(np.linspace(0.1, 0.9, 7))


@pytest.mark.parametrize(
    ("correlation", "message"),
    [
        (np.array([1.0, 0.5, 0.2, 0.1]), "even"),
        (np.array([0.9, 0.5, 0.5]), "lag zero"),
        (np.array([1.0, math.nan, math.nan]), "between -1 and 1"),
        (np.array([1.0, 1.5, 1.5]), "between -1 and 1"),
        (np.ones((2, 2, 2)), "row or a table"),
    ],
)
def test_what_is_no_correlation_on_a_torus_is_refused(correlation, message):
    with pytest.raises(ParameterError, match=message):
        nearest_correlation(translate(BETA), correlation)


def test_fields_must_be_finite():
    with pytest.raises(ParameterError, match="finite"):
        translate(BETA).apply(np.array([0.0, math.nan]))
