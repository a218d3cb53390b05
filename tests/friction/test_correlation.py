"""Autocorrelation of mu and lengths of the exponential fitted to it, against closed forms and white windows."""

import math

import numpy as np
import pytest

from roughslip.friction.correlation import (
    autocorrelation,
    correlation_fit,
    exponential_length,
    lags_with_pairs,
    one_field,
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
        (exponential, {"least_squares": 250e-6}, 0.0, apart),
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


def test_one_field_about_its_own_mean_shows_a_shorter_length_than_all_together():
    """White noise averaged over a window, in fields of four windows; each against the sums as they are written."""
    rng = np.random.default_rng(5)
    total = np.cumsum(rng.standard_normal((60, 81)), axis=1)
    mu, lags = 0.3 + 0.001 * (total[:, 20:] - total[:, :-20]), np.arange(61) * WINDOW / 20
    valid = np.arange(60)[:, None] < 50 + np.zeros(61)  # fields without friction somewhere are left out
    found = one_field(mu, valid, lags, WINDOW)
    of_fields, lags_used = [], lags[:31]
    for field in mu[:50] - mu[:50].mean(axis=1, keepdims=True):
        curve = np.array([np.mean(field[: 61 - k] * field[k:]) for k in range(31)]) / np.mean(field**2)
        (length,) = exponential_length(lags_used, curve[None])
        models = np.exp(-lags_used / length), triangular(lags_used, WINDOW)
        of_fields.append((length, np.less(*(np.sum((curve - model) ** 2) for model in models))))
    lengths, nearer = np.transpose(of_fields)
    length, share = found["length_one_field"], found["exponential_share"]
    np.testing.assert_allclose([length.value, length.low, length.high], np.quantile(lengths, [0.5, 0.025, 0.975]))
    assert float(share.value) == np.mean(nearer)
    triangle = window_lengths(np.arange(721) * 2.5e-6, WINDOW)  # 1/e is met at T (1 - 1/e)
    assert triangle["one_over_e"] == pytest.approx(WINDOW * (1 - math.exp(-1)), rel=1e-12)
    assert length.value < triangle["least_squares"] == pytest.approx(320e-6, abs=0.5e-6)
    assert all(np.isnan(one.value) for one in one_field(mu[:0], valid[:0], lags, WINDOW).values())


def test_lags_reach_as_far_as_each_resampled_set_has_pairs_of_windows():
    """Windows 0 and 1 touch in one strip, 0 and 3 in the other: a set of the first alone ends at lag 1."""
    valid = np.array([[1, 1, 0, 0, 0], [1, 0, 0, 1, 0]], dtype=bool)
    both, first, second = np.array([[1.0, 1.0]]), np.array([[2.0, 0.0]]), np.array([[0.0, 2.0]])
    assert [lags_with_pairs(valid, rows, 5) for rows in (both, first, second)] == [2, 2, 1]
    assert lags_with_pairs(np.ones((2, 5), dtype=bool), np.vstack([both, first]), 4) == 4
