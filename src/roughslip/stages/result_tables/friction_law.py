"""Friction coefficient: candidate distributions, tests of equality over penetrations, effect of the window."""

from __future__ import annotations

import numpy as np

from roughslip import store
from roughslip.friction.correlation import LONGEST_WINDOWS, correlation_fit, white_autocorrelation
from roughslip.friction.distribution_families import FAMILIES, fit_candidates
from roughslip.friction.marginal import standardised_distribution
from roughslip.friction.penetration import p_value, p_value_of_equality, penetration_curve
from roughslip.friction.statistics import Combined
from roughslip.probability import Estimate
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import geometry
from roughslip.stages.result_tables.friction_table import trend_of

WHITE_REPLICATES = 200
FIT_POINTS = 91  # of mu_fit(d)
STANDARD = np.linspace(-2.5, 3.5, 25)  # standardised mu at which the laws of the levels are compared

Windows = tuple[np.ndarray, np.ndarray]  # mu and valid, each (levels, strips, windows)
TESTS = {
    "p_equal_law": "p-value of the standardised law being the same at every penetration",
    "p_equal_correlation": "p-value of the autocorrelation being the same at every penetration",
    "p_exponential_nearer": "two-sided p-value of exponential and triangle being as near, at median penetration",
    "p_no_skewness": "p-value of no skewness at median penetration",
    "p_no_kurtosis": "p-value of no excess kurtosis at median penetration",
    "p_no_change_of_mean": "p-value of the combined mean being the same at the last penetration as at the first",
    "p_no_change_of_std": "p-value of the combined standard deviation being the same at the last as at the first",
    "p_no_change_of_variation": "p-value of the combined coefficient of variation being the same there",
}


def candidate_variables(mu: Windows, weights: np.ndarray) -> dict[str, store.Variable]:
    """A row a family and level: distance of the solved windows from the family, and the skewness of its member."""
    levels = [fit_candidates(values, valid, weights) for values, valid in zip(*mu, strict=True)]
    variables = {
        "family": store.Variable(
            ("family",), np.array(FAMILIES), "1", "distribution compared with the four-parameter Beta"
        )
    }
    for name, title in (
        ("distance", "2-Wasserstein distance of the windows from the family over their standard deviation"),
        ("skewness", "skewness of the nearest member of the family"),
    ):
        columns = [
            np.array([[getattr(getattr(level[family], name), part) for level in levels] for family in FAMILIES])
            for part in ("value", "low", "high")
        ]
        variables |= store.with_interval(f"family_{name}", ("family", "level"), columns, "1", title)
    return variables


def p_value_variables(
    mu: Windows,
    table: dict[str, list[Estimate]],
    combined: list[Combined],
    percentiles: np.ndarray,
    weights: np.ndarray,
) -> dict[str, store.Variable]:
    """p-values of what the paper says of the solved windows; NaN where there is one penetration only."""
    levels, median = len(percentiles), int(np.flatnonzero(percentiles == 50.0)[0])
    found = dict.fromkeys(TESTS, np.nan)
    if levels > 1:
        laws = [standardised_distribution(values, valid, weights, STANDARD) for values, valid in zip(*mu, strict=True)]
        found["p_equal_law"] = p_value_of_equality(np.stack(laws))
        curves = np.stack([estimate.rows for estimate in table["autocorrelation"][:levels]])
        found["p_equal_correlation"] = p_value_of_equality(curves)
        for name in ("mean", "std", "variation"):
            change = trend_of(percentiles, [getattr(each, name) for each in combined]).change
            found[f"p_no_change_of_{name}"] = p_value(change)
    found["p_exponential_nearer"] = p_value(table["misfit_difference"][median])
    found["p_no_skewness"] = p_value(table["skewness"][median])
    found["p_no_kurtosis"] = p_value(table["kurtosis"][median])
    return {name: store.Variable((), value, "1", TESTS[name]) for name, value in found.items()}


def fit_variables(combined: list[Combined], percentiles: np.ndarray) -> dict[str, store.Variable]:
    """mu_fit(d) between the first and the last level, its slope, and their bands; of one level there is no slope."""
    means, points = [each.mean for each in combined], percentiles
    columns = [[getattr(means[0], part)[None] for part in ("value", "low", "high")], [np.full(1, np.nan)] * 3]
    if len(percentiles) > 1:
        points, curve = np.linspace(percentiles[0], percentiles[-1], FIT_POINTS), penetration_curve(percentiles, means)
        columns = [[one.value, one.low, one.high] for one in (curve.at(points), curve.slope(points))]
    names = {
        "fit": ("1", "mu_fit, the mean friction coefficient as a function of penetration"),
        "fit_slope": ("percent-1", "derivative of mu_fit by the percentile of penetration"),
    }
    variables = {"fit_percentile": store.Variable(("penetration",), points, "percent", "penetration")}
    for (name, (unit, title)), parts in zip(names.items(), columns, strict=True):
        variables |= store.with_interval(name, ("penetration",), parts, unit, title)
    return variables


def white_variables(scene: Scene, strips: int, count: int) -> dict[str, store.Variable]:
    """What so many windows of white pressure on each strip would show in this measurement: autocorrelation, length."""
    strip, windows = scene.strip, geometry.windows(scene)
    rng = np.random.default_rng([scene.seed, geometry.STREAM_WHITE])
    columns = windows.length + (count - 1) * windows.spacing
    curve = white_autocorrelation(strips, columns, windows.length, windows.spacing, count, WHITE_REPLICATES, rng)
    lags = strip.window_spacing_m * np.arange(count)
    length = correlation_fit(lags, curve, strip.window_m).least_squares
    title = "autocorrelation of windows of white pressure, and the range of 95 % of such measurements"
    variables = store.with_interval("white_autocorrelation", ("lag",), [curve.value, curve.low, curve.high], "1", title)
    title = f"exponential length of windows of white pressure, lags to {LONGEST_WINDOWS:g} windows; range of 95 %"
    return variables | store.with_interval("white_length", (), [length.value, length.low, length.high], "m", title)
