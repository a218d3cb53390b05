"""The table of friction statistics: names, units and titles of what the friction stage stores, and summary.csv."""

from __future__ import annotations

import numpy as np

from roughslip import store
from roughslip.friction.correlation import triangular
from roughslip.friction.marginal import SHAPES
from roughslip.friction.penetration import Trend, trend
from roughslip.friction.statistics import PERCENTS, Combined
from roughslip.probability import Estimate
from roughslip.scene.strip import Strip

SOURCES = ("solved", "expansion")
HISTOGRAM_BINS = 40
QUANTILES = 1000
COMBINED = ("mean", "std", "variation", "mean_variance_ratio", "std_variance_ratio")
GAINS = ("mean", "std")  # also given as the ratio of solves at equal standard error
TRENDS = ("mean", "std", "variation", "length_least_squares", "beta_distance_standardised")
UNITS = dict.fromkeys(("length_least_squares", "length_half_window", "length_one_over_e", "length_integral"), "m")
TITLES = {
    "mean": "mean friction coefficient",
    "std": "standard deviation of the friction coefficient",
    "variation": "coefficient of variation",
    "skewness": "skewness",
    "kurtosis": "excess kurtosis",
    "quantiles": "quantiles of the friction coefficient",
    "effective_windows": "effective number of independent windows",
    "missing_share": "share of windows with too little contact for a friction coefficient",
    "ratio_of_sums": "shear strength times contact area over normal force, all windows together",
    "autocorrelation": "autocorrelation of the friction coefficient along the strip",
    "length_least_squares": "exponential length by least squares over lags to three windows",
    "length_half_window": "exponential length by least squares over lags to half a window",
    "length_one_over_e": "lag at which the autocorrelation falls to 1/e",
    "length_integral": "integral of the autocorrelation over lags to three windows",
    "misfit_exponential": "rms distance of the autocorrelation from its exponential",
    "misfit_triangle": "rms distance of the autocorrelation from the window's own triangle",
    "misfit_difference": "mean square distance from the exponential less that from the triangle",
    "beta_a": "first shape of the four-parameter Beta",
    "beta_b": "second shape of the four-parameter Beta",
    "beta_lower": "lower end of the four-parameter Beta",
    "beta_upper": "upper end of the four-parameter Beta",
    "beta_misfit": "2-Wasserstein distance of the windows from the four-parameter Beta over their standard deviation",
    "scaled_beta_a": "first shape after scaling by the sample extremes",
    "scaled_beta_b": "second shape after scaling by the sample extremes",
    "scaled_beta_lower": "sample minimum",
    "scaled_beta_upper": "sample maximum",
    "beta_distance_standardised": "Kolmogorov distance to Beta(2.1, 5), both standardised",
    "beta_distance_scaled": "Kolmogorov distance to Beta(2.1, 5) after scaling by the sample extremes",
    "combined_mean": "mean friction coefficient, solved windows with the expansion as control",
    "combined_std": "standard deviation, solved windows with the expansion as control",
    "combined_variation": "coefficient of variation, solved windows with the expansion as control",
    "combined_mean_variance_ratio": "variance of the combined mean over that of the solved mean",
    "combined_std_variance_ratio": "variance of the combined standard deviation over that of the solved",
    "combined_mean_gain": "solved strips alone that give the mean as well, for each that was solved",
    "combined_std_gain": "solved strips alone that give the standard deviation as well, for each that was solved",
}


def stored(name: str, dimensions: tuple[str, ...], estimates: list[Estimate]) -> dict[str, store.Variable]:
    """Value and ends of the interval of estimates, which stack along source, level, both or none."""
    title, unit = TITLES.get(name, name.replace("_", " ")), UNITS.get(name, "1")
    leading: tuple[int, ...] = () if not dimensions else (-1,)
    if dimensions[:2] == ("source", "level"):
        leading = (len(SOURCES), -1)
    shape = (*leading, *np.shape(estimates[0].value))
    columns = [
        np.array([getattr(each, part) for each in estimates]).reshape(shape) for part in ("value", "low", "high")
    ]
    return store.with_interval(name, dimensions, columns, unit, title)


