"""Friction paths: what every method has in common, whole paths by Fourier transform, paths by recursion."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import betaincinv, ndtr
from scipy.stats import beta as beta_distribution
from scipy.stats import kstest

from roughslip.errors import IllPosedError
from roughslip.friction.endless import recursion
from roughslip.friction.paths import METHODS, Friction, path_sampler, spectral_representation
from roughslip.friction.process import PIECE_NODES, CorrelationShape, FrictionProcess, average_beta
from roughslip.probability import BetaDistribution, beta_moments

LENGTH = 250e-6
PUBLISHED = FrictionProcess(BetaDistribution(2.1, 5.0, 0.1, 0.7), LENGTH)
SKEWED = FrictionProcess(BetaDistribution(0.3, 3.0, 0.0, 1.0), LENGTH)  # far from normal: the correction is up to 0.1
PROCESSES = pytest.mark.parametrize("process", [PUBLISHED, SKEWED], ids=["published", "skewed"])
WAYS = pytest.mark.parametrize("method", METHODS)


def ensemble(process, spacing, length, paths, method, seed=7):
    prepared = path_sampler(process, spacing, length, method)
    nodes = math.ceil(length / spacing - 1e-9) + 1
    return np.array([beginning(prepared.realisation([seed, k]), nodes) for k in range(paths)])


def beginning(path, nodes):
    nodes_drawn = np.empty(0)
    for piece in path:
        nodes_drawn = np.concatenate((nodes_drawn, piece))
        if nodes_drawn.size >= nodes:
            return nodes_drawn[:nodes]
    raise AssertionError(f"the path ends after {nodes_drawn.size} of {nodes} nodes")


def translated_correlation(process, rho):
    """Correlation of Beta quantiles of two normals of correlation rho by Gauss-Hermite products, no series."""
    z, weight = np.polynomial.hermite_e.hermegauss(120)
    weight = weight / weight.sum()

    def quantile(x):
        return betaincinv(process.marginal.a, process.marginal.b, ndtr(np.clip(x, -8.0, 8.0)))

    mean, square = weight @ quantile(z), weight @ quantile(z) ** 2
    second = quantile(rho * z[:, None] + math.sqrt(1.0 - rho**2) * z[None, :])
    return (weight @ (quantile(z)[:, None] * second) @ weight - mean**2) / (square - mean**2)


@PROCESSES
def test_correlation_is_corrected(process):
    """The Gaussian correlation carried by the spectrum, translated without the series, is the exponential.

    1e-4 is the quadrature's error for a quantile that behaves like a power at its lower end.
    """
    spectrum = spectral_representation(process, LENGTH / 16, 20 * LENGTH)
    share = 2.0 * (spectrum.amplitude / spectrum.period_nodes) ** 2
    share[[0, -1]] /= 4.0
    assert share.sum() == pytest.approx(1.0, rel=1e-12)
    k = np.arange(share.size)
    for lag in (1, 4, 16, 48):
        rho = float(share @ np.cos(2.0 * math.pi * k * lag / spectrum.period_nodes))
        assert translated_correlation(process, rho) == pytest.approx(math.exp(-lag / 16), abs=1e-4)
    assert spectrum.correlation_error < 1e-4  # exp(-10) of the wrap


@PROCESSES
@WAYS
def test_marginal_of_an_ensemble(process, method):
    """Nodes 8 correlation lengths apart are independent to 3e-4: KS limit at 1e-6; moments to 5 standard errors."""
    paths = ensemble(process, LENGTH / 4, 2000 * LENGTH, 100, method)
    values = paths[:, ::32].ravel()
    marginal = process.marginal
    distribution = beta_distribution(marginal.a, marginal.b, loc=marginal.lower - marginal.mean, scale=marginal.scale)
    limit = math.sqrt(-0.5 * math.log(0.5e-6) / values.size)
    assert kstest(values, distribution.cdf).statistic < limit < 0.02
    skewness, kurtosis = distribution.stats(moments="sk")
    for power, exact in ((1, 0.0), (2, 1.0), (3, float(skewness)), (4, 3.0 + float(kurtosis))):
        moments = np.mean((paths / marginal.standard_deviation) ** power, axis=1)
        assert moments.mean() == pytest.approx(exact, abs=5 * moments.std(ddof=1) / math.sqrt(moments.size))
    assert values.min() >= marginal.lower - marginal.mean
    assert values.max() <= marginal.upper - marginal.mean


TRIANGLE = CorrelationShape(np.array([0.0, 2.0]), np.array([1.0, 0.0]))  # of a window over what is not correlated
# Two lengths of a pad under whose short waves long ones lie, and a window over white pressure.
PAD = CorrelationShape.of_lags(LENGTH * np.array([0.0, 0.5, 1.0, 4.0, 8.0]), np.array([1.0, 0.5, 0.2, 0.1, 0.0]))[1]
SHAPES = pytest.mark.parametrize("shape", [TRIANGLE, PAD], ids=["triangle", "pad"])


@SHAPES
@pytest.mark.parametrize("nodes", [2, 4, 16])
def test_moving_average_has_the_autocorrelation_asked_for(shape, nodes):
    """Of the weights, summed directly and translated by products of Gauss and Hermite, not by the series. The triangle
    is missed by 1e-3, where the weights are cut."""
    process = FrictionProcess(PUBLISHED.marginal, LENGTH, shape)
    average = path_sampler(process, LENGTH / nodes)
    h = average.weights
    assert h @ h == pytest.approx(1.0)
    for lag in {1, nodes // 2, nodes, 3 * nodes}:
        reached = translated_correlation(process, float(h[lag:] @ h[:-lag]))
        assert reached == pytest.approx(float(process.autocorrelation(lag * LENGTH / nodes)), abs=2.5e-3)
    assert average.correlation_error < 2e-3


@SHAPES
def test_moving_average_is_the_plain_sum(shape):
    """z_k = sum_j h_j e_(k - j) of the noise of the seed, before and after the first block."""
    average = path_sampler(FrictionProcess(PUBLISHED.marginal, LENGTH, shape), LENGTH / 4)
    h, count = average.weights, PIECE_NODES + 400
    noise = np.random.default_rng([5]).standard_normal(2 * count)
    plain = average.translation.apply(np.convolve(noise, h, "valid")[:count])
    path = beginning(average.realisation([5]), count)
    np.testing.assert_allclose(path, plain, atol=1e-12)


def test_a_shape_that_no_process_has_is_refused():
    """A box is no covariance: its transform, a sinc, has negative parts. Nor is the triangle, whose transform touches
    zero, once it is corrected for a far skewed marginal; but there is one nearby, and the error says so."""
    box = CorrelationShape(np.array([0.0, 0.999, 1.0]), np.array([1.0, 1.0, 0.0]))
    with pytest.raises(IllPosedError, match=r"misses the one wanted by 0\.5"):
        path_sampler(FrictionProcess(PUBLISHED.marginal, LENGTH, box), LENGTH / 16)
    average, waves = (
        path_sampler(FrictionProcess(SKEWED.marginal, LENGTH, TRIANGLE), LENGTH / 16, 0.01, method)
        for method in METHODS
    )
    assert average.correlation_error == pytest.approx(0.028, abs=0.002)
    assert waves.correlation_error == pytest.approx(0.028, abs=0.002)
    reached = translated_correlation(SKEWED, float(average.weights[16:] @ average.weights[:-16]))
    assert reached == pytest.approx(0.5, abs=average.correlation_error)


shapes = st.floats(0.4, 200.0)


@settings(derandomize=True, max_examples=100, deadline=None)
@given(shapes, shapes, st.integers(1, 1000))
def test_cumulants_fall_as_those_of_a_mean(a, b, windows):
    mean, std, skewness, excess = beta_moments(a, b)
    mean_of_all = average_beta(BetaDistribution(a, b, 0.2, 0.7), windows)
    moments = beta_moments(mean_of_all.a, mean_of_all.b)
    assert 0.2 + 0.5 * mean == pytest.approx(mean_of_all.mean, rel=1e-9)
    assert mean_of_all.standard_deviation == pytest.approx(0.5 * std / np.sqrt(windows), rel=1e-9)
    # skewness^2 and kurtosis of shapes a, b are differences of numbers of order 1 / (a + b): rounding grows with a + b
    rounding = 1e-13 * (a + b) ** 2 + 1e-9
    assert moments[2] == pytest.approx(skewness / np.sqrt(windows), abs=rounding)
    assert moments[3] == pytest.approx(excess / windows, abs=rounding)


BORDER = [(0.1, 0.1), (0.05, 3.0), (2.1, 5.0), (0.1, 300.0), (90.0, 300.0)]


def process_of(a, b):
    return FrictionProcess(BetaDistribution(a, b, 0.0, 1.0), LENGTH)


def state_covariance(built):
    """P with P = diag(rho) P diag(rho) + c c' by doubling the number of past steps that it sums, not in closed form."""
    decay, total = built.decay, np.outer(built.gain, built.gain)
    for _ in range(60):
        total = total + decay[:, None] * total * decay
        decay = decay**2
    return total


