"""The correlation of a Gaussian field that gives translated heights the correlation wanted."""

import math

import numpy as np
import pytest
import scipy.fft
from scipy.stats import kstest

from roughslip.errors import IllPosedError, ParameterError
from roughslip.probability import FamilyDistribution, translate
from roughslip.surface.corrected_covariance import corrected_correlation, nearest_correlation

BETA = FamilyDistribution("beta", 2.0, (2.1, 5.0))
SKEWED = FamilyDistribution("lognormal", 1.0, (1.0,), mirrored=True)


def torus_lags(n, d=1.0):
    return d * np.minimum(np.arange(n), n - np.arange(n))


@pytest.mark.parametrize("marginal", [BETA, FamilyDistribution("lognormal", 1.0, (0.6,), mirrored=True)])
def test_samples_have_marginal_and_covariance(marginal):
    """10 000 translated fields on a torus of 12 x 8 whose heights shall have exp(-r / 2).

    Covariance averaged over each torus, independent between samples: 35 distinct lags, |t| < 4.8 is 6e-5 together.
    Distribution of one node a sample: KS at 1e-6.
    """
    translation = translate(marginal)
    shape = (12, 8)
    wanted = np.exp(-np.hypot(*np.meshgrid(torus_lags(12), torus_lags(8), indexing="ij")) / 2)
    field = corrected_correlation(translation, wanted)
    assert field.deviation < 1e-10
    root = np.sqrt(np.maximum(scipy.fft.fft2(field.gaussian).real, 0.0))
    noise = np.random.default_rng([5, 10_000]).standard_normal((10_000, *shape))
    z = translation.apply(scipy.fft.ifft2(root * scipy.fft.fft2(noise)).real)

    power = np.abs(scipy.fft.fft2(z / marginal.standard_deviation)) ** 2 / z[0].size
    products = scipy.fft.ifft2(power).real[:, :7, :5]
    t = (products.mean(axis=0) - field.translated[:7, :5]) / (products.std(axis=0) / 100.0)
    assert np.max(np.abs(t)) < 4.8
    assert kstest(z[:, 3, 4], marginal.cdf).statistic < math.sqrt(-0.5 * math.log(0.5e-6) / 10_000)
    plane = marginal.quantile(1 - 30 / 100)
    assert np.mean(z[:, 0, 0] > plane) == pytest.approx(0.3, abs=5 * math.sqrt(0.21 / 10_000))


def test_uncorrected_correlation_would_show():
    rho = np.linspace(0.0, 1.0, 100_001)
    change = np.max(np.abs(translate(SKEWED).correlation(rho) - rho))
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
    translation = translate(FamilyDistribution("lognormal", 1.0, (1.5,)))
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
