"""Autocorrelation of mu and lengths of the exponential fitted to it, against closed forms and white windows."""

import math

import numpy as np
import pytest
from scipy import stats

from roughslip.errors import IllPosedError
from roughslip.friction.bowden_tabor import window_sums
from roughslip.friction.correlation import (
    autocorrelation,
    correlation_fit,
    exponential_length,
    log_line,
    one_over_e_length,
    triangle_log_line,
    triangular,
    white_autocorrelation,
    window_lengths,
)
from roughslip.friction.statistics import strip_weights

WINDOW = 600e-6


def averaged_white_noise(rng: np.random.Generator, strips: int, window: int, windows: int) -> np.ndarray:
    """mu = 1 + white noise averaged over windows of `window` nodes that start at every fifth node."""
    noise = rng.standard_normal((strips, window + 5 * (windows - 1)))
    return 1.0 + 0.1 * window_sums(noise, window, 5) / math.sqrt(window)


def ornstein_uhlenbeck(rng: np.random.Generator, strips: int, windows: int, factor: float) -> np.ndarray:
    """mu = 1 + 0.1 x with x Gaussian of unit variance and correlation factor^lag, exactly an exponential."""
    x = rng.standard_normal((strips, windows))
    for k in range(1, windows):
        x[:, k] = factor * x[:, k - 1] + math.sqrt(1.0 - factor**2) * x[:, k]
    return 1.0 + 0.1 * x


def everywhere(mu: np.ndarray) -> np.ndarray:
    return np.ones(mu.shape, bool)


def test_lengths_of_the_window_alone() -> None:
    lags = np.arange(721) * 2.5e-6
    lengths = window_lengths(lags, WINDOW)
    # trapezoids are exact for a triangle whose corner is a node
    assert lengths.integral == pytest.approx(300e-6, rel=1e-12)
    # 1/e is met at T (1 - 1/e)
    assert lengths.one_over_e == pytest.approx(WINDOW * (1 - math.exp(-1)), rel=1e-12)
    # the figures of the design, in whole micrometres
    assert lengths.least_squares == pytest.approx(320e-6, abs=0.5e-6)
    assert lengths.half_window == pytest.approx(484e-6, abs=0.5e-6)


def test_an_exponential_has_its_own_length() -> None:
    lags = np.arange(121) * 15e-6
    true = np.array([20e-6, 250e-6, 1500e-6])
    curves = np.exp(-lags / true[:, None])
    lengths, at_bound = exponential_length(lags, curves)
    np.testing.assert_allclose(lengths, true, rtol=1e-12)
    assert not at_bound.any()
    # linear interpolation of exp(-s/L) between lags h apart is off by at most h^2 / (8 L) in s
    np.testing.assert_allclose(one_over_e_length(lags, curves[:2]), true[:2], atol=(15e-6) ** 2 / 8 / 20e-6)


def test_curves_without_a_length_are_flagged() -> None:
    lags = np.arange(50) * 1e-5
    alternating = np.where(np.arange(50) % 2 == 0, 1.0, -1.0) * np.exp(-np.arange(50.0))
    lengths, at_bound = exponential_length(lags, np.stack((np.ones(50), alternating)))
    assert at_bound.all()
    np.testing.assert_allclose(lengths, [100 * lags[-1], lags[1] / 20], rtol=1e-12)
    # never below 1/e: the longest lag, a lower bound
    assert one_over_e_length(lags, np.ones((1, 50)))[0] == lags[-1]


def test_autocorrelation_is_the_mean_over_pairs_of_valid_windows() -> None:
    rng = np.random.default_rng(1)
    mu = ornstein_uhlenbeck(rng, 6, 9, 0.7)
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
    r = autocorrelation(mu, everywhere(mu), 25, weights)
    error = np.std(r.replicates, axis=1)
    # 24 correlated lags: 4 standard errors are exceeded once in 600 such tests
    assert np.all(np.abs(r.value - triangular(lags, WINDOW))[1:] < 4 * error[1:])
    fit = correlation_fit(lags, r, WINDOW)
    assert fit.misfit_difference.low > 0.0  # the triangle is nearer
    assert fit.misfit_triangle.low == 0.0
    for name in ("least_squares", "half_window", "one_over_e", "integral"):
        e = getattr(fit, name)
        assert abs(e.value - getattr(fit.window, name)) < 4 * np.std(e.replicates), name
    assert not fit.at_bound
    assert fit.at_bound_share == 0.0


def test_ornstein_uhlenbeck_windows_have_their_length() -> None:
    rng = np.random.default_rng(3)
    spacing, length = WINDOW / 20, 250e-6
    mu = ornstein_uhlenbeck(rng, 300, 61, math.exp(-spacing / length))
    lags = np.arange(61) * spacing
    fit = correlation_fit(lags, autocorrelation(mu, everywhere(mu), 61, strip_weights(300, 200, rng)), WINDOW)
    for name in ("least_squares", "half_window", "one_over_e"):
        e = getattr(fit, name)
        # 300 strips of 1800 um hold some 300 * 1800 / 500 = 1080 independent pieces: error of a length some 5 %
        assert np.std(e.replicates) < 0.1 * length, name
        assert abs(e.value - length) < 4 * np.std(e.replicates), name
    # trapezoids to 3 T: L (1 - exp(-1800/250)), and (spacing/L)^2/12 more
    assert abs(fit.integral.value - length) < 4 * np.std(fit.integral.replicates) + 2e-3 * length
    assert fit.misfit_difference.high < 0.0  # the exponential is nearer
    # the misfits of a curve within a few per cent of the exponential
    assert fit.misfit_exponential.low == 0.0
    assert fit.misfit_triangle.value > 0.05


