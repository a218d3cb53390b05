"""The friction table as stored: statistics with units and titles, mu_fit(d), summary.csv."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from roughslip import store
from roughslip.friction.bowden_tabor import Windows
from roughslip.friction.correlation import LENGTHS, triangular, window_lengths
from roughslip.friction.marginal import SHAPES, nearest_level
from roughslip.friction.penetration import curve_over_penetration, trend
from roughslip.friction.table import BY_SOURCE, FrictionTable
from roughslip.probability import Estimate
from roughslip.probability.estimate import columns_of

MOST_MISSING = 0.01  # of the windows, above which a warning says that some have no friction coefficient
FIT_POINTS = 91  # of mu_fit(d)
SOURCES = ("solved", "expansion")
BINS = np.linspace(-4.0, 6.0, 41)  # of standardised mu
QUANTILES = 1000
TRENDS = ("mean", "std", "variation", "length_least_squares")
"""Statistics from all strips of which the change with penetration is given too."""
LOAD = {  # further columns of summary.csv, of what stage friction stores of load
    "force_per_window": "force_per_window_n",
    "nominal_pressure": "nominal_pressure_pa",
    "load_windows": "load_windows",
    "load_std": "load_std",
}
SUMMARY = (
    'Friction of sliding windows, a row a penetration. Python: pandas.read_csv("summary.csv", comment="#")',
    "Columns with _low and _high are the ends of the 95 % interval of the column without. Columns combined_... take",
    "solved windows with the expansion as control variate: use these. The others take solved windows alone. Where",
    "beta_at_bound is 1, the shapes of the Beta are not determined.",
)
TITLES = {
    "mean": "mean friction coefficient",
    "std": "standard deviation of the friction coefficient",
    "variation": "coefficient of variation",
    "skewness": "skewness; of 20 strips or more its interval holds the truth in 94 to 98 % of cases",
    "kurtosis": "excess kurtosis; of 20 strips or more its interval holds the truth in 90 to 96 %, else it is too low",
    "missing_share": "share of windows with too little contact for a friction coefficient",
    "ratio_of_sums": "shear strength times contact area over normal force, all windows together",
    "autocorrelation": "autocorrelation of the friction coefficient along the strip",
    "length_least_squares": "exponential length by least squares over lags to three windows",
    "length_log_line": "length of a straight line through the logarithm to lags of 0.9 of a window",
    "length_one_over_e": "lag at which the autocorrelation falls to 1/e",
    "misfit_exponential": "rms distance of the autocorrelation from its exponential",
    "misfit_triangle": "rms distance of the autocorrelation from the window's own triangle",
    "misfit_difference": "mean square distance from the exponential less that from the triangle",
    "beta_a": "first shape of the four-parameter Beta",
    "beta_b": "second shape of the four-parameter Beta",
    "beta_lower": "lower end of the four-parameter Beta",
    "beta_upper": "upper end of the four-parameter Beta",
    "beta_misfit": "2-Wasserstein distance of the windows from the four-parameter Beta over their standard deviation",
    "set_beta_a": "first shape after scaling sets of 100 windows by their extremes: median, 5 and 95 %",
    "set_beta_b": "second shape after scaling sets of 100 windows by their extremes: median, 5 and 95 %",
    "beta_distance_standardised": "Kolmogorov distance to Beta(2.1, 5), both standardised",
    "combined_mean_gain": "solved strips alone that give the mean as well, for each that was solved",
    "combined_std_gain": "solved strips alone that give the standard deviation as well, for each that was solved",
}

CONTROLLED = ", solved windows with the expansion as control"


def stored(name: str, dimensions: tuple[str, ...], estimates: list[Estimate]) -> dict[str, store.Variable]:
    """Value and ends of the interval of estimates, which stack along source, level, both or none."""
    plain = name.removeprefix("combined_")
    title = TITLES.get(name) or TITLES.get(plain, plain.replace("_", " ")) + (CONTROLLED if plain != name else "")
    unit = "m" if "length_" in name else "1"
    leading: tuple[int, ...] = () if not dimensions else (-1,)
    if dimensions[:2] == ("source", "level"):
        leading = (len(SOURCES), -1)
    shape = (*leading, *np.shape(estimates[0].value))
    columns = [column.reshape(shape) for column in columns_of(estimates)]
    return store.with_interval(name, dimensions, columns, unit, title)


def table_variables(table: FrictionTable) -> dict[str, store.Variable]:
    """Every statistic with its interval, and how those of TRENDS change with penetration where there are two levels."""
    layout, combined = table.layout, table.combined
    variables = {
        "source": store.Variable(("source",), np.array(SOURCES), "1", "where the pressure comes from"),
        "percentile": store.Variable(("level",), layout.percentiles, "percent", "share of heights above the plane"),
        "lag": store.Variable(("lag",), layout.lags, "m", "distance of two windows"),
    }
    for name, estimates in table.solved.items():
        sources, lag = ("source",) if name in BY_SOURCE else (), ("lag",) if name == "autocorrelation" else ()
        variables |= stored(name, (*sources, "level", *lag), estimates)
    for name, estimates in combined.items():
        variables |= stored(f"combined_{name}", ("level", *(("lag",) if name == "autocorrelation" else ())), estimates)
    for name in TRENDS if len(layout.percentiles) > 1 else ():
        line, change = trend(layout.percentiles, combined[name])
        variables |= stored(f"trend_combined_{name}_line", (), [line])
        variables |= stored(f"trend_combined_{name}_change", (), [change])
    for name in BY_SOURCE:
        gains, gain = np.array([1.0 / level.variance_share[name] for level in table.levels]), f"combined_{name}_gain"
        variables[gain] = store.Variable(("level",), gains, "1", TITLES[gain])
    shapes = np.stack([variables["beta_a"].values, variables["beta_b"].values])
    at_bound = np.any((shapes < 1.001 * SHAPES[0]) | (shapes > 0.999 * SHAPES[1]), axis=0)
    title = f"whether a shape of the Beta lies at the end of its range, {SHAPES[0]:g} to {SHAPES[1]:g}"
    variables["beta_at_bound"] = store.Variable(("level",), at_bound.astype(np.int8), "1", title)
    distance, skewness = (variables[name].values for name in ("beta_distance_standardised", "combined_skewness"))
    nearest, title = nearest_level(distance, skewness, distance >= 0.0), "number of the level nearest to Beta(2.1, 5)"
    variables["beta_nearest"] = store.Variable((), nearest, "1", title)
    return variables | fit_variables(table) | triangle_variables(table)


def fit_variables(table: FrictionTable) -> dict[str, store.Variable]:
    """mu_fit(d) between the first and the last level, with its band; of one level the mean alone."""
    points, means = table.layout.percentiles, table.combined["mean"]
    columns = columns_of(means)
    if len(points) > 1:
        points = np.linspace(points[0], points[-1], FIT_POINTS)
        columns = columns_of(curve_over_penetration(table.layout.percentiles, means, points))
    variable = store.Variable(("penetration",), points, "percent", "penetration")
    title = "mu_fit, the mean friction coefficient as a function of penetration"
    return {"fit_percentile": variable} | store.with_interval("fit", ("penetration",), columns, "1", title)


def triangle_variables(table: FrictionTable) -> dict[str, store.Variable]:
    """What the triangle of the window alone gives: the autocorrelation, and the lengths that stand for it."""
    lags, window = table.layout.lags, table.layout.window_m
    lengths = window_lengths(lags, window)
    title = "autocorrelation that the window alone would give"
    return {
        "triangle": store.Variable(("lag",), triangular(lags, window), "1", title),
        "length_name": store.Variable(("length",), np.array(LENGTHS), "1", "how a length follows from the curve"),
        "triangle_length": store.Variable(("length",), [lengths[name] for name in LENGTHS], "m", f"length of {title}"),
    }


def missing_warnings(shares: list[Estimate], percentiles: np.ndarray) -> Iterator[str]:
    """One where more than MOST_MISSING of the windows of a penetration have no friction coefficient."""
    missing = {f"{level:g} %": float(share.value) for level, share in zip(percentiles, shares, strict=True)}
    worst = max(missing, key=lambda level: missing[level])
    if missing[worst] > MOST_MISSING:
        where = ", ".join(level for level, share in missing.items() if share > MOST_MISSING)
        yield (
            f"at penetrations of {where} up to {missing[worst]:.2g} of the windows have no friction coefficient and "
            "are left out: take larger windows"
        )


def windows_variables(mu: Windows, median: int) -> dict[str, store.Variable]:
    """Densities of the standardised windows of every penetration, and their quantiles at the median.

    mu : (levels, S, W) friction coefficient and bool
    """
    standard = [(values[valid] - values[valid].mean()) / values[valid].std() for values, valid in zip(*mu, strict=True)]
    density = [np.histogram(values, BINS)[0] / len(values) / np.diff(BINS) for values in standard]
    title = "density of solved windows, less their mean, over their standard deviation"
    probability = np.arange(QUANTILES + 1) / QUANTILES
    values = np.quantile(mu[0][median][mu[1][median]], probability)
    return {
        "standard_histogram": store.Variable(("level", "standard_bin"), np.array(density), "1", title),
        "standard_edge": store.Variable(("standard_edge",), BINS, "1", "edges of its bins"),
        "quantile": store.Variable(("probability",), values, "1", "quantiles of solved windows at median penetration"),
        "quantile_probability": store.Variable(("probability",), probability, "1", "their probabilities"),
    }


def summary(variables: dict[str, store.Variable]) -> str:
    """summary.csv: a row a penetration, after lines of comment that explain the columns."""
    names = [f"combined_{name}" for name in ("mean", "std", "variation", "skewness", "kurtosis")]
    names += ["combined_length_least_squares", "ratio_of_sums", "beta_a", "beta_b", "missing_share"]
    ends = ("", "_low", "_high")
    shown = {name + end + ("_m" if "length" in name else ""): name + end for name in names for end in ends}
    shown = {"percentile": "percentile", **shown, "beta_at_bound": "beta_at_bound"}
    shown |= {LOAD[name] + end: name + end for name in LOAD if name in variables for end in ends}
    return store.table_text(SUMMARY, {title: variables[name] for title, name in shown.items()})


def solve_variables(batches: list[store.Result], shear: Estimate) -> dict[str, store.Variable]:
    """Shear strength [Pa], and the largest residual of all solves."""
    title = "shear strength that gives the mean at the median"
    variables = store.with_interval("shear_strength", (), columns_of(shear), "Pa", title)
    residual = max(float(batch["residual"].max()) for batch in batches)
    return variables | {"largest_residual": store.Variable((), residual, "1", "largest residual of all contact solves")}
