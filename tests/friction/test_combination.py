"""A control on more strips: identities and savings on known windows.

The friction table of Gaussian windows: calibration, sources and trends."""

import itertools
import math

import numpy as np
import pytest

from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction.combination import Levels, combine, controlled
from roughslip.friction.correlation import window_lengths
from roughslip.friction.penetration import trend
from roughslip.friction.statistics import strip_weights
from roughslip.friction.table import WindowLayout, friction_table
from roughslip.friction.table_variables import BINS, missing_warnings, summary, table_variables, windows_variables
from roughslip.probability import Estimate

RHO, STRIPS, MANY, WINDOWS = 0.95, 25, 250, 4
SHARE = MANY / (STRIPS + MANY)


def sample(rng: np.random.Generator, replicates: int = 100) -> tuple:
    """mu = 1 + 0.1 n and a control 2.5 + 0.3 c of another mean and scale, correlation of n and c RHO."""
    same, many = rng.standard_normal((STRIPS, WINDOWS)), rng.standard_normal((MANY, WINDOWS))
    own = rng.standard_normal((STRIPS, WINDOWS))
    mu = 1.0 + 0.1 * (RHO * same + math.sqrt(1.0 - RHO**2) * own)
    weights, weights_many = strip_weights(STRIPS, replicates, rng), strip_weights(MANY, replicates, rng)
    control = 2.5 + 0.3 * np.concatenate((same, many))
    return *(windows(values) for values in (mu, control)), (weights, weights_many)