@pytest.mark.slow
def test_band_covers_the_autocorrelation() -> None:
    hits = np.zeros(3)
    for k in range(200):
        rng = np.random.default_rng([6, k])
        mu = ornstein_uhlenbeck(rng, 50, 12, 0.8)
        r = autocorrelation(mu, everywhere(mu), 4, strip_weights(50, 100, rng))
        hits += (r.low[1:] <= 0.8 ** np.arange(1, 4)) & (0.8 ** np.arange(1, 4) <= r.high[1:])
    # as for the mean (t, variance with 1/S, 100 replicates); skewness and the bias of the mean cost O(1/sqrt(S)) more
    nominal = (2 * stats.t.cdf(1.96 * math.sqrt(49 / 50), 49) - 1) * 99 / 101 - 0.05
    assert hits.min() >= stats.binom.ppf(0.0005, 200, nominal)


def test_faults_are_refused() -> None:
    rng = np.random.default_rng(7)
    mu = ornstein_uhlenbeck(rng, 5, 6, 0.5)
    weights = strip_weights(5, 40, rng)
    for lags in (1, 7):
        with pytest.raises(IllPosedError, match="longer strips"):
            autocorrelation(mu, everywhere(mu), lags, weights)
    ends = everywhere(mu)
    ends[:, 1:] = False  # single windows: no pair at any lag
    with pytest.raises(IllPosedError, match="no pair"):
        autocorrelation(mu, ends, 2, weights)
    with pytest.raises(IllPosedError, match="no scatter"):
        autocorrelation(np.full(mu.shape, 0.3), everywhere(mu), 3, weights)
    with pytest.raises(IllPosedError, match="half a window"):
        window_lengths(np.arange(5.0), 1.5)


def test_white_pressure_has_the_triangle_of_its_windows():
    """100 strips of 4 windows have some 300 effective windows, which lower r by (1 - r) / 300.

    400 measurements leave a scatter of 1 / sqrt(400 x 300) = 0.003.
    """
    found = white_autocorrelation(100, 160, 40, 4, 31, 400, np.random.default_rng(1))
    assert found.value[0] == 1.0
    expected = triangular(4.0 * np.arange(31), 40.0)
    np.testing.assert_allclose(found.value, expected - (1 - expected) / 300, atol=4 * 0.003)
    assert np.all(found.low <= found.value)
    assert np.all(found.value <= found.high)
    # Bartlett: beyond the window the variance of r is sum r^2 over the number of windows, 2/3 x 40 / 4 x 2 + 1 lags
    far = found.replicates[-1]
    windows = 100 * 1  # pairs at a lag of three windows: one independent pair a strip
    assert far.std() == pytest.approx(math.sqrt(2 / 3 / windows), rel=0.35)


def test_blocks_stand_for_their_columns():
    """The blocks of 4 columns are drawn as one: 40, 4 on 160 columns is 10, 1 on 40."""
    coarse = white_autocorrelation(20, 40, 10, 1, 31, 50, np.random.default_rng(4))
    fine = white_autocorrelation(20, 160, 40, 4, 31, 50, np.random.default_rng(4))
    np.testing.assert_array_equal(coarse.value, fine.value)


@pytest.mark.parametrize(
    ("share", "length"), [(0.5, 440e-6), (0.7, 366e-6), (0.8, 324e-6), (0.9, 275e-6), (0.95, 246e-6)]
)
def test_a_straight_line_through_the_logarithm_of_a_triangle_depends_on_its_largest_lag(share, length):
    """Closed form of a window of 600 µm, by quadrature of the least squares, and on lags 0.06 µm apart."""
    x = np.linspace(0.0, share, 200_001)
    slope = np.trapezoid((x - share / 2) * np.log1p(-x), x) / (share**3 / 12)
    assert triangle_log_line(share) == pytest.approx(-1 / slope, rel=1e-8)
    assert 600e-6 * triangle_log_line(share) == pytest.approx(length, abs=0.5e-6)
    lags = np.linspace(0.0, 600e-6, 10_001)
    found, straight = log_line(lags, triangular(lags, 600e-6)[None], share * 600e-6)
    assert found[0] == pytest.approx(length, rel=2e-3)
    assert 0.8 < straight[0] < 0.995


def test_a_straight_line_finds_an_exponential_and_ends_before_the_curve_falls_to_zero():
    lags = 15e-6 * np.arange(41)
    curve = np.exp(-lags / 250e-6)
    cut = np.where(np.arange(41) < 20, curve, -0.1)
    late = np.where(np.arange(41) < 25, cut, 0.5)  # noise beyond the first crossing does not count
    lengths, straight = log_line(lags, np.stack([curve, cut, late]), 540e-6)
    np.testing.assert_allclose(lengths, 250e-6, rtol=1e-12)
    np.testing.assert_allclose(straight, 1.0, atol=1e-12)
    flat, alone = np.ones(41), np.where(np.arange(41) < 1, 1.0, -0.2)
    lengths, straight = log_line(lags, np.stack([flat, alone]), 540e-6)
    np.testing.assert_allclose(lengths, [100 * lags[-1], lags[1] / 20])
    np.testing.assert_array_equal(straight, 0.0)