def table_variables(
    table: dict[str, list[Estimate]], combined: list[Combined], percentiles: np.ndarray, strip: Strip
) -> dict[str, store.Variable]:
    """Every statistic with its interval, and how those of TRENDS change with penetration where there are two levels.

    table : per name the estimates of all levels of the first source, then of the second
    combined : per level the solved windows with the expansion as control
    percentiles : (levels,) [%]; strip : the section of the scene
    """
    levels = len(percentiles)
    extra = {"quantiles": ("quantile",), "autocorrelation": ("lag",)}
    variables = {
        "source": store.Variable(("source",), np.array(SOURCES), "1", "where the pressure comes from"),
        "percentile": store.Variable(("level",), percentiles, "percent", "share of heights above the plane"),
        "quantile": store.Variable(("quantile",), PERCENTS, "percent", "probability of the quantiles"),
    }
    for name, estimates in table.items():
        variables |= stored(name, ("source", "level", *extra.get(name, ())), estimates)
    for name in COMBINED:
        variables |= stored(f"combined_{name}", ("level",), [getattr(estimate, name) for estimate in combined])
    for name in GAINS:
        ratios = [getattr(each, f"{name}_variance_ratio") for each in combined]
        gains = [Estimate(1.0 / each.value, 1.0 / each.high, 1.0 / each.low, each.replicates) for each in ratios]
        variables |= stored(f"combined_{name}_gain", ("level",), gains)
    if levels > 1:
        variables |= trend_variables(table, combined, percentiles)
    shapes = np.stack([variables["beta_a"].values, variables["beta_b"].values])
    at_bound = np.any((shapes < 1.001 * SHAPES[0]) | (shapes > 0.999 * SHAPES[1]), axis=0)
    title = f"whether a shape of the Beta lies at the end of its range, {SHAPES[0]:g} to {SHAPES[1]:g}"
    variables["beta_at_bound"] = store.Variable(("source", "level"), at_bound.astype(np.int8), "1", title)
    lags = strip.window_spacing_m * np.arange(len(table["autocorrelation"][0].value))
    variables["lag"] = store.Variable(("lag",), lags, "m", "distance of two windows")
    variables["triangle"] = store.Variable(
        ("lag",), triangular(lags, strip.window_m), "1", "autocorrelation that the window alone would give"
    )
    return variables


def trend_variables(
    table: dict[str, list[Estimate]], combined: list[Combined], percentiles: np.ndarray
) -> dict[str, store.Variable]:
    """Slope over penetration, and last less first level, of TRENDS by source and of the combined moments."""
    levels = len(percentiles)
    variables: dict[str, store.Variable] = {}
    for name in TRENDS:
        trends = [trend_of(percentiles, table[name][row : row + levels]) for row in (0, levels)]
        variables |= stored(f"trend_{name}_slope", ("source",), [each.slope for each in trends])
        variables |= stored(f"trend_{name}_change", ("source",), [each.change for each in trends])
    for name in COMBINED[:3]:
        one = trend_of(percentiles, [getattr(estimate, name) for estimate in combined])
        variables |= stored(f"trend_combined_{name}_slope", (), [one.slope])
        variables |= stored(f"trend_combined_{name}_change", (), [one.change])
    return variables


def trend_of(percentiles: np.ndarray, estimates: list[Estimate]) -> Trend:
    """Trend over penetration of estimates that share their replicates."""
    return trend(percentiles, np.array([e.value for e in estimates]), np.array([e.replicates for e in estimates]))


def histogram(mu: np.ndarray, valid: np.ndarray) -> dict[str, store.Variable]:
    """Density of the windows of one penetration."""
    counts, edges = np.histogram(mu[valid], HISTOGRAM_BINS)
    density = counts / counts.sum() / np.diff(edges)
    return {
        "histogram": store.Variable(("bin",), density, "1", "density of solved windows at median penetration"),
        "histogram_edge": store.Variable(("edge",), edges, "1", "edges of its bins"),
    }


def quantiles(mu: np.ndarray, valid: np.ndarray) -> dict[str, store.Variable]:
    """Quantiles of the windows of one penetration at the probabilities 0, 1/1000, ..., 1."""
    probability = np.arange(QUANTILES + 1) / QUANTILES
    found = np.quantile(mu[valid], probability)
    return {
        "quantile": store.Variable(("probability",), found, "1", "quantiles of solved windows at median penetration"),
        "quantile_probability": store.Variable(("probability",), probability, "1", "their probabilities"),
    }


def summary(variables: dict[str, store.Variable], percentiles: np.ndarray) -> str:
    """summary.csv: a row a penetration; combined mean and scatter, and the shape from the solved windows.

    beta_at_bound is 1 where a shape of the Beta lies at the end of its range, so that the shapes are not determined.
    """
    columns = ["combined_mean", "combined_std", "combined_variation"]
    shapes = ["ratio_of_sums", "skewness", "kurtosis", "length_least_squares", "beta_a", "beta_b", "missing_share"]
    names = [name + suffix for name in columns + shapes for suffix in ("", "_low", "_high")]
    titles = [f"{name}_m" if name.startswith("length") else name for name in names]
    header = ",".join(["percentile", *titles, "beta_at_bound"])
    at_bound = np.asarray(variables["beta_at_bound"].values)[0]
    rows = []
    for level, percentile in enumerate(percentiles):
        values = [np.asarray(variables[name].values) for name in names]
        cells = [value[level] if value.ndim == 1 else value[0, level] for value in values]
        rows.append(",".join([f"{percentile:g}", *(f"{cell:.6g}" for cell in cells), str(int(at_bound[level]))]))
    return "\n".join([header, *rows]) + "\n"
