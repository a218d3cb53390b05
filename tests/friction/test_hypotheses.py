"""p-values: even under the null hypothesis, small where it fails, never 0."""

import math

import numpy as np
import pytest

from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction.hypotheses import p_value, p_value_of_equality
from roughslip.friction.resampling import resampled, strip_weights
from roughslip.probability import Estimate

STRIPS, REPLICATES, REPETITIONS = 60, 99, 300


def means(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(1 + R, n) of values : (S, n), row 0 the sample's."""
    return resampled(strip_weights(len(values), REPLICATES, rng), values) / len(values)


def test_true_hypotheses_are_refused_as_often_as_they_should():
    """5 % of 300 repetitions are 15 +- 3.8; the pivot of 60 strips without its spread is t with 59 degrees: 5.5 %."""
    rng = np.random.default_rng(8)
    refused = sum(
        p_value(Estimate.from_rows(means(rng.exponential(1.0, (STRIPS, 1)), rng)[:, 0]), 1.0) <= 0.05
        for _ in range(REPETITIONS)
    )
    assert abs(refused - 0.06 * REPETITIONS) < 4 * math.sqrt(0.06 * REPETITIONS)


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


def test_curves_that_do_not_scatter_at_a_place_say_nothing_there():
    curves = np.random.default_rng(10).standard_normal((2, 41, 3))
    curves[:, :, 0] = 1.0  # an autocorrelation at lag 0
    assert 0 < p_value_of_equality(curves) <= 1


def test_what_cannot_be_tested_is_refused():
    with pytest.raises(IllPosedError, match="two levels"):
        p_value_of_equality(np.ones((1, 41, 3)))
    nowhere = Estimate(np.array(np.nan), np.array(0.0), np.array(1.0), np.ones(50))
    with pytest.raises(ParameterError, match="finite"):
        p_value(nowhere)
