"""Fits without one or two groups, against fits that never saw them; a known distribution given a prediction."""

import numpy as np
import pytest
from scipy.special import ndtri

from roughslip.chaos.left_out import (
    NEIGHBOURS,
    PLACES,
    group_sums,
    left_out_predictions,
    residual_scatter,
    without_one,
    without_two,
)
from roughslip.errors import IllPosedError, ParameterError

GROUPS = 5
SAMPLES = 40_000


def problem():
    generator = np.random.default_rng(2001)
    rows, values = generator.standard_normal((60, 4)), generator.standard_normal(60)
    return rows, values, generator.uniform(0.2, 1.0, 60), np.arange(60) % GROUPS


def fitted(rows, values, weights, keep):
    root = np.sqrt(weights[keep])
    return np.linalg.lstsq(root[:, None] * rows[keep], root * values[keep], rcond=None)[0]


def test_fits_without_groups_are_fits_to_the_others():
    rows, values, weights, group = problem()
    sums = group_sums(rows, weights, weights * values, group, GROUPS)
    one, two = without_one(*sums), without_two(*sums)
    for g in range(1 + GROUPS):
        np.testing.assert_allclose(one[g], fitted(rows, values, weights, group != g - 1), rtol=0, atol=1e-13)
        for h in range(1 + GROUPS):
            keep = (group != g - 1) & (group != h - 1)
            np.testing.assert_allclose(two[g, h], fitted(rows, values, weights, keep), rtol=0, atol=1e-13)


def test_predictions_have_not_seen_the_group_of_their_sample():
    rows, values, weights, group = problem()
    sums = group_sums(rows, weights, weights * values, group, GROUPS)
    plain, nested = (left_out_predictions(rows, without(*sums), group) for without in (without_one, without_two))
    np.testing.assert_allclose(nested[0], plain, atol=1e-14)
    for k in (0, 17, 58):
        np.testing.assert_allclose(plain[k], rows[k] @ fitted(rows, values, weights, group != group[k]), atol=1e-13)
        keep = (group != group[k]) & (group != 3)
        np.testing.assert_allclose(nested[4, k], rows[k] @ fitted(rows, values, weights, keep), atol=1e-13)


def test_scales_of_terms_do_not_matter():
    """Normal equations square a condition number, unless their columns are of one size."""
    rows, values, weights, group = problem()
    scale = np.array([1.0, 1e-12, 1e12, 1e3])
    plain, scaled = (
        without_one(*group_sums(r, weights, weights * values, group, GROUPS)) for r in (rows, rows * scale)
    )
    np.testing.assert_allclose(scaled * scale, plain, rtol=1e-11)


@pytest.mark.parametrize("column", ["zero", "only in one group", "twice"])
def test_undetermined_coefficients_are_refused(column):
    rows, values, weights, group = problem()
    extra = {"zero": 0 * values, "only in one group": np.where(group == 2, 1.0, 0.0), "twice": rows[:, 1]}[column]
    with pytest.raises(IllPosedError, match="undetermined"):
        without_one(*group_sums(np.column_stack([rows, extra]), weights, weights * values, group, GROUPS))


def mean(s):
    return np.where(s > 0, s**2, 0.0) + s


def width(s):
    return 0.2 + 0.3 * np.maximum(s, 0.0)


def scattered(samples=SAMPLES, seed=0):
    generator = np.random.default_rng([1991, seed])
    s = generator.standard_normal(samples)
    return s, mean(s) + width(s) * generator.standard_normal(samples)


@pytest.fixture(scope="module")
def law():
    return residual_scatter(*scattered())


@pytest.mark.parametrize("probability", [0.1, 0.5, 0.9])
def test_quantiles_are_those_of_the_law_where_scatter_grows_with_the_prediction(law, probability):
    """A quantile of the window's samples has the error sqrt(q (1 - q) / n) / f, at most 1.8 width / sqrt(n), four of
    which are 0.18 width. The window smears the mean by its own slope, which is fitted, not by its position."""
    s = np.array([-1.5, -0.5, 0.0, 0.5, 1.0, 1.5])
    drawn = law.draw(s, np.full(6, probability))
    tolerance = 4 * 1.8 * width(s) / np.sqrt(NEIGHBOURS * SAMPLES)
    assert np.all(np.abs(drawn - mean(s) - width(s) * ndtri(probability)) < tolerance)


def test_the_centre_goes_on_straight(law):
    ends = np.array([law.low, law.high])
    beyond = law.centre(ends + np.array([-1.0, 1.0])) - law.centre(ends)
    further = law.centre(ends + np.array([-3.0, 3.0])) - law.centre(ends)
    np.testing.assert_allclose(further, 3 * beyond, rtol=1e-12)
    slopes = law.mean.derivative()(ends) * np.array([-1.0, 1.0])
    np.testing.assert_allclose(beyond, slopes, rtol=1e-12)


def test_a_draw_is_continuous_and_rises_with_its_uniform_number(law):
    uniform = np.linspace(0, 1, 4001)[:-1]
    assert np.all(np.diff(law.draw(np.full(4000, 0.3), uniform)) >= 0)
    # Across a place the law has no jump: it moves over 1e-9 by at most a slope of some 1e3.
    s = law.places[PLACES // 2] + np.array([-1e-9, 1e-9])
    for u in (0.0, 0.013, 0.5, 0.999):
        below, above = law.draw(s, np.full(2, u))
        assert above == pytest.approx(below, abs=1e-5)


def test_a_cubic_without_scatter_is_given_back():
    s = np.random.default_rng(3).standard_normal(500)
    law = residual_scatter(s, 1 + s - 0.2 * s**3)
    at = np.linspace(-1.5, 1.5, 7)
    np.testing.assert_allclose(law.draw(at, np.full(7, 0.7)), 1 + at - 0.2 * at**3, atol=1e-12)


def test_samples_without_a_distribution_are_refused():
    s, target = scattered(200)
    with pytest.raises(IllPosedError, match="99 samples in or near contact are too few"):
        residual_scatter(s[:99], target[:99])
    with pytest.raises(IllPosedError, match="alike"):
        residual_scatter(np.ones(200), target)
    with pytest.raises(ParameterError, match="for each prediction"):
        residual_scatter(s, target[1:])
