"""The friction table as stored: statistics with units and titles, mu_fit(d), summary.csv."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from roughslip import store
from roughslip.friction.correlation import LENGTHS, CorrelationFit, one_field, triangular, window_lengths
from roughslip.friction.marginal import SET_WINDOWS, BetaFit
from roughslip.friction.table import BY_SOURCE, FrictionTable, curve_over_penetration, trend
from roughslip.friction.windows import WindowStatistics
from roughslip.probability import Estimate
from roughslip.probability.estimate import columns_of

MOST_MISSING = 0.01  # of the windows, above which a warning says that some have no friction coefficient
FIT_POINTS = 91  # of mu_fit(d)
SOURCES = ("solved", "expansion")
BINS = np.linspace(-4.0, 6.0, 41)  # of standardised mu
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


def _titles(kind: type, prefix: str = "") -> dict[str, str]:
    return {prefix + field.name: field.metadata["title"] for field in dataclasses.fields(kind)}


OF_SETS = "shape {} of Beta after scaling sets of {} windows by their extremes: median, 5 and 95 %"
TITLES = {
    **_titles(WindowStatistics),
    **_titles(CorrelationFit),
    **_titles(CorrelationFit, "length_"),
    "ratio_of_sums": "shear strength times contact area over normal force, all windows together",
    "autocorrelation": "autocorrelation of the friction coefficient along the strip",
    **{f"set_beta_{one}_{size}": OF_SETS.format(one, size) for one in "ab" for size in SET_WINDOWS},
    "length_one_field": "length of the exponential of one strip about its own mean: median, 2.5 and 97.5 % of strips",
    "exponential_share": "share of the strips to which this exponential is nearer than the triangle of the window",
    "beta_distance_standardised": "Kolmogorov distance to Beta(2.1, 5), both standardised",
}
CONTROLLED = ", solved windows with the expansion as control"


def stored(name: str, dimensions: tuple[str, ...], estimates: list[Estimate]) -> dict[str, store.Variable]:
    """Value and ends of the interval of estimates, which stack along source, level, both or none."""
    plain = name.removeprefix("combined_")
    title = TITLES.get(plain, name.replace("_", " ")) + (CONTROLLED if plain != name else "")
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
    title = "shear strength that gives the mean at the median"
    variables = {
        "source": store.Variable(("source",), np.array(SOURCES), "1", "where the pressure comes from"),
        "percentile": store.Variable(("level",), layout.percentiles, "percent", "share of heights above the plane"),
        "lag": store.Variable(("lag",), layout.lags, "m", "distance of two windows"),
        **store.with_interval("shear_strength", (), columns_of(table.shear), "Pa", title),
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
    variables |= beta_variables(table.beta, ("level",))
    for name, estimate in one_field(*table.mu[layout.median], layout.lags, layout.window_m).items():
        variables |= stored(name, (), [estimate])
    distance, title = variables["beta_distance_standardised"].values, "number of the level nearest to Beta(2.1, 5)"
    variables["beta_nearest"] = store.Variable((), int(np.argmin(distance)), "1", title)
    lengths, title = window_lengths(layout.lags, layout.window_m), "autocorrelation that the window alone would give"
    shorter = [lengths[name] for name in LENGTHS]
    variables["triangle"] = store.Variable(("lag",), triangular(layout.lags, layout.window_m), "1", title)
    variables["length_name"] = store.Variable(
        ("length",), np.array(LENGTHS), "1", "how a length follows from the curve"
    )
    variables["triangle_length"] = store.Variable(("length",), shorter, "m", f"length of {title}")
    levels = [values[valid] for values, valid in table.mu]
    standard = [(values - values.mean()) / values.std() for values in levels]
    density = np.array([np.histogram(values, BINS)[0] / len(values) / np.diff(BINS) for values in standard])
    title = "density of solved windows, less their mean, over their standard deviation"
    variables["standard_histogram"] = store.Variable(("level", "standard_bin"), density, "1", title)
    variables["standard_edge"] = store.Variable(("standard_edge",), BINS, "1", "edges of its bins")
    return variables | fitted_curve(layout.percentiles, combined["mean"])


def fitted_curve(points: np.ndarray, means: list[Estimate]) -> dict[str, store.Variable]:
    """mu_fit(d) between the first and the last level, with its band; of one level the mean alone."""
    columns = columns_of(means)
    if len(points) > 1:
        levels, points = points, np.linspace(points[0], points[-1], FIT_POINTS)
        columns = columns_of(curve_over_penetration(levels, means, points))
    variable = store.Variable(("penetration",), points, "percent", "penetration")
    title = "mu_fit, the mean friction coefficient as a function of penetration"
    return {"fit_percentile": variable} | store.with_interval("fit", ("penetration",), columns, "1", title)


def beta_variables(fits: list[BetaFit], dimensions: tuple[str, ...]) -> dict[str, store.Variable]:
    """Four-parameter Beta distributions of the windows at each level, or of a single one without dimensions."""
    shape, variables = (-1,) if dimensions else (), {}
    for field in dataclasses.fields(BetaFit):
        values = np.array([float(getattr(fit, field.name)) for fit in fits]).reshape(shape)
        title = f"{field.metadata['title']}; of the four-parameter Beta of the windows"
        variables[f"beta_{field.name}"] = store.Variable(dimensions, values, "1", title)
    return variables


def missing_warnings(shares: list[Estimate], percentiles: np.ndarray) -> Iterator[str]:
    """One where more than MOST_MISSING of the windows of a penetration have no friction coefficient."""
    shown = zip(percentiles, shares, strict=True)
    missing = {f"{level:g} %": float(share.value) for level, share in shown if share.value > MOST_MISSING}
    if missing:
        yield (
            f"at penetrations of {', '.join(missing)} up to {max(missing.values()):.2g} of the windows have no "
            "friction coefficient and are left out: take larger windows"
        )


def summary(variables: dict[str, store.Variable]) -> str:
    """summary.csv: a row a penetration, after lines of comment that explain the columns."""
    names = [f"combined_{name}" for name in ("mean", "std", "variation", "skewness", "kurtosis")]
    names += ["combined_length_least_squares", "ratio_of_sums", "missing_share"]
    ends = ("", "_low", "_high")
    shown = {name + end + ("_m" if "length" in name else ""): name + end for name in names for end in ends}
    shown = {"percentile": "percentile", **shown} | {name: name for name in ("beta_a", "beta_b", "beta_at_bound")}
    shown |= {LOAD[name] + end: name + end for name in LOAD if name in variables for end in ends}
    return store.table_text(SUMMARY, {title: variables[name] for title, name in shown.items()})
