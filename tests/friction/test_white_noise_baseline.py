"""Windows of white pressure: the triangle, less the bias of the estimator, and as noisy as a measurement."""

import math

import numpy as np
import pytest

from roughslip.errors import ParameterError
from roughslip.friction.correlation import autocorrelation, triangular
from roughslip.friction.resampling import strip_weights
from roughslip.friction.white_noise_baseline import white_autocorrelation


def test_white_pressure_has_the_triangle_of_its_windows():
    """100 strips of 4 windows: r is lowered by (1 - r) / effective windows, some 300, and 400 measurements leave a
    scatter of 1 / sqrt(400 x 300) = 0.003."""
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


def test_it_is_what_the_measurement_would_find_on_such_windows():
    """One measurement drawn column by column lies within the range of the 400."""
    columns = np.random.default_rng(2).standard_normal((100, 160))
    sums = np.cumsum(np.concatenate((np.zeros((100, 1)), columns), axis=1), axis=1)
    mu = 100.0 + sums[:, 40::4] - sums[:, :-40:4]
    weights = strip_weights(100, 40, np.random.default_rng(3))
    measured = autocorrelation(mu, np.ones(mu.shape, dtype=bool), 31, weights).value
    found = white_autocorrelation(100, 160, 40, 4, 31, 400, np.random.default_rng(1))
    # 31 lags, few of them independent: 0.3 % either side of all at once
    low, high = np.quantile(found.replicates, [0.003, 0.997], axis=1)
    assert np.all((low - 1e-12 <= measured) & (measured <= high + 1e-12))


def test_blocks_stand_for_their_columns():
    """The blocks of 4 columns are drawn as one: 40, 4 on 160 columns is 10, 1 on 40."""
    coarse = white_autocorrelation(20, 40, 10, 1, 31, 50, np.random.default_rng(4))
    fine = white_autocorrelation(20, 160, 40, 4, 31, 50, np.random.default_rng(4))
    np.testing.assert_array_equal(coarse.value, fine.value)


def test_too_few_measurements_or_columns_are_refused():
    with pytest.raises(ParameterError, match="replicates"):
        white_autocorrelation(10, 40, 10, 1, 5, 3, np.random.default_rng(5))
    with pytest.raises(ParameterError, match="does not fit"):
        white_autocorrelation(10, 40, 80, 4, 5, 50, np.random.default_rng(5))
