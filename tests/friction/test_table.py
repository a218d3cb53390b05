"""The friction table: a control on more strips, calibration, sources and trends, on known windows."""

import math

import numpy as np
import pytest

from roughslip.errors import IllPosedError
from roughslip.friction.table import (
    WindowLayout,
    bootstrap,
    combine,
    controlled,
    curve_over_penetration,
    friction_table,
    trend,
)
from roughslip.friction.table_variables import missing_warnings
from roughslip.friction.windows import strip_weights
from roughslip.probability import Estimate

STRIPS, MANY, WINDOWS = 25, 250, 4


def windows(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """mu and valid."""
    return values, np.ones(values.shape, bool)


def test_the_truth_as_control_returns_the_pooled_sample() -> None:
    """The weighted mean of both estimates of each statistic, of logarithms where it is positive."""
    rng = np.random.default_rng(12)
    control = 2.5 + 0.3 * rng.standard_normal((STRIPS + MANY, WINDOWS))
    weights = strip_weights(STRIPS, 100, rng), strip_weights(MANY, 100, rng)
    same, many = control[:STRIPS], control[STRIPS:]
    rows, alone = combine(bootstrap(*windows(same), weights[0]), windows(control), weights)
    share = MANY / (STRIPS + MANY)
    for name, one in (("mean", np.mean), ("std", np.std)):
        assert math.exp(rows[name][0]) == pytest.approx(one(same) ** (1 - share) * one(many) ** share, rel=1e-12)
        assert math.exp(alone[name][0]) == pytest.approx(one(many), rel=1e-12)
    assert rows["autocorrelation"][0, 0] == 1.0
    same[:] = same[0]  # a control that scatters within strips and not between them says nothing
    solved = bootstrap(*windows(one := rng.random(same.shape)), weights[0])
    rows, _ = combine(solved, windows(control), weights)
    assert math.exp(rows["mean"][0]) == pytest.approx(one.mean(), rel=1e-12)


def test_the_scatter_of_the_other_strips_lowers_the_weight_of_the_control() -> None:
    """Other strips with a quarter of the variance: alpha = 1 / (1 + 1/4)."""
    same, many = np.array([3.0, 1.0, -1.0, 1.0, -1.0]), np.array([1.0, 0.5, 0.5, -0.5, -0.5])
    assert controlled({"mean": same}, {"mean": same}, {"mean": many}, 0.25)["mean"][0] == pytest.approx(3.0 - 0.8 * 2.0)


MEANS, SCATTER, ROWS, COLUMNS = (1.25, 1.0, 0.8), 0.05, 60, 12
LAYOUT = WindowLayout(np.array([20.0, 50.0, 80.0]), 4e-4, 1e-4, COLUMNS)
MEAN, REPLICATES, SEED = 0.3, 60, [5, 1]


def sums(mu):
    """Area and force of each level, at a shear strength of 1 Pa."""
    return [(np.full(level.shape, 2.0), 2.0 / level) for level in mu]


@pytest.fixture(scope="module")
def table():
    """Windows m (1 + 0.05 n) with m of each level, n normal, and on more strips a control of correlation 0.995."""
    rng = np.random.default_rng(8)
    seen = 1.0 + SCATTER * rng.standard_normal((3, 5 * ROWS, COLUMNS))
    mu = np.array(MEANS)[:, None, None] * seen[:, :ROWS]
    control = 0.9 * np.array(MEANS)[:, None, None] * (seen + 0.1 * SCATTER * rng.standard_normal(seen.shape))
    done: list[tuple[int, int]] = []
    arguments = sums(mu), sums(control), 1.0, LAYOUT, MEAN, REPLICATES, SEED
    return friction_table(*arguments, lambda *pair: done.append(pair)), mu, control, done


def test_the_mean_at_the_median_is_as_given_and_the_others_follow(table):
    """The combined mean is exact at 50 %, in each replicate; others are 0.3 times the ratio of means, to
    4 x 0.05 / sqrt(60 x 12). The shear strength is 0.3 Pa over a mean of 1. What all levels share cancels."""
    estimates, mu, control, done = table
    combined = estimates.combined["mean"]
    assert (combined[1].value, combined[1].low, combined[1].high) == (pytest.approx(MEAN),) * 3
    assert [float(each.value) for each in combined] == pytest.approx([MEAN * m for m in MEANS], rel=0.01)
    assert float(estimates.shear.value) == pytest.approx(MEAN, rel=0.01)
    own = [values for values, _ in estimates.mu]
    np.testing.assert_allclose(own, float(estimates.shear.value) * mu, rtol=1e-14)
    for name, one in (("mean", np.mean), ("std", np.std)):  # of the expansion alone, in the same units
        alone = [float(each.value) for each in estimates.solved[name][3:]]
        assert alone == pytest.approx([float(estimates.shear.value) * one(level[ROWS:]) for level in control])
    for level in range(3):
        variation = estimates.combined["std"][level].rows / estimates.combined["mean"][level].rows
        np.testing.assert_allclose(estimates.combined["variation"][level].rows, variation, rtol=1e-12)
    assert done == [(1, 3), (2, 3), (3, 3)]


def test_windows_without_a_coefficient_are_warned_of_and_without_scatter_refused():
    shares = [Estimate(*(np.array(share),) * 3) for share in (0.3, 0.005, 0.02)]
    (warning,) = missing_warnings(shares, LAYOUT.percentiles)
    assert "penetrations of 20 %, 80 % up to 0.3 of the windows" in warning
    assert not list(missing_warnings(shares[1:2], LAYOUT.percentiles[1:2]))
    rng, flat = np.random.default_rng(9), np.ones((3, ROWS, COLUMNS))
    flat[:2] += SCATTER * rng.standard_normal(flat[:2].shape)
    more = 1.0 + SCATTER * rng.standard_normal((3, 5 * ROWS, COLUMNS))
    found = friction_table(sums(flat), sums(more), 1.0, LAYOUT, MEAN, REPLICATES, SEED)
    assert found.layout.percentiles.tolist() == [20.0, 50.0]
    assert "no scatter" in found.missing[80.0]
    assert len(found.solved["mean"]) == 2 * len(found.combined["mean"]) == 4
    with pytest.raises(IllPosedError, match=r"percentile 50: .* no scatter"):
        friction_table(sums(flat[[0, 2, 1]]), sums(more), 1.0, LAYOUT, MEAN, REPLICATES, SEED)


def test_without_an_expansion_statistics_are_those_of_the_solved_windows(table):
    """Its own are NaN. An expansion that never touches is none."""
    mu = table[1]
    for none in (None, sums(np.full((3, 4 * ROWS, COLUMNS), 1.0))):
        for area, _ in none or ():
            area[:] = 0.0
        found = friction_table(sums(mu), none, 1.0, LAYOUT, MEAN, REPLICATES, SEED)
        means = [float(each.value) for each in found.combined["mean"]]
        assert means == pytest.approx([MEAN * level.mean() / mu[1].mean() for level in mu], rel=1e-12)
        assert np.isnan([float(each.value) for each in found.solved["std"][3:]]).all()


def test_a_straight_line_stays_one_with_its_band_and_has_its_change():
    """Every replicate is the line times 1 + a number between -0.05 and 0.05, of which 95 % are the interval. The line
    through all levels is not that of the ends: deviations -40, -10, 10, 40 of q times values sum to 6."""
    q, at = np.array([10.0, 40.0, 60.0, 90.0]), np.linspace(10.0, 90.0, 37)
    factors = np.concatenate(([1.0], 1 + np.linspace(-0.05, 0.05, 81)))
    levels = [Estimate.from_rows((0.4 - 0.002 * level) * factors) for level in q]
    curve = curve_over_penetration(q, levels, at)
    np.testing.assert_allclose(curve.value, 0.4 - 0.002 * at, rtol=1e-14)
    np.testing.assert_allclose(curve.high, (0.4 - 0.002 * at) * (1 + 0.05 * 0.95), rtol=1e-12)
    for change in trend(q, levels):
        np.testing.assert_allclose([change.value, change.low], [-0.16, -0.16 * (1 + 0.05 * 0.95)], rtol=1e-12)
    levels = [Estimate.from_rows(np.full(50, value)) for value in (0.5, 0.0, 1.0, 0.4)]
    line, change = trend(q, levels)
    assert float(line.value) == pytest.approx(80 * 6.0 / 3400.0, rel=1e-12)
    assert float(change.value) == pytest.approx(-0.1)