def test_a_recursion_is_its_plain_sum_piece_after_piece():
    """The state of the seed, then a number a node; the second piece goes on where the first ends."""
    built, nodes = recursion(PUBLISHED, LENGTH / 16), PIECE_NODES + 50
    generator = np.random.default_rng([1, 2])
    state, z = built.start @ generator.standard_normal(built.decay.size), np.empty(nodes)
    for k in range(nodes):
        z[k] = state.sum()
        state = built.decay * state + built.gain * generator.standard_normal()
    path = beginning(built.realisation([1, 2]), nodes)
    np.testing.assert_allclose(path, built.translation.apply(z), atol=1e-12)


@pytest.mark.parametrize(("a", "b"), BORDER)
@pytest.mark.parametrize("nodes", [0.1, 0.25, 16, 1000])
def test_errors_are_those_of_what_was_built(a, b, nodes):
    """The covariance of the state, summed step by step, gives the reported errors of the autocorrelation, and the
    Cholesky factor in closed form gives that covariance."""
    built = recursion(process_of(a, b), LENGTH / nodes)
    covariance = state_covariance(built)
    size = np.abs(covariance).max()
    assert covariance.sum() == pytest.approx(1.0, abs=1e-12 * size)
    assert built.start @ built.start.T == pytest.approx(covariance, abs=1e-9 * size)
    lags = np.unique(np.geomspace(1, 20 * max(nodes, 1), 40).astype(int))
    gaussian = np.array([(built.decay**lag @ covariance).sum() for lag in lags])
    wanted = np.exp(-lags / nodes)
    missed = np.abs(built.translation.correlation(gaussian) - wanted)
    rounding = 1e-13 * size
    assert np.max(missed) <= built.correlation_error + rounding
    assert np.max(missed / (1.0 - wanted)) <= built.increment_error + rounding * nodes
    assert built.correlation_error <= 1e-3
    assert len(built.decay) <= 30.0 * nodes  # more decays exp(-i / nodes) would vanish against one


