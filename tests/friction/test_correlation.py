"""Autocorrelation of mu and lengths of the exponential fitted to it, against closed forms and white windows.

Friction against penetration: mu_fit(d), trends over the levels, p-values."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from roughslip.errors import IllPosedError, ParameterError
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
from roughslip.friction.penetration import (
    PenetrationCurve,
    between,
    p_value,
    p_value_of_equality,
    penetration_curve,
    trend,
)
from roughslip.friction.statistics import resampled, strip_weights
from roughslip.probability import Estimate
from tests.friction.test_windows import autoregressive

WINDOW = 600e-6


def averaged_white_noise(rng: np.random.Generator, strips: int, window: int, windows: int) -> np.ndarray:
    """mu = 1 + white noise averaged over windows of `window` nodes that start at every fifth node."""
    noise = rng.standard_normal((strips, window + 5 * (windows - 1)))
    return 1.0 + 0.1 * window_sums(noise, window, 5) / math.sqrt(window)


def ornstein_uhlenbeck(rng: np.random.Generator, strips: int, windows: int, factor: float) -> np.ndarray:
    """mu = 1 + 0.1 x with x Gaussian of unit variance and correlation factor^lag, exactly an exponential."""
    return 1.0 + 0.1 * autoregressive(rng, strips, windows, factor)


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
    bound = white_autocorrelation(100, 160, 40, 4, 31, 400, np.random.default_rng(1))
    assert bound.value[0] == 1.0
    expected = triangular(4.0 * np.arange(31), 40.0)
    np.testing.assert_allclose(bound.value, expected - (1 - expected) / 300, atol=4 * 0.003)
    assert np.all(bound.low <= bound.value)
    assert np.all(bound.value <= bound.high)
    # Bartlett: beyond the window the variance of r is sum r^2 over the number of windows, 2/3 x 40 / 4 x 2 + 1 lags
    far = bound.replicates[-1]
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
    fitted, straight = log_line(lags, triangular(lags, 600e-6)[None], share * 600e-6)
    assert fitted[0] == pytest.approx(length, rel=2e-3)
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


LEVELS = np.array([5.0, 10.0, 20.0, 40.0, 50.0, 80.0, 95.0])


def curve_of(function) -> PenetrationCurve:
    """Every replicate is the function times 1 + a number between -0.05 and 0.05."""
    factors = np.concatenate(([1.0], 1 + np.linspace(-0.05, 0.05, 81)))
    return penetration_curve(LEVELS, [Estimate.from_rows(function(q) * factors) for q in LEVELS])


def test_a_straight_line_stays_one_with_its_slope_and_its_band():
    curve = curve_of(lambda q: 0.4 - 0.002 * q)
    q = np.linspace(5.0, 95.0, 37)
    np.testing.assert_allclose(curve.at(q).value, 0.4 - 0.002 * q, rtol=1e-14)
    np.testing.assert_allclose(curve.slope(q).value, -0.002, rtol=1e-12)
    # linear quantiles of evenly spaced factors: 95 % of the range
    np.testing.assert_allclose(curve.at(q).high, (0.4 - 0.002 * q) * (1 + 0.05 * 0.95), rtol=1e-12)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(st.lists(st.floats(0.01, 1.0), min_size=7, max_size=7))
def test_the_curve_goes_through_the_levels_and_turns_nowhere_between(values):
    rows = np.tile(values, (42, 1))
    curve = PenetrationCurve(LEVELS, rows)
    np.testing.assert_allclose(curve.at(LEVELS).value, values, rtol=1e-14)
    for k in range(6):
        inside = curve.at(np.linspace(LEVELS[k], LEVELS[k + 1], 50)).value
        rise = np.diff(inside)
        # a cubic of values up to 1: rounding of a few units in the last place
        assert np.all(rise >= -1e-14) or np.all(rise <= 1e-14)


def test_the_slope_is_the_derivative_and_continuous_at_the_levels():
    curve = curve_of(lambda q: 0.2 + 0.1 * np.exp(-q / 30.0))
    q, h = np.linspace(6.0, 94.0, 50), 1e-4
    difference = (curve.at(q + h).value - curve.at(q - h).value) / (2 * h)
    # kinks of the slope lie only at levels, which the points miss; h^2 of a third derivative below 1e-4
    np.testing.assert_allclose(curve.slope(q).value, difference, atol=1e-9)
    inner = LEVELS[1:-1]
    np.testing.assert_allclose(curve.slope(inner - 1e-9).value, curve.slope(inner + 1e-9).value, atol=1e-10)


def test_the_error_falls_with_the_square_of_the_distance_of_levels():
    """Fritsch and Butland's slopes are second order on even levels, so the curve is between second and third."""
    errors = []
    for count in (9, 17, 33):
        levels = np.linspace(5.0, 95.0, count)
        truth = 0.2 + 0.1 * np.exp(-levels / 30.0)
        curve = PenetrationCurve(levels, np.tile(truth, (42, 1)))
        q = np.linspace(30.0, 70.0, 400)
        errors.append(np.max(np.abs(curve.at(q).value - 0.2 - 0.1 * np.exp(-q / 30.0))))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 1.9)


