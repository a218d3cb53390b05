"""The friction table of Gaussian windows: calibration, sources, trends, and what white pressure would show."""

import numpy as np
import pytest

from roughslip.errors import IllPosedError
from roughslip.friction.correlation import window_lengths
from roughslip.friction.level import levels_of
from roughslip.friction.over_penetration import trend_estimates
from roughslip.friction.table import WindowLayout, friction_table
from roughslip.friction.table_variables import law_variables, line_variables, summary, table_variables
from roughslip.probability import Estimate

MEANS, SCATTER, STRIPS, WINDOWS = (1.25, 1.0, 0.8), 0.05, 60, 12
LAYOUT = WindowLayout(np.array([20.0, 50.0, 80.0]), 4e-4, 1e-4, (40, 10), WINDOWS)
AREA = 2.0  # m2 of every window; its force is the area over mu
MEAN, REPLICATES, SEED = 0.3, 60, [5, 1]


def levels(*windows):
    """All of these windows touch."""
    return levels_of(*((mu, np.ones(mu.shape, bool)) for mu in windows))


@pytest.fixture(scope="module")
def table():
    """Windows m (1 + 0.05 n) with m of each level, n normal, and on more strips a control of correlation 0.995."""
    rng = np.random.default_rng(8)
    seen = 1.0 + SCATTER * rng.standard_normal((3, 5 * STRIPS, WINDOWS))
    mu = np.array(MEANS)[:, None, None] * seen[:, :STRIPS]
    control = 0.9 * np.array(MEANS)[:, None, None] * (seen + 0.1 * SCATTER * rng.standard_normal(seen.shape))
    done: list[tuple[int, int]] = []
    sums = np.full(mu.shape, AREA), AREA / mu
    return (
        friction_table(levels(mu, control), sums, LAYOUT, MEAN, REPLICATES, SEED, lambda *pair: done.append(pair)),
        mu,
        done,
    )


def test_the_mean_at_the_median_is_as_given_and_the_others_follow(table):
    """The combined mean is exact at 50 %, without interval; others are 0.3 times the ratio of means, to
    4 x 0.05 / sqrt(60 x 12). The shear strength is 0.3 Pa over a mean of 1."""
    found, mu, done = table
    combined = found.combined["mean"]
    assert (combined[1].value, combined[1].low, combined[1].high) == (pytest.approx(MEAN),) * 3
    assert [float(each.value) for each in combined] == pytest.approx([MEAN * m for m in MEANS], rel=0.01)
    assert float(found.shear.value) == pytest.approx(MEAN, rel=0.01)
    np.testing.assert_array_equal(found.mu[0], float(found.shear.value) * mu)
    assert done == [(1, 3), (2, 3), (3, 3)]


def test_stored_variables_have_the_numbers_of_the_table_and_its_tests(table):
    found, _, _ = table
    variables = table_variables(found) | law_variables(found, np.random.default_rng(6))
    assert variables["mean"].values.shape == (2, 3)
    np.testing.assert_array_equal(variables["combined_mean"].values, [each.value for each in found.combined["mean"]])
    np.testing.assert_allclose(variables["lag"].values, 1e-4 * np.arange(WINDOWS))
    np.testing.assert_allclose(variables["triangle"].values[:5], [1.0, 0.75, 0.5, 0.25, 0.0], atol=1e-12)
    change = trend_estimates(found.combined, LAYOUT.percentiles)["trend_combined_mean_change"]
    assert float(variables["trend_combined_mean_change"].values) == float(change.value) < 0.0
    # the mean falls by many standard errors, further than any replicate
    least = float(variables["least_p_value"].values)
    assert least == 1 / (1 + REPLICATES)
    assert float(variables["p_no_change_of_mean"].values) <= 2 * least
    # windows of white pressure correlate by their overlap: 0.75 a quarter of a window apart
    white = variables["white_autocorrelation"].values
    assert white[:2] == pytest.approx([1.0, 0.75], abs=0.05)
    lines = summary(variables, LAYOUT.percentiles).splitlines()
    assert [line.split(",")[0] for line in lines if not line.startswith("#")] == ["percentile", "20", "50", "80"]


def test_windows_without_scatter_are_refused_with_their_penetration():
    flat = np.ones((3, STRIPS, WINDOWS))
    rng = np.random.default_rng(9)
    flat[:2] += SCATTER * rng.standard_normal(flat[:2].shape)
    more = 1.0 + SCATTER * rng.standard_normal((3, 5 * STRIPS, WINDOWS))
    with pytest.raises(IllPosedError, match="scatter"):
        friction_table(levels(flat, more), (flat, flat), LAYOUT, MEAN, REPLICATES, SEED)


def test_straight_lines_end_at_each_lag_within_the_window():
    """An exponential has its length by all of them; the triangle by none, and the window itself is no largest lag."""
    lags, length = 1e-4 * np.arange(10), 2.5e-4
    curve = Estimate.from_rows(np.tile(np.exp(-lags / length), (41, 1)))
    found = line_variables(curve, lags, 6e-4)
    np.testing.assert_array_equal(found["largest_lag"].values, lags[1:6])
    np.testing.assert_allclose(found["log_line"].values, length, rtol=1e-9)
    own, triangle = window_lengths(lags, 6e-4), found["triangle_log_line"].values
    assert np.all(np.diff(triangle) < 0.0)
    names = list(found["length_name"].values)
    for name, value in zip(names, found["triangle_length"].values, strict=True):
        assert value == getattr(own, name)
    assert triangle[-1] < own.log_line_90 * 1.2
    assert 0.8 < float(found["triangle_log_line_r2"].values) < 1.0
