"""Windows in parallel: the mean of independent Beta variables, by its first four cumulants."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roughslip.errors import ParameterError
from roughslip.friction.load_sharing import average_beta
from roughslip.probability import beta_moments

shapes = st.floats(0.4, 200.0)


@settings(derandomize=True, max_examples=100, deadline=None)
@given(shapes, shapes, st.integers(1, 1000))
def test_cumulants_fall_as_those_of_a_mean(a, b, windows):
    mean, std, skewness, excess = beta_moments(a, b)
    new_a, new_b, lower, upper = average_beta(a, b, 0.2, 0.7, windows)
    found = beta_moments(new_a, new_b)
    assert 0.2 + 0.5 * mean == pytest.approx(lower + (upper - lower) * found[0], rel=1e-9)
    assert (upper - lower) * found[1] == pytest.approx(0.5 * std / np.sqrt(windows), rel=1e-9)
    # skewness^2 and kurtosis of shapes a, b are differences of numbers of order 1 / (a + b): rounding grows with a + b
    rounding = 1e-13 * (a + b) ** 2 + 1e-9
    assert found[2] == pytest.approx(skewness / np.sqrt(windows), abs=rounding)
    assert found[3] == pytest.approx(excess / windows, abs=rounding)


def test_one_window_is_itself_and_many_are_nearly_normal():
    assert average_beta(2.1, 5.0, 0.1, 0.9, 1) == pytest.approx((2.1, 5.0, 0.1, 0.9), rel=1e-10)
    assert average_beta(3.0, 3.0, 0.0, 1.0, 1) == pytest.approx((3.0, 3.0, 0.0, 1.0), rel=1e-10)
    a, b, _, _ = average_beta(2.1, 5.0, 0.1, 0.9, 10_000)
    assert abs(beta_moments(a, b)[2]) == pytest.approx(beta_moments(2.1, 5.0)[2] / 100, rel=1e-6)


def test_means_of_drawn_windows_have_this_law():
    """Four moments say little of the ends, but the distribution of the mean of five is within 0.01 of the Beta."""
    from scipy import stats

    drawn = np.sort(np.random.default_rng(1).beta(2.1, 5.0, (40_000, 5)).mean(axis=1))
    a, b, lower, upper = average_beta(2.1, 5.0, 0.0, 1.0, 5)
    share = stats.beta(a, b, lower, upper - lower).cdf(drawn)
    # 1.36 / sqrt(40 000) = 0.0068 with 95 %
    assert np.max(np.abs(share - (np.arange(40_000) + 0.5) / 40_000)) < 0.01


def test_less_than_one_window_is_refused():
    with pytest.raises(ParameterError, match="at least 1"):
        average_beta(2.1, 5.0, 0.0, 1.0, 0)
