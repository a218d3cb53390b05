"""The random friction along the belt: Beta marginal, exponential autocorrelation."""

import math

import numpy as np
import pytest
from scipy.special import betaincinv, ndtr
from scipy.stats import beta as beta_distribution
from scipy.stats import kstest

from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction import process as module
from roughslip.friction.process import FrictionProcess, prepare, sample

LENGTH = 250e-6
PUBLISHED = FrictionProcess(2.1, 5.0, 0.1, 0.7, LENGTH)
SKEWED = FrictionProcess(0.3, 3.0, 0.0, 1.0, LENGTH)  # far from normal: the correlation must be corrected by 0.1
PROCESSES = pytest.mark.parametrize("process", [PUBLISHED, SKEWED], ids=["published", "skewed"])


def ensemble(process, spacing, length, paths, seed=7):
    spectrum = prepare(process, spacing, length)
    return np.array([sample(spectrum, np.random.default_rng([seed, k])) for k in range(paths)])


def translated_correlation(process, rho):
    """Correlation of Beta quantiles of two normals of correlation rho by Gauss-Hermite products, no series."""
    z, weight = np.polynomial.hermite_e.hermegauss(120)
    weight = weight / weight.sum()

    def quantile(x):
        return betaincinv(process.a, process.b, ndtr(np.clip(x, -8.0, 8.0)))

    mean, square = weight @ quantile(z), weight @ quantile(z) ** 2
    second = quantile(rho * z[:, None] + math.sqrt(1.0 - rho**2) * z[None, :])
    return (weight @ (quantile(z)[:, None] * second) @ weight - mean**2) / (square - mean**2)


@PROCESSES
def test_correlation_is_corrected(process):
    """The Gaussian correlation carried by the spectrum, translated without the series, is the exponential.

    1e-4 is the quadrature's error for a quantile that behaves like a power at its lower end.
    """
    spectrum = prepare(process, LENGTH / 16, 20 * LENGTH)
    share = 2.0 * (spectrum.amplitude / spectrum.period_nodes) ** 2
    share[[0, -1]] /= 4.0
    assert share.sum() == pytest.approx(1.0, rel=1e-12)
    k = np.arange(share.size)
    for lag in (1, 4, 16, 48):
        rho = float(share @ np.cos(2.0 * math.pi * k * lag / spectrum.period_nodes))
        assert translated_correlation(process, rho) == pytest.approx(math.exp(-lag / 16), abs=1e-4)
    assert spectrum.correlation_error < 1e-4  # exp(-10) of the wrap and the series' remainder
    assert spectrum.clipped == 0.0


def test_uncorrected_correlation_would_show():
    """Without the correction the skewed process misses by more than the 0.01 that is promised."""
    assert abs(translated_correlation(SKEWED, math.exp(-0.5)) - math.exp(-0.5)) > 0.03


@PROCESSES
def test_autocorrelation_of_an_ensemble(process):
    """Products about the known mean, over the known variance, averaged along each path: independent between paths.

    25 lags, 5 standard errors from the scatter of 150 paths: a false alarm in 1e5.
    """
    paths = ensemble(process, LENGTH / 8, 400 * LENGTH, 150) / process.standard_deviation
    for lag in range(25):
        products = np.mean(paths[:, : paths.shape[1] - lag] * paths[:, lag:], axis=1)
        error = products.std(ddof=1) / math.sqrt(products.size)
        assert error < 0.012
        assert products.mean() == pytest.approx(math.exp(-lag / 8), abs=5 * error)


@PROCESSES
def test_marginal_of_an_ensemble(process):
    """Nodes 8 correlation lengths apart are independent to 3e-4: KS limit at 1e-6; moments to 5 standard errors."""
    paths = ensemble(process, LENGTH / 4, 2000 * LENGTH, 100)
    values = paths[:, ::32].ravel()
    scale = process.upper - process.lower
    law = beta_distribution(process.a, process.b, loc=process.lower - process.mean, scale=scale)
    limit = math.sqrt(-0.5 * math.log(0.5e-6) / values.size)
    assert kstest(values, law.cdf).statistic < limit < 0.02
    assert process.mean == pytest.approx(process.lower + scale * process.a / (process.a + process.b), rel=1e-14)
    assert process.standard_deviation == pytest.approx(law.std(), rel=1e-12)
    assert law.mean() == pytest.approx(0.0, abs=1e-15)
    skewness, kurtosis = law.stats(moments="sk")
    for power, exact in ((1, 0.0), (2, 1.0), (3, float(skewness)), (4, 3.0 + float(kurtosis))):
        moments = np.mean((paths / process.standard_deviation) ** power, axis=1)
        assert moments.mean() == pytest.approx(exact, abs=5 * moments.std(ddof=1) / math.sqrt(moments.size))
    assert values.min() >= process.lower - process.mean
    assert values.max() <= process.upper - process.mean