def windows(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """mu and valid."""
    return values, np.ones(values.shape, bool)


def test_the_truth_as_control_returns_the_pooled_sample() -> None:
    """The weighted mean of both estimates of each statistic, of logarithms where it is positive."""
    _, control, weights = sample(np.random.default_rng(12))
    same, many = control[0][:STRIPS], control[0][STRIPS:]
    c = combine(Levels(windows(same), control), weights)
    estimates = c.estimates()
    for name, one in (("mean", np.mean), ("std", np.std)):
        pooled = one(same) ** (1 - SHARE) * one(many) ** SHARE
        assert estimates[name].value == pytest.approx(pooled, rel=1e-12)
        assert c.variance_share[name] == pytest.approx(1 - SHARE, rel=1e-9)
    assert estimates["variation"].value == pytest.approx(estimates["std"].value / estimates["mean"].value, rel=1e-12)
    assert estimates["autocorrelation"].value[0] == 1.0


def test_the_scatter_of_the_other_strips_lowers_the_weight_of_the_control() -> None:
    """Other strips with a quarter of the variance: alpha = 1 / (1 + 1/4)."""
    same, many = np.array([3.0, 1.0, -1.0, 1.0, -1.0]), np.array([1.0, 0.5, 0.5, -0.5, -0.5])
    estimates, kept = controlled({"mean": same}, {"mean": same}, {"mean": many}, 0.25)
    assert estimates["mean"][0] == pytest.approx(3.0 - 0.8 * 2.0, rel=1e-14)
    assert kept["mean"] == pytest.approx(0.2, rel=1e-14)


def test_a_control_that_does_not_scatter_between_strips_is_refused() -> None:
    solved, control, weights = sample(np.random.default_rng(17))
    control[0][:STRIPS] = control[0][0]  # scatter within strips, none between
    with pytest.raises(IllPosedError, match="between strips"):
        combine(Levels(solved, control), weights)


def test_calibration_fixes_the_mean_of_the_reference_in_every_replicate() -> None:
    """What all levels share cancels: of twice the friction at the other level, mean and std are twice as large."""
    solved, control, weights = sample(np.random.default_rng(20))
    one = combine(Levels(solved, control), weights)
    two = combine(Levels((2 * solved[0], solved[1]), control), weights)
    level, other = (each.calibrated(0.3, one).estimates() for each in (one, two))
    assert (level["mean"].low, level["mean"].high) == (pytest.approx(0.3, rel=1e-12), pytest.approx(0.3, rel=1e-12))
    np.testing.assert_allclose(other["mean"].replicates, 0.6, rtol=1e-9)
    np.testing.assert_allclose(other["std"].value, 2 * level["std"].value, rtol=1e-9)
    assert level["std"].value == pytest.approx(0.3 * math.exp(one.rows["std"][0] - one.rows["mean"][0]), rel=1e-12)


@pytest.mark.parametrize(
    ("counts", "widths", "groups"),
    [((5, 20), (4, 3), (5, 15)), ((5, 5), (4, 4), (5, 0)), ((9, 5), (4, 4), (9, 11)), ((5, 20), (4, 4), (5, 20))],
    ids=["other windows", "no more strips", "fewer strips", "other weights"],
)
def test_levels_that_do_not_nest_and_weights_of_other_groups_are_refused(counts, widths, groups) -> None:
    levels = Levels(*(windows(np.ones(shape)) for shape in zip(counts, widths, strict=True)))
    with pytest.raises(ParameterError):
        combine(levels, tuple(np.ones((61, count), int) for count in groups))


MEANS, SCATTER, ROWS, COLUMNS = (1.25, 1.0, 0.8), 0.05, 60, 12
LAYOUT = WindowLayout(np.array([20.0, 50.0, 80.0]), 4e-4, 1e-4, COLUMNS)
AREA = 2.0  # m2 of every window; its force is the area over mu
MEAN, REPLICATES, SEED = 0.3, 60, [5, 1]


def levels(*windows):
    """All of these windows touch."""
    return Levels(*((mu, np.ones(mu.shape, bool)) for mu in windows))


@pytest.fixture(scope="module")
def table():
    """Windows m (1 + 0.05 n) with m of each level, n normal, and on more strips a control of correlation 0.995."""
    rng = np.random.default_rng(8)
    seen = 1.0 + SCATTER * rng.standard_normal((3, 5 * ROWS, COLUMNS))
    mu = np.array(MEANS)[:, None, None] * seen[:, :ROWS]
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
    estimates, mu, done = table
    combined = estimates.combined["mean"]
    assert (combined[1].value, combined[1].low, combined[1].high) == (pytest.approx(MEAN),) * 3
    assert [float(each.value) for each in combined] == pytest.approx([MEAN * m for m in MEANS], rel=0.01)
    assert float(estimates.shear.value) == pytest.approx(MEAN, rel=0.01)
    np.testing.assert_array_equal(estimates.mu[0], float(estimates.shear.value) * mu)
    assert done == [(1, 3), (2, 3), (3, 3)]


def test_stored_variables_have_the_numbers_of_the_table_and_its_tests(table):
    statistics, _, _ = table
    variables = table_variables(statistics)
    assert variables["mean"].values.shape == (2, 3)
    np.testing.assert_array_equal(
        variables["combined_mean"].values, [each.value for each in statistics.combined["mean"]]
    )
    np.testing.assert_allclose(variables["lag"].values, 1e-4 * np.arange(COLUMNS))
    np.testing.assert_allclose(variables["triangle"].values[:5], [1.0, 0.75, 0.5, 0.25, 0.0], atol=1e-12)
    line, change = trend(LAYOUT.percentiles, statistics.combined["mean"])
    assert float(variables["trend_combined_mean_line"].values) == float(line.value)
    assert float(variables["trend_combined_mean_change"].values) == float(change.value)
    assert float(variables["trend_combined_mean_change_high"].values) < 0.0
    assert int(variables["beta_nearest"].values) == np.argmin(variables["beta_distance_standardised"].values)
    own = window_lengths(LAYOUT.lags, LAYOUT.window_m)
    assert dict(zip(*(variables[name].values for name in ("length_name", "triangle_length")), strict=True)) == own
    fit = dict(zip(variables["fit_percentile"].values, variables["fit"].values, strict=True))
    assert [fit[20.0], fit[80.0]] == pytest.approx(variables["combined_mean"].values[[0, 2]])
    lines = summary(variables).splitlines()
    assert [line.split(",")[0] for line in lines if not line.startswith("#")] == ["percentile", "20", "50", "80"]


def test_windows_are_stored_as_standardised_densities_and_quantiles(table):
    mu, valid = table[0].mu
    variables = windows_variables((mu, valid), 1)
    for values, density in zip(mu, variables["standard_histogram"].values, strict=True):
        standard = (values - values.mean()) / values.std()
        counts = [np.count_nonzero((low <= standard) & (standard < high)) for low, high in itertools.pairwise(BINS)]
        np.testing.assert_allclose(density, np.array(counts) / values.size / 0.25)
    np.testing.assert_allclose(variables["quantile"].values[[0, 500, 1000]], np.quantile(mu[1], [0.0, 0.5, 1.0]))
    shares = [Estimate(*(np.array(share),) * 3) for share in (0.3, 0.005, 0.02)]
    (warning,) = missing_warnings(shares, LAYOUT.percentiles)
    assert "penetrations of 20 %, 80 % up to 0.3 of the windows" in warning
    assert not list(missing_warnings(shares[1:2], LAYOUT.percentiles[1:2]))


def test_windows_without_scatter_are_refused_with_their_penetration():
    flat = np.ones((3, ROWS, COLUMNS))
    rng = np.random.default_rng(9)
    flat[:2] += SCATTER * rng.standard_normal(flat[:2].shape)
    more = 1.0 + SCATTER * rng.standard_normal((3, 5 * ROWS, COLUMNS))
    with pytest.raises(IllPosedError, match="scatter"):
        friction_table(levels(flat, more), (flat, flat), LAYOUT, MEAN, REPLICATES, SEED)
