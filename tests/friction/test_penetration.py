"""Friction against penetration: mu_fit(d), trends over the levels, p-values."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roughslip.errors import IllPosedError, ParameterError
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