@pytest.mark.parametrize(("shapes", "terms"), [((1000.0, 1000.0), 1), ((90.0, 300.0), 2), ((2.1, 5.0), 3)])
def test_few_exponentials_are_enough(shapes, terms):
    """One for a marginal that is nearly normal, the Ornstein-Uhlenbeck recursion; three for the paper's."""
    built = recursion(process_of(*shapes), LENGTH / 16)
    assert built.decay == pytest.approx(np.exp(-np.arange(1, terms + 1) / 16), rel=1e-14)
    assert built.correlation_error < 1e-6


def test_friction_of_a_pad_follows_from_that_of_one_window():
    """Four independent windows halve the deviation; where it multiplies, mu_S is in units of the mean."""
    four = Friction(0.3, 0.04, LENGTH, windows=4.0)
    assert (four.pad_deviation, four.path_deviation) == (pytest.approx(0.02), pytest.approx(0.02))
    assert four.process.marginal.mean == pytest.approx(0.3)
    assert four.process.marginal.standard_deviation == pytest.approx(0.02)
    times = Friction(0.3, 0.04, LENGTH, windows=4.0, multiplies=True)
    assert times.path_deviation == pytest.approx(0.02 / 0.3)
    assert times.process.marginal.mean == pytest.approx(1.0)
    assert times.process.marginal.standard_deviation == pytest.approx(0.02 / 0.3)
    changed = times.changed(mean=0.6, windows=1.0, length_m=2 * LENGTH)
    assert (changed.deviation, changed.path_deviation) == (pytest.approx(0.08), pytest.approx(0.08 / 0.6))
    assert changed.autocorrelation(np.array([2 * LENGTH])) == pytest.approx(math.exp(-1.0))
    pad = Friction(0.3, 0.04, LENGTH, windows=9.0, pad=lambda n, length: (n / 2.25, 3 * length, TRIANGLE))
    assert (pad.pad_deviation, pad.correlation_length_m) == (pytest.approx(0.02), pytest.approx(3 * LENGTH))
    assert pad.autocorrelation(3 * LENGTH * np.array([0.0, 1.0, 2.5])) == pytest.approx([1.0, 0.5, 0.0])
    assert pad.paths(4).spacing == pytest.approx(0.75 * LENGTH)