def test_table_error_is_a_bound():
    """Linear interpolation between the table's nodes against scipy's quantile."""
    for process in (PUBLISHED, SKEWED, FrictionProcess(0.5, 0.5, -1.0, 1.0, LENGTH)):
        spectrum = prepare(process, LENGTH / 8, 10 * LENGTH)
        z = np.random.default_rng(3).uniform(-6.0, 6.0, 20_000)
        exact = process.lower + (process.upper - process.lower) * betaincinv(process.a, process.b, ndtr(z))
        found = np.interp(z, spectrum.normal, spectrum.friction) + process.mean
        worst = np.max(np.abs(found - exact))
        assert 0.3 * spectrum.table_error < worst <= 1.01 * spectrum.table_error < 1e-5


def test_paths_follow_the_generator_alone():
    """Same seed, same path; another seed, another; the order of sampling does not matter."""
    spectrum = prepare(PUBLISHED, LENGTH / 16, 0.01)
    first, second = (sample(spectrum, np.random.default_rng([1, k])) for k in (0, 1))
    assert not np.array_equal(first, second)
    assert np.array_equal(second, sample(spectrum, np.random.default_rng([1, 1])))
    assert np.array_equal(first, sample(spectrum, np.random.default_rng([1, 0])))
    again = prepare(PUBLISHED, LENGTH / 16, 0.01)
    assert np.array_equal(first, sample(again, np.random.default_rng([1, 0])))


@pytest.mark.parametrize(("spacing", "length"), [(15e-6, 0.02), (1e-3, 1e-3), (250e-6, 0.01), (3e-6, 1e-6)])
def test_length_and_period(spacing, length):
    spectrum = prepare(PUBLISHED, spacing, length)
    path = sample(spectrum, np.random.default_rng(0))
    assert path.shape == (spectrum.nodes,)
    assert spacing * (path.size - 2) < length * (1 + 1e-9) <= spacing * (path.size - 1) * (1 + 2e-9)
    assert spectrum.period_nodes * spacing >= max(length + 10 * LENGTH, 300 * LENGTH)
    assert np.all(spectrum.amplitude >= 0.0)


def test_no_scatter_is_a_zero_path():
    spectrum = prepare(FrictionProcess(2.1, 5.0, 0.3, 0.3, LENGTH), LENGTH / 16, 0.01)
    assert not np.any(sample(spectrum, np.random.default_rng(0)))


def test_refuses_a_two_point_marginal():
    with pytest.raises(IllPosedError, match="Hermite series"):
        prepare(FrictionProcess(0.02, 0.02, 0.0, 1.0, LENGTH), LENGTH / 16, 0.01)


def test_missed_correlation_is_an_error(monkeypatch):
    """No Beta marginal is known to trip it; so the correction is replaced by one that errs."""
    monkeypatch.setattr(module, "_gaussian_correlation", lambda target, weights: target)
    with pytest.raises(IllPosedError, match="misses the exponential"):
        prepare(SKEWED, LENGTH / 16, 0.01)


def test_negative_spectrum_is_clipped_and_reported(monkeypatch):
    """A triangle cut off too early is no covariance: its transform has negative parts."""
    monkeypatch.setattr(module, "_gaussian_correlation", lambda target, weights: np.where(target > 0.9, 1.0, 0.0))
    monkeypatch.setattr(module, "CORRELATION_TOLERANCE", 2.0)
    spectrum = prepare(PUBLISHED, LENGTH / 16, 0.01)
    assert spectrum.clipped > 0.01
    assert np.all(spectrum.amplitude >= 0.0)
    assert 2.0 * np.sum((spectrum.amplitude[1:-1] / spectrum.period_nodes) ** 2) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"a": 0.0}, r"\.a "),
        ({"b": math.nan}, r"\.b "),
        ({"correlation_length_m": -1.0}, "correlation_length_m"),
        ({"lower": 0.5, "upper": 0.4}, "support"),
        ({"upper": math.inf}, "support"),
    ],
)
def test_process_refuses(change, message):
    valid = {"a": 2.1, "b": 5.0, "lower": 0.1, "upper": 0.7, "correlation_length_m": LENGTH}
    with pytest.raises(ParameterError, match=message):
        FrictionProcess(**(valid | change))


@pytest.mark.parametrize(
    ("spacing", "length", "message"),
    [(0.0, 1.0, "spacing"), (math.nan, 1.0, "spacing"), (1e-5, -1.0, "length"), (1e-9, 1.0, "nodes")],
)
def test_prepare_refuses(spacing, length, message):
    with pytest.raises(ParameterError, match=message):
        prepare(PUBLISHED, spacing, length)
