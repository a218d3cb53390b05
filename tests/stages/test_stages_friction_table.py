"""The table of friction statistics and summary.csv."""

import csv
import io
from types import SimpleNamespace

import numpy as np
import pytest

from roughslip.friction.resampling import strip_weights
from roughslip.friction.statistics import Combined, combine
from roughslip.probability import Estimate
from roughslip.scene.types import scene_of
from roughslip.stages.friction import combined_at, describe
from roughslip.stages.result_tables.friction_table import (
    COMBINED,
    SOURCES,
    TITLES,
    TRENDS,
    histogram,
    quantiles,
    stored,
    summary,
    table_variables,
)

SCENE = scene_of({"strip": {"window_spacing_m": 1e-4, "window_m": 6e-4}})


def estimate(value, replicates=None):
    """An estimate with an interval of one tenth on either side."""
    value = np.asarray(value, dtype=float)
    spread = np.zeros((*value.shape, 40)) if replicates is None else replicates
    return Estimate(value, value - 0.1, value + 0.1, spread)


@pytest.mark.parametrize(
    ("dimensions", "values", "shape"),
    [
        ((), [1.5], ()),
        (("level",), [1.0, 2.0, 3.0], (3,)),
        (("source", "level"), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], (2, 3)),
        (("source", "level", "lag"), [np.arange(4.0) + 10 * k for k in range(6)], (2, 3, 4)),
    ],
)
def test_estimates_stack_along_source_then_level(dimensions, values, shape):
    found = stored("mean", dimensions, [estimate(value) for value in values])
    assert list(found) == ["mean", "mean_low", "mean_high"]
    expected = np.array(values).reshape(shape)
    for name, shift in (("mean", 0.0), ("mean_low", -0.1), ("mean_high", 0.1)):
        assert found[name].dimensions == dimensions
        np.testing.assert_allclose(found[name].values, expected + shift)
    assert found["mean"].long_name == TITLES["mean"]
    assert "upper" in found["mean_high"].long_name


def test_lengths_are_in_metres_and_what_has_no_title_gets_its_name():
    assert stored("length_integral", (), [estimate(1.0)])["length_integral"].units == "m"
    assert stored("misfit_triangle", (), [estimate(1.0)])["misfit_triangle"].units == "1"
    assert stored("of_mine", (), [estimate(1.0)])["of_mine"].long_name == "of mine"


@pytest.fixture(scope="module")
def table():
    """Two sources and three levels of known moments, by the functions of the friction stage."""
    rng = np.random.default_rng(1)
    job = SimpleNamespace(scene=SCENE)
    weights = strip_weights(12, 60, rng)
    found: dict[str, list[Estimate]] = {}
    for _ in SOURCES:
        for level in range(3):
            mu = 0.4 - 0.1 * level + (0.03 - 0.01 * level) * rng.standard_normal((12, 19)).clip(-3, 3)
            valid = np.ones(mu.shape, dtype=bool)
            valid[0, 0] = level > 0  # the lightest contact misses a window
            for name, one in describe((mu, valid), (mu, np.ones_like(mu)), 2.0, weights, job).items():
                found.setdefault(name, []).append(one)
    return found


def combined(levels):
    return [Combined(*(estimate(10.0 * k + j) for j in range(7))) for k in range(levels)]


