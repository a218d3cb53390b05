"""Autocorrelation of mu and lengths of the exponential fitted to it, against closed forms and white windows."""

import math

import numpy as np
import pytest

from roughslip.errors import IllPosedError
from roughslip.friction.correlation import (
    autocorrelation,
    correlation_fit,
    exponential_length,
    log_line,
    one_over_e_length,
    triangular,
    window_lengths,
)
from roughslip.friction.windows import strip_weights, window_sums
from tests.friction.test_windows import autoregressive

WINDOW = 600e-6


def averaged_white_noise(rng: np.random.Generator, strips: int, window: int, windows: int) -> np.ndarray:
    """mu = 1 + white noise averaged over windows of `window` nodes that start at every fifth node."""
    noise = rng.standard_normal((strips, window + 5 * (windows - 1)))
    return 1.0 + 0.1 * window_sums(noise, window, 5) / math.sqrt(window)


def test_an_exponential_has_its_own_length_and_a_curve_without_one_the_end_of_the_range() -> None:
    lags = np.arange(121) * 15e-6
    true = np.array([20e-6, 250e-6, 1500e-6])
    curves = np.exp(-lags / true[:, None])
    lengths = exponential_length(lags, curves)
    np.testing.assert_allclose(lengths, true, rtol=1e-12)
    # linear interpolation of exp(-s/L) between lags h apart is off by at most h^2 / (8 L) in s
    np.testing.assert_allclose(one_over_e_length(lags, curves[:2]), true[:2], atol=(15e-6) ** 2 / 8 / 20e-6)
    # curves without a length: the ends of the range, and the longest lag where 1/e is not met
    lags = np.arange(50) * 1e-5
    alternating = np.where(np.arange(50) % 2 == 0, 1.0, -1.0) * np.exp(-np.arange(50.0))
    lengths = exponential_length(lags, np.stack((np.ones(50), alternating)))
    np.testing.assert_allclose(lengths, [100 * lags[-1], lags[1] / 20], rtol=1e-12)
    assert one_over_e_length(lags, np.ones((1, 50)))[0] == lags[-1]


def test_autocorrelation_is_the_mean_over_pairs_of_valid_windows() -> None:
    rng = np.random.default_rng(1)
    mu = 1.0 + 0.1 * autoregressive(rng, 6, 9, 0.7)
    valid = rng.random(mu.shape) > 0.2
    weights = strip_weights(6, 40, rng)
    r = autocorrelation(mu, valid, 5, weights)
    for row in (0, 7, 23):
        strips = np.repeat(np.arange(6), weights[row])
        x, ok = mu[strips], valid[strips]
        x = x - np.mean(x[ok])
        for k in range(5):
            pairs = [x[s, i] * x[s, i + k] for s in range(6) for i in range(9 - k) if ok[s, i] and ok[s, i + k]]
            expected = np.mean(pairs) / np.mean(x[ok] ** 2)
            # sums of 54 products in another order
            assert r.rows[row, k] == pytest.approx(expected, abs=1e-12)
    assert (r.rows[:, 0] == 1.0).all()


def test_white_noise_averaged_on_windows_is_triangular() -> None:
    rng = np.random.default_rng(2)
    mu = averaged_white_noise(rng, 400, 40, 25)
    weights = strip_weights(400, 200, rng)
    lags = np.arange(25) * WINDOW / 8
    r = autocorrelation(mu, np.ones(mu.shape, bool), 25, weights)
    error = np.std(r.replicates, axis=1)
    # 24 correlated lags: 4 standard errors are exceeded once in 600 such tests
    assert np.all(np.abs(r.value - triangular(lags, WINDOW))[1:] < 4 * error[1:])
    fit = correlation_fit(lags, r, WINDOW)
    assert fit.misfit_difference.low > 0.0  # the triangle is nearer
    assert fit.misfit_triangle.low == 0.0
    for name, of_window in window_lengths(lags, WINDOW).items():
        e = getattr(fit, name)
        assert abs(e.value - of_window) < 4 * np.std(e.replicates), name


