"""The likelihood of scatter seen through an instrument: against dense covariances, on records whose truth is known."""

import numpy as np
import pytest
from scipy import stats

from roughslip.record.fit import _best_shape
from roughslip.record.likelihood import Samples, fitted_process
from roughslip.record.process import SHAPES, Course, Scatter, through_instrument, whitened


@pytest.mark.parametrize("shape", SHAPES)
def test_the_correlation_length_is_the_integral(shape):
    lags = np.linspace(0.0, 60.0, 60_001)
    rho = Scatter(shape, 1.0).autocorrelation(lags)
    assert rho[0] == pytest.approx(1.0)
    assert np.trapezoid(rho, lags) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("shape", SHAPES)
def test_whitening_is_that_of_the_dense_covariance(shape):
    """Uneven steps, an instrument with memory, a factor of the scatter, noise, and a second record that forgets."""
    generator, n, second, noise = np.random.default_rng(3), 200, 110, 0.1
    step, memory = generator.uniform(0.01, 0.3, n), generator.uniform(0.2, 0.7, n)
    step[[0, second]], weight = -1.0, generator.uniform(0.5, 1.5, n)
    found, covariance = Scatter(shape, 1.0), noise * np.eye(n)
    for first, last in ((0, second), (second, n)):
        place = np.cumsum(np.append(0.0, step[first + 1 : last]))
        shown = np.zeros((last - first, last - first))
        for t in range(last - first):
            keep = memory[first + t] if t else 0.0
            shown[t] = keep * shown[t - 1] if t else 0.0
            shown[t, t] = (1.0 - keep) * weight[first + t]
        within = found.autocorrelation(np.abs(place[:, None] - place))
        covariance[first:last, first:last] += shown @ within @ shown.T
    columns, root = generator.standard_normal((n, 3)), np.linalg.cholesky(covariance)
    white, log_det = whitened(found, Course(step, memory, weight), noise, columns)
    assert white == pytest.approx(np.linalg.solve(root, columns), abs=1e-11)
    assert log_det == pytest.approx(2.0 * np.sum(np.log(np.diag(root))), abs=1e-10)
    dense = stats.multivariate_normal(cov=covariance).logpdf(columns.T)
    assert -0.5 * (np.sum(white**2, axis=0) + log_det + n * np.log(2.0 * np.pi)) == pytest.approx(dense, rel=1e-10)


def test_synthetic_scatter_has_its_autocorrelation():
    """Over 4000 lengths the autocorrelation at a lag errs by some 1 / sqrt(4000); five of these are allowed."""
    place = np.arange(40_000) * 0.1
    for scatter in (Scatter(shape, 1.0) for shape in SHAPES):
        path = scatter.path(place, np.random.default_rng(5))
        wanted = scatter.autocorrelation(np.arange(30) * 0.1)
        found = [np.mean(path[: path.size - k] * path[k:]) for k in range(30)]
        assert found == pytest.approx(wanted, abs=5.0 / np.sqrt(4000.0))


def test_a_fit_sees_through_the_instrument():
    """Scatter 0.02 with length 1 mm, a low-pass of two samples, noise 0.01: each within four of its errors."""
    generator, n = np.random.default_rng(8), 1500
    step, memory = np.full(n, 1e-4), np.full(n, np.exp(-0.5))
    path = 0.02 * Scatter("exponential", 1e-3).path(np.cumsum(step), generator)
    friction = 0.3 + through_instrument(path, memory) + 0.01 * generator.standard_normal(n)
    step[0] = -1.0
    samples = Samples(friction, np.full(n, 0.1), step, np.full(n, 1e-3), np.zeros(n))
    fit = fitted_process(samples, np.ones((n, 1)), "exponential", None, np.ones(n))
    errors = np.sqrt(np.diag(fit.log_covariance))
    assert np.abs(np.log([fit.deviation / 0.02, fit.scatter.length / 1e-3])) == pytest.approx(
        [0, 0], abs=4 * errors.max()
    )
    assert errors == pytest.approx(
        [0.08, 0.24], rel=0.4
    )  # 150 lengths: sqrt(1 / 150); noise and low-pass widen the other
    assert fit.noise == pytest.approx(0.01, rel=0.1)
    assert fit.time_constant == pytest.approx(2e-3, rel=0.5)


def chosen(truth, seed, n):
    """The best shape for n samples of 100 lengths, noise of a quarter of the scatter, a known low-pass."""
    generator = np.random.default_rng([seed, 11])
    step = np.exp(0.7 * np.abs(np.arange(n) / n * 4.0 % 2.0 - 1.0))
    step *= 0.1 / np.sum(step)
    path = 0.02 * Scatter(truth, 1e-3).path(np.cumsum(step), generator)
    friction = 0.3 + through_instrument(path, np.full(n, np.exp(-1.0))) + 0.005 * generator.standard_normal(n)
    step[0] = -1.0
    samples, ones = Samples(friction, np.full(n, 0.1), step, np.full(n, 1e-3), np.zeros(n)), np.ones(n)
    simple = fitted_process(samples, ones[:, None], "exponential", 1e-3, ones)
    return _best_shape(samples, ones[:, None], 1e-3, simple)


def inside(fit, errors):
    """Whether standard deviation and length are right within so many standard errors."""
    missed = np.abs(np.log([fit.deviation / 0.02, fit.scatter.length / 1e-3]))
    return missed <= errors * np.sqrt(np.diag(fit.log_covariance))


def test_a_record_tells_a_triangle_from_an_exponential():
    """400 samples of 100 lengths."""
    for seed in range(3):
        triangle = chosen("triangle", seed, 400)
        assert triangle.scatter.shape == "triangle"
        assert inside(triangle, 4.0).all()
        assert chosen("exponential", seed, 400).scatter.shape == "exponential"
