"""Autocorrelation of mu and lengths of the exponential fitted to it, against closed forms and white windows."""

import math

import numpy as np
import pytest

from roughslip.friction.correlation import (
    autocorrelation,
    correlation_fit,
    exponential_length,
    lags_with_pairs,
    log_line,
    one_over_e_length,
    triangular,
    window_lengths,
)
from roughslip.friction.windows import strip_weights
from roughslip.probability import Estimate
from tests.friction.test_windows import autoregressive

WINDOW = 600e-6


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


def test_which_exponential_fits_and_whether_it_is_one() -> None:
    """Curves of the window alone and of an exponential, and replicates that scatter by 1e-4 about them."""
    lags = np.arange(61) * WINDOW / 20
    noise = 1e-4 * np.random.default_rng(2).standard_normal((60, lags.size)) * (lags > 0.0)
    triangle, exponential = triangular(lags, WINDOW), np.exp(-lags / 250e-6)
    apart = np.sqrt(np.mean((triangle - exponential) ** 2))
    own = window_lengths(lags, WINDOW)
    far = np.sqrt(np.mean((triangle - np.exp(-lags / own["least_squares"])) ** 2))
    for curve, lengths, to_exponential, to_triangle in (
        (triangle, own, far, 0.0),
        (exponential, {"least_squares": 250e-6, "log_line": 250e-6}, 0.0, apart),
    ):
        fit = correlation_fit(lags, Estimate.from_rows(np.concatenate((curve[None], curve + noise))), WINDOW)
        for name, length in lengths.items():
            found = getattr(fit, name)
            assert (found.value, found.low, found.high) == (
                pytest.approx(length),
                *(pytest.approx(length, rel=0.01),) * 2,
            )
        assert fit.misfit_exponential.value == pytest.approx(to_exponential, abs=1e-9)
        assert fit.misfit_triangle.value == pytest.approx(to_triangle, abs=1e-9)
        assert fit.misfit_difference.value == pytest.approx(to_exponential**2 - to_triangle**2, abs=1e-9)
        # what resampling moves a curve by, 1e-4, is what a distance is known to
        assert fit.misfit_triangle.high - to_triangle == pytest.approx(1e-4, rel=0.3)


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


def test_a_straight_line_takes_the_point_at_the_largest_lag():
    lags = 15e-6 * np.arange(41)
    triangle = triangular(lags, 600e-6)
    slope, _ = np.polyfit(lags[:37], np.log(triangle[:37]), 1)  # 36 spacings are 540 µm
    assert log_line(lags, triangle[None], 540e-6)[0] == pytest.approx(-1.0 / slope, rel=1e-9)


def test_lags_reach_as_far_as_each_resampled_set_has_pairs_of_windows():
    """Windows 0 and 1 touch in one strip, 0 and 3 in the other: a set of the first alone ends at lag 1."""
    valid = np.array([[1, 1, 0, 0, 0], [1, 0, 0, 1, 0]], dtype=bool)
    both, first, second = np.array([[1.0, 1.0]]), np.array([[2.0, 0.0]]), np.array([[0.0, 2.0]])
    assert [lags_with_pairs(valid, rows, 5) for rows in (both, first, second)] == [2, 2, 1]
    assert lags_with_pairs(np.ones((2, 5), dtype=bool), np.vstack([both, first]), 4) == 4