def test_ornstein_uhlenbeck_windows_have_their_length() -> None:
    rng = np.random.default_rng(3)
    spacing, length = WINDOW / 20, 250e-6
    mu = 1.0 + 0.1 * autoregressive(rng, 300, 61, math.exp(-spacing / length))
    lags = np.arange(61) * spacing
    fit = correlation_fit(lags, autocorrelation(mu, np.ones(mu.shape, bool), 61, strip_weights(300, 200, rng)), WINDOW)
    for name in ("least_squares", "one_over_e", "log_line"):
        e = getattr(fit, name)
        # 300 strips of 1800 um hold some 300 * 1800 / 500 = 1080 independent pieces: error of a length some 5 %
        assert np.std(e.replicates) < 0.1 * length, name
        assert abs(e.value - length) < 4 * np.std(e.replicates), name
    assert fit.misfit_difference.high < 0.0  # the exponential is nearer
    # the misfits of a curve within a few per cent of the exponential
    assert fit.misfit_exponential.low == 0.0
    assert fit.misfit_triangle.value > 0.05


def test_faults_are_refused() -> None:
    rng = np.random.default_rng(7)
    mu = 1.0 + 0.1 * autoregressive(rng, 5, 6, 0.5)
    weights = strip_weights(5, 40, rng)
    for lags in (1, 7):
        with pytest.raises(IllPosedError, match="longer strips"):
            autocorrelation(mu, np.ones(mu.shape, bool), lags, weights)
    ends = np.ones(mu.shape, bool)
    ends[:, 1:] = False  # single windows: no pair at any lag
    with pytest.raises(IllPosedError, match="no pair"):
        autocorrelation(mu, ends, 2, weights)
    with pytest.raises(IllPosedError, match="no scatter"):
        autocorrelation(np.full(mu.shape, 0.3), np.ones(mu.shape, bool), 3, weights)
    with pytest.raises(IllPosedError, match="half a window"):
        window_lengths(np.arange(5.0), 1.5)


@pytest.mark.parametrize(
    ("share", "length"), [(0.5, 440e-6), (0.7, 366e-6), (0.8, 324e-6), (0.9, 275e-6), (0.95, 246e-6)]
)
def test_a_straight_line_through_the_logarithm_of_a_triangle_depends_on_its_largest_lag(share, length):
    """Of a window of 600 µm, by quadrature of the least squares, and on lags 0.06 µm apart."""
    x = np.linspace(0.0, share, 200_001)
    slope = np.trapezoid((x - share / 2) * np.log1p(-x), x) / (share**3 / 12)
    assert 600e-6 / -slope == pytest.approx(length, abs=0.5e-6)
    lags = np.linspace(0.0, 600e-6, 10_001)
    fitted = log_line(lags, triangular(lags, 600e-6)[None], share * 600e-6)
    assert fitted[0] == pytest.approx(length, rel=2e-3)
    lengths = window_lengths(np.arange(721) * 2.5e-6, WINDOW)  # 1/e is met at T (1 - 1/e)
    assert lengths["one_over_e"] == pytest.approx(WINDOW * (1 - math.exp(-1)), rel=1e-12)
    assert lengths["least_squares"] == pytest.approx(320e-6, abs=0.5e-6)
    assert lengths["log_line"] == pytest.approx(275e-6, rel=0.02)


def test_a_straight_line_finds_an_exponential_and_ends_before_the_curve_falls_to_zero():
    lags = 15e-6 * np.arange(41)
    curve = np.exp(-lags / 250e-6)
    cut = np.where(np.arange(41) < 20, curve, -0.1)
    late = np.where(np.arange(41) < 25, cut, 0.5)  # noise beyond the first crossing does not count
    np.testing.assert_allclose(log_line(lags, np.stack([curve, cut, late]), 540e-6), 250e-6, rtol=1e-12)
    flat, alone = np.ones(41), np.where(np.arange(41) < 1, 1.0, -0.2)
    np.testing.assert_allclose(log_line(lags, np.stack([flat, alone]), 540e-6), [100 * lags[-1], lags[1] / 20])