def test_every_statistic_has_units_a_title_and_an_interval(table):
    variables = table_variables(table, combined(3), np.array([10.0, 50.0, 90.0]), SCENE.strip)
    for name, variable in variables.items():
        assert variable.units
        assert variable.long_name
        assert np.ndim(variable.values) == len(variable.dimensions), name
        if f"{name}_low" in variables:
            assert np.all(variables[f"{name}_low"].values <= variables[f"{name}_high"].values)
    assert set(table) <= set(TITLES)
    np.testing.assert_allclose(variables["mean"].values, [[0.4, 0.3, 0.2]] * 2, atol=0.01)
    np.testing.assert_allclose(variables["missing_share"].values, [[1 / 228, 0, 0]] * 2)
    np.testing.assert_allclose(variables["ratio_of_sums"].values, 2 * variables["mean"].values, atol=1e-3)
    np.testing.assert_allclose(variables["lag"].values, 1e-4 * np.arange(19))
    np.testing.assert_allclose(variables["triangle"].values[[0, 3, 6, 12]], [1, 0.5, 0, 0], atol=1e-12)
    for name in (*TRENDS, *(f"combined_{name}" for name in COMBINED[:3])):
        change, levels = (variables[key].values for key in (f"trend_{name}_change", name))
        np.testing.assert_allclose(change, levels[..., -1] - levels[..., 0])
    np.testing.assert_allclose(variables["trend_mean_slope"].values, [-0.0025] * 2, atol=2e-4)


def test_one_level_has_no_trend(table):
    one = {name: [estimates[1], estimates[4]] for name, estimates in table.items()}
    variables = table_variables(one, combined(1), np.array([50.0]), SCENE.strip)
    assert not [name for name in variables if name.startswith("trend_")]
    assert variables["mean"].values.shape == (2, 1)
    assert "combined_mean" in variables


def test_summary_has_a_row_a_penetration_with_units_in_the_names(table):
    percentiles = np.array([10.0, 50.0, 90.0])
    variables = table_variables(table, combined(3), percentiles, SCENE.strip)
    rows = list(csv.DictReader(io.StringIO(summary(variables, percentiles))))
    assert [float(row["percentile"]) for row in rows] == [10.0, 50.0, 90.0]
    for level, row in enumerate(rows):
        assert None not in row
        assert None not in row.values()
        assert row["beta_at_bound"] == str(variables["beta_at_bound"].values[0, level])
        for name, column in (
            ("combined_std", "combined_std"),
            ("length_least_squares_low", "length_least_squares_low_m"),
        ):
            value = variables[name].values
            assert float(row[column]) == pytest.approx(value[level] if value.ndim == 1 else value[0, level], rel=1e-5)


def test_quantiles_are_those_of_the_valid_windows():
    mu, valid = np.arange(20.0).reshape(4, 5), np.ones((4, 5), dtype=bool)
    valid[3, 4] = False
    found = quantiles(mu, valid)
    probability, values = found["quantile_probability"].values, found["quantile"].values
    assert (probability[0], probability[-1], len(probability)) == (0.0, 1.0, 1001)
    np.testing.assert_allclose(values, 18 * probability, atol=1e-12)  # of 0, 1, ..., 18, equally likely


def test_histogram_is_a_density_of_the_valid_windows():
    mu = np.array([[0.1, 0.2, 9.0], [0.3, 0.3, 0.4]])
    valid = np.array([[True, True, False], [True, True, True]])
    found = histogram(mu, valid)
    edges = found["histogram_edge"].values
    assert (edges[0], edges[-1]) == (0.1, 0.4)
    assert np.sum(found["histogram"].values * np.diff(edges)) == pytest.approx(1.0)


def test_strips_that_were_solved_are_the_control_and_only_the_others_are_new():
    rng = np.random.default_rng(2)
    solved = 0.3 + 0.01 * rng.standard_normal((2, 6, 9))
    cheap = np.concatenate(
        [solved + 0.002 * rng.standard_normal(solved.shape), 0.3 + 0.01 * rng.standard_normal((2, 14, 9))], axis=1
    )
    mu = {
        name: (values, np.ones(values.shape, dtype=bool)) for name, values in (("solved", solved), ("expansion", cheap))
    }
    weights = {"solved": strip_weights(6, 50, rng), "control": strip_weights(14, 50, rng)}
    found = combined_at(mu, 1, 6, weights)
    valid = [np.ones((strips, 9), dtype=bool) for strips in (6, 6, 14)]
    parts = zip((solved[1], cheap[1, :6], cheap[1, 6:]), valid, strict=True)
    expected = combine(*parts, weights["solved"], weights["control"])
    assert (found.mean.value, found.std.value) == (expected.mean.value, expected.std.value)