def test_a_number_at_a_level_is_that_of_the_level_and_between_two_on_the_curve():
    values = np.array([0.37, 0.34, 0.32, 0.31, 0.30, 0.28, 0.27])
    assert [between(LEVELS, values, q) for q in LEVELS] == values.tolist()
    curve = PenetrationCurve(LEVELS, np.tile(values, (42, 1)))
    assert between(LEVELS, values, 33.0) == float(curve.at(np.float64(33.0)).value)
    assert between(np.array([50.0]), np.array([0.3]), 50.0) == 0.3
    with pytest.raises(ParameterError, match="between the levels"):
        between(LEVELS, values, 99.0)


def test_trend_of_a_line_is_its_change_and_pairing_removes_common_noise() -> None:
    q = np.array([5.0, 10.0, 50.0, 90.0, 95.0])
    line = 0.4 - 0.002 * q
    noise = np.random.default_rng(8).standard_normal(100)
    falls = trend(q, line, line[:, None] + noise)
    # noise of size 1, common to the levels, cancels down to its rounding
    for e, true in ((falls.line, -0.18), (falls.change, -0.18)):
        np.testing.assert_allclose([e.value, e.low, e.high], true, rtol=1e-12)
    assert falls.direction == -1
    assert trend(q, -line, -line[:, None] + noise).direction == 1
    own = np.random.default_rng(9).standard_normal((5, 100))
    assert trend(q, line, line[:, None] + own).direction == 0


def test_trend_needs_both_line_and_ends_to_agree() -> None:
    q = np.array([10.0, 50.0, 90.0])
    dip = np.array([1.0, 0.5, 1.0])  # falls, then rises: no change along the line
    assert trend(q, dip, np.repeat(dip[:, None], 50, axis=1)).direction == 0
    # ends fall by 0.1, the line rises: deviations -40, -10, 10, 40 of q times values sum to 6
    apart = np.array([0.5, 0.0, 1.0, 0.4])
    for sign in (1.0, -1.0):
        result = trend(np.array([10.0, 40.0, 60.0, 90.0]), sign * apart, np.repeat(sign * apart[:, None], 50, axis=1))
        assert result.line.value == pytest.approx(sign * 80 * 6.0 / 3400.0, rel=1e-12)
        assert result.direction == 0


STRIPS, REPLICATES, REPETITIONS = 60, 99, 300


def means(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(1 + R, n) of values : (S, n), row 0 the sample's."""
    return resampled(strip_weights(len(values), REPLICATES, rng), values) / len(values)


@pytest.mark.slow
def test_true_hypotheses_are_refused_as_often_as_they_should():
    """5 % of 300 repetitions are 15 +- 3.8; the pivot of 60 strips without its spread is t with 59 degrees: 5.5 %."""
    rng = np.random.default_rng(8)
    refused = sum(
        p_value(Estimate.from_rows(means(rng.exponential(1.0, (STRIPS, 1)), rng)[:, 0]), 1.0) <= 0.05
        for _ in range(REPETITIONS)
    )
    assert abs(refused - 0.06 * REPETITIONS) < 4 * math.sqrt(0.06 * REPETITIONS)


@pytest.mark.slow
def test_equal_curves_are_refused_as_often_as_they_should_and_others_always():
    """Three levels of 20 places, each strip alike at all levels but for noise, as windows under deeper planes are."""
    rng = np.random.default_rng(9)
    refused = {0.0: 0, 0.5: 0}
    for shift in refused:
        for _ in range(REPETITIONS if shift == 0.0 else 20):
            common = rng.standard_normal((STRIPS, 20))
            weights = strip_weights(STRIPS, REPLICATES, rng)
            curves = [
                resampled(weights, common + 0.5 * rng.standard_normal((STRIPS, 20)) + shift * (level == 2)) / STRIPS
                for level in range(3)
            ]
            refused[shift] += p_value_of_equality(np.stack(curves)) <= 0.05
    # 4 % in 200 other repetitions: strips resampled scatter less than strips by 1 - 1 / 60, and errors are estimated
    assert 0 < refused[0.0] < 0.05 * REPETITIONS + 4 * math.sqrt(0.05 * REPETITIONS)
    assert refused[0.5] == 20


def test_values_by_hand():
    estimate = Estimate.from_rows(np.concatenate(([2.0], np.linspace(1.0, 3.0, 99))))
    assert p_value(estimate, 2.0) == 1.0
    assert p_value(estimate, -5.0) == 0.01
    assert p_value(estimate, 1.5) == pytest.approx(51 / 100)  # half the replicates lie 0.5 or more from 2


def test_two_levels_are_equal_as_often_as_their_difference_is_zero():
    """At one place; what the levels share, here ten times their own scatter, does not count."""
    rng = np.random.default_rng(10)
    own, common = rng.standard_normal((2, 200)), 10.0 * rng.standard_normal(200)
    for apart in (0.0, 1.0, 3.0):
        first, second = common + own[0], common + own[1] + apart
        expected = p_value(Estimate.from_rows(second - first))
        assert p_value_of_equality(np.stack([first, second])[..., None]) == expected


def test_what_cannot_be_tested_is_refused():
    with pytest.raises(IllPosedError, match="two levels"):
        p_value_of_equality(np.ones((1, 41, 3)))
    nowhere = Estimate(np.array(np.nan), np.array(0.0), np.array(1.0), np.ones(50))
    with pytest.raises(ParameterError, match="finite"):
        p_value(nowhere)
