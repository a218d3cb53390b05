"""The table of friction statistics and summary.csv."""

from types import SimpleNamespace

import numpy as np
import pytest

from roughslip.friction.resampling import strip_weights
from roughslip.friction.statistics import Combined
from roughslip.probability import Estimate
from roughslip.scene.types import scene_of
from roughslip.stages.friction import describe
from roughslip.stages.result_tables.friction_table import (
    COMBINED,
    SOURCES,
    TITLES,
    TRENDS,
    distribution,
    table_variables,
)

SCENE = scene_of({"strip": {"window_spacing_m": 1e-4, "window_m": 6e-4}})


def estimate(value, replicates=None):
    """An estimate with an interval of one tenth on either side."""
    value = np.asarray(value, dtype=float)
    spread = np.zeros((*value.shape, 40)) if replicates is None else replicates
    return Estimate(value, value - 0.1, value + 0.1, spread)


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


def test_quantiles_are_those_of_the_valid_windows():
    mu, valid = np.arange(20.0).reshape(4, 5), np.ones((4, 5), dtype=bool)
    valid[3, 4] = False
    found = distribution(mu, valid)
    probability, values = found["quantile_probability"].values, found["quantile"].values
    assert (probability[0], probability[-1], len(probability)) == (0.0, 1.0, 1001)
    np.testing.assert_allclose(values, 18 * probability, atol=1e-12)  # of 0, 1, ..., 18, equally likely
