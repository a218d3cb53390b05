"""The friction table as stored: statistics with units and titles, tests of what the paper says, summary.csv."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from roughslip import store
from roughslip.friction.correlation import (
    LOG_LINE_WINDOWS,
    LONGEST_WINDOWS,
    correlation_fit,
    log_line,
    triangular,
    white_autocorrelation,
    window_lengths,
)
from roughslip.friction.level import Windows
from roughslip.friction.marginal import FAMILIES, SHAPES, fit_candidates, standardised_distribution
from roughslip.friction.over_penetration import LENGTHS, trend_estimates, trend_of
from roughslip.friction.penetration import p_value, p_value_of_equality, penetration_curve
from roughslip.friction.statistics import PERCENTS, ratio_of_sums
from roughslip.friction.table import BY_SOURCE, FrictionTable, WindowLayout
from roughslip.probability import Estimate
from roughslip.probability.estimate import columns_of

WHITE_REPLICATES = 200
MOST_MISSING = 0.01  # of the windows, above which a warning says that some have no friction coefficient
FIT_POINTS = 91  # of mu_fit(d)
STANDARD = np.linspace(-2.5, 3.5, 25)  # standardised mu at which the distributions of the levels are compared
SOURCES = ("solved", "expansion")
HISTOGRAM_BINS = 40
BINS = np.linspace(-4.0, 6.0, 41)  # of standardised mu
QUANTILES = 1000
LOAD = {  # further columns of summary.csv, of what stage friction stores of load
    "force_per_window": "force_per_window_n",
    "nominal_pressure": "nominal_pressure_pa",
    "load_windows": "load_windows",
    "load_std": "load_std",
}
GAINS = ("mean", "std")  # for which the ratio of solves at equal standard error is given
SUMMARY = (
    'Friction of sliding windows, a row a penetration. Python: pandas.read_csv("summary.csv", comment="#")',
    "Columns with _low and _high are the ends of the 95 % interval of the column without. Columns combined_... take",
    "solved windows with the expansion as control variate and, where the scene asks so, two meshes: use these. The",
    "others take solved windows alone. Where beta_at_bound is 1, the shapes of the Beta are not determined.",
)
TITLES = {
    "mean": "mean friction coefficient",
    "std": "standard deviation of the friction coefficient",
    "variation": "coefficient of variation",
    "skewness": "skewness; of 20 strips or more its interval holds the truth in 94 to 98 % of cases",
    "kurtosis": "excess kurtosis; of 20 strips or more its interval holds the truth in 90 to 96 %, else it is too low",
    "quantiles": "quantiles of the friction coefficient",
    "effective_windows": "effective number of independent windows",
    "missing_share": "share of windows with too little contact for a friction coefficient",
    "ratio_of_sums": "shear strength times contact area over normal force, all windows together",
    "area_correction": "contact area without the error of the mesh at edges over the area of the nodes in contact",
    "autocorrelation": "autocorrelation of the friction coefficient along the strip",
    "length_least_squares": "exponential length by least squares over lags to three windows",
    "length_half_window": "exponential length by least squares over lags to half a window",
    "length_one_over_e": "lag at which the autocorrelation falls to 1/e",
    "length_integral": "integral of the autocorrelation over lags to three windows",
    "length_log_line_50": "length of a straight line through the logarithm to lags of half a window",
    "length_log_line_90": "length of a straight line through the logarithm to lags of 0.9 of a window",
    "log_line_r2": "share of the variance of the logarithm that the line to 0.9 of a window explains",
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
    "set_beta_a": "first shape after scaling sets of 100 windows by their extremes: median, 5 and 95 %",
    "set_beta_b": "second shape after scaling sets of 100 windows by their extremes: median, 5 and 95 %",
    "beta_distance_standardised": "Kolmogorov distance to Beta(2.1, 5), both standardised",
    "beta_distance_scaled": "Kolmogorov distance to Beta(2.1, 5) after scaling by the sample extremes",
    "mesh_change_of_mean": "relative change of the combined mean by the extrapolation to cells of no size",
    "mesh_change_of_std": "relative change of the combined standard deviation by that extrapolation",
    "combined_mean_gain": "solved strips alone that give the mean as well, for each that was solved",
    "combined_std_gain": "solved strips alone that give the standard deviation as well, for each that was solved",
}


CONTROLLED = ", solved windows with the expansion as control"
TESTS = {
    "least_p_value": "least that these p-values can be, with so many replicates",
    "p_equal_distribution": "p-value of the standardised distribution being the same at every penetration",
    "p_equal_correlation": "p-value of the autocorrelation being the same at every penetration",
    "p_exponential_nearer": "two-sided p-value of exponential and triangle being as near, at median penetration",
    "p_no_skewness": "p-value of no skewness at median penetration",
    "p_no_kurtosis": "p-value of no excess kurtosis at median penetration",
    "p_no_change_of_mean": "p-value of the combined mean being the same at the last penetration as at the first",
    "p_no_change_of_std": "p-value of the combined standard deviation being the same at the last as at the first",
    "p_no_change_of_variation": "p-value of the combined coefficient of variation being the same there",
}


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
    extra = {"quantiles": ("quantile",), "autocorrelation": ("lag",)}
    variables = {
        "source": store.Variable(("source",), np.array(SOURCES), "1", "where the pressure comes from"),
        "percentile": store.Variable(("level",), layout.percentiles, "percent", "share of heights above the plane"),
        "quantile": store.Variable(("quantile",), PERCENTS, "percent", "probability of the quantiles"),
    }
    for name, estimates in table.solved.items():
        sources = ("source",) if name in BY_SOURCE else ()
        variables |= stored(name, (*sources, "level", *extra.get(name, ())), estimates)
    for name, estimates in combined.items():
        variables |= stored(f"combined_{name}", ("level", *extra.get(name, ())), estimates)
    if len(layout.percentiles) > 1:
        for name, estimate in trend_estimates(combined, layout.percentiles).items():
            variables |= stored(name, (), [estimate])
    shapes = np.stack([variables["beta_a"].values, variables["beta_b"].values])
    at_bound = np.any((shapes < 1.001 * SHAPES[0]) | (shapes > 0.999 * SHAPES[1]), axis=0)
    title = f"whether a shape of the Beta lies at the end of its range, {SHAPES[0]:g} to {SHAPES[1]:g}"
    variables["beta_at_bound"] = store.Variable(("level",), at_bound.astype(np.int8), "1", title)
    variables["lag"] = store.Variable(("lag",), layout.lags, "m", "distance of two windows")
    variables["triangle"] = store.Variable(
        ("lag",), triangular(layout.lags, layout.window_m), "1", "autocorrelation that the window alone would give"
    )
    return variables


def missing_warnings(shares: list[Estimate], percentiles: np.ndarray) -> Iterator[str]:
    """One where more than MOST_MISSING of the windows of a penetration have no friction coefficient."""
    missing = {f"{level:g} %": float(share.value) for level, share in zip(percentiles, shares, strict=True)}
    worst = max(missing, key=lambda level: missing[level])
    if missing[worst] > MOST_MISSING:
        where = ", ".join(level for level, share in missing.items() if share > MOST_MISSING)
        yield (
            f"at penetrations of {where} up to {missing[worst]:.2g} of the windows have no friction coefficient and "
            "are left out: take larger windows, or see friction.least_contact_fraction"
        )


def error_variables(table: FrictionTable) -> dict[str, store.Variable]:
    """What the second mesh changed, and what the expansion is worth."""
    variables: dict[str, store.Variable] = {}
    for name in GAINS:
        variables |= stored(f"mesh_change_of_{name}", ("level",), [level.mesh_change(name) for level in table.levels])
        gains, gain = np.array([1.0 / level.variance_share[name] for level in table.levels]), f"combined_{name}_gain"
        variables[gain] = store.Variable(("level",), gains, "1", TITLES[gain])
    return variables


def distribution(mu: np.ndarray, valid: np.ndarray) -> dict[str, store.Variable]:
    """Density of the windows of one penetration, and their quantiles at the probabilities 0, 1/1000, ..., 1."""
    counts, edges = np.histogram(mu[valid], HISTOGRAM_BINS)
    density = counts / counts.sum() / np.diff(edges)
    probability = np.arange(QUANTILES + 1) / QUANTILES
    values = np.quantile(mu[valid], probability)
    return {
        "histogram": store.Variable(("bin",), density, "1", "density of solved windows at median penetration"),
        "histogram_edge": store.Variable(("edge",), edges, "1", "edges of its bins"),
        "quantile": store.Variable(("probability",), values, "1", "quantiles of solved windows at median penetration"),
        "quantile_probability": store.Variable(("probability",), probability, "1", "their probabilities"),
    }


def histograms(mu: Windows) -> dict[str, store.Variable]:
    """Densities of the standardised windows of every penetration."""
    standard = [(values[valid] - values[valid].mean()) / values[valid].std() for values, valid in zip(*mu, strict=True)]
    density = [np.histogram(values, BINS)[0] / len(values) / np.diff(BINS) for values in standard]
    title = "density of solved windows, less their mean, over their standard deviation"
    return {
        "standard_histogram": store.Variable(("level", "standard_bin"), np.array(density), "1", title),
        "standard_edge": store.Variable(("standard_edge",), BINS, "1", "edges of its bins"),
    }


def summary(variables: dict[str, store.Variable], percentiles: np.ndarray) -> str:
    """summary.csv: a row a penetration, after lines of comment that explain the columns."""
    columns = [f"combined_{name}" for name in ("mean", "std", "variation", "skewness", "kurtosis")]
    columns += ["combined_length_least_squares", "ratio_of_sums", "beta_a", "beta_b", "missing_share"]
    of_load = [name for name in LOAD if name in variables]
    names, loads = ([name + end for name in of for end in ("", "_low", "_high")] for of in (columns, of_load))
    titles = [f"{name}_m" if "length" in name else name for name in names]
    load_titles = [LOAD[name] + end for name in of_load for end in ("", "_low", "_high")]
    header = ["percentile", *titles, "beta_at_bound", *load_titles]
    shown = zip(header, ["percentile", *names, "beta_at_bound", *loads], strict=True)
    explained = [(title, variables[name]) for title, name in shown if not name.endswith(("_low", "_high"))]
    comment = [*SUMMARY, *(f"{title} [{variable.units}]: {variable.long_name}" for title, variable in explained)]
    at_bound = np.asarray(variables["beta_at_bound"].values)
    rows = []
    for level, percentile in enumerate(percentiles):
        cells, of_load = ([f"{variables[name].values[level]:.6g}" for name in of] for of in (names, loads))
        rows.append(",".join([f"{percentile:g}", *cells, str(int(at_bound[level])), *of_load]))
    return "\n".join([*(f"# {line}" for line in comment), ",".join(header), *rows]) + "\n"


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
        estimates = [getattr(level[family], name) for family in FAMILIES for level in levels]
        columns = [column.reshape(len(FAMILIES), -1) for column in columns_of(estimates)]
        variables |= store.with_interval(f"family_{name}", ("family", "level"), columns, "1", title)
    return variables


def p_value_variables(table: FrictionTable) -> dict[str, store.Variable]:
    """p-values of what the paper says of the friction coefficient; NaN where there is one penetration only."""
    percentiles, median, combined = table.layout.percentiles, table.layout.median, table.combined
    p_values: dict[str, float] = dict.fromkeys(TESTS, np.nan)
    if len(percentiles) > 1:
        windows = zip(*table.mu, strict=True)
        shares = [standardised_distribution(values, valid, table.weights, STANDARD) for values, valid in windows]
        p_values["p_equal_distribution"] = p_value_of_equality(np.stack(shares))
        curves = np.stack([estimate.rows for estimate in combined["autocorrelation"]])
        p_values["p_equal_correlation"] = p_value_of_equality(curves)
        for name in ("mean", "std", "variation"):
            change = trend_of(percentiles, combined[name]).change
            p_values[f"p_no_change_of_{name}"] = p_value(change)
    p_values["p_exponential_nearer"] = p_value(combined["misfit_difference"][median])
    p_values["p_no_skewness"] = p_value(combined["skewness"][median])
    p_values["p_no_kurtosis"] = p_value(combined["kurtosis"][median])
    p_values["least_p_value"] = 1.0 / (1 + len(combined["skewness"][median].replicates))
    return {name: store.Variable((), value, "1", TESTS[name]) for name, value in p_values.items()}


def fit_variables(means: list[Estimate], percentiles: np.ndarray) -> dict[str, store.Variable]:
    """mu_fit(d) between the first and the last level, its slope, and their bands; of one level there is no slope."""
    points = percentiles
    columns = [columns_of(means[:1]), (np.full(1, np.nan),) * 3]
    if len(percentiles) > 1:
        points, curve = np.linspace(percentiles[0], percentiles[-1], FIT_POINTS), penetration_curve(percentiles, means)
        columns = [columns_of(line) for line in (curve.at(points), curve.slope(points))]
    names = {
        "fit": ("1", "mu_fit, the mean friction coefficient as a function of penetration"),
        "fit_slope": ("percent-1", "derivative of mu_fit by the percentile of penetration"),
    }
    variables = {"fit_percentile": store.Variable(("penetration",), points, "percent", "penetration")}
    for (name, (unit, title)), parts in zip(names.items(), columns, strict=True):
        variables |= store.with_interval(name, ("penetration",), parts, unit, title)
    return variables


def white_variables(layout: WindowLayout, strips: int, rng: np.random.Generator) -> dict[str, store.Variable]:
    """What so many strips of white pressure would show in this measurement: autocorrelation, length."""
    length, spacing = layout.cells
    columns = length + (layout.count - 1) * spacing
    curve = white_autocorrelation(strips, columns, length, spacing, layout.count, WHITE_REPLICATES, rng)
    fit = correlation_fit(layout.lags, curve, layout.window_m).least_squares
    title = "autocorrelation of windows of white pressure, and the range of 95 % of such measurements"
    variables = store.with_interval("white_autocorrelation", ("lag",), columns_of(curve), "1", title)
    title = f"exponential length of windows of white pressure, lags to {LONGEST_WINDOWS:g} windows; range of 95 %"
    return variables | store.with_interval("white_length", (), columns_of(fit), "m", title)


def line_variables(curve: Estimate, lags: np.ndarray, window: float) -> dict[str, store.Variable]:
    """What the triangle of the window alone gives by each length, and a straight line against its largest lag.

    curve : autocorrelation at median penetration
    """
    lengths, triangle = window_lengths(lags, window), triangular(lags, window)
    largest = lags[(lags > 0.0) & (lags < window * (1.0 - 1e-9))]
    lines = [Estimate.from_rows(log_line(lags, curve.rows, lag)[0]) for lag in largest]
    own = [float(log_line(lags, triangle[None], lag)[0][0]) for lag in largest]
    straight = float(log_line(lags, triangle[None], LOG_LINE_WINDOWS[-1] * window)[1][0])
    names, title = np.array(LENGTHS), "length that the triangle of the window alone gives"
    variables = {
        "length_name": store.Variable(("length",), names, "1", "how a length follows from the autocorrelation"),
        "triangle_length": store.Variable(("length",), [getattr(lengths, name) for name in LENGTHS], "m", title),
        "triangle_log_line_r2": store.Variable((), straight, "1", "R2 of the straight line through its logarithm"),
        "largest_lag": store.Variable(("largest_lag",), largest, "m", "largest lag of a straight line"),
        "triangle_log_line": store.Variable(("largest_lag",), own, "m", "length by it of the triangle of the window"),
    }
    title = "length by it at median penetration"
    return variables | store.with_interval("log_line", ("largest_lag",), columns_of(lines), "m", title)


def law_variables(table: FrictionTable, rng: np.random.Generator) -> dict[str, store.Variable]:
    """What the paper says of friction, and mu_fit(d). rng : draws white pressure"""
    layout = table.layout
    return (
        candidate_variables(table.mu, table.weights)
        | p_value_variables(table)
        | fit_variables(table.combined["mean"], layout.percentiles)
        | white_variables(layout, table.mu[0].shape[1], rng)
        | line_variables(table.combined["autocorrelation"][layout.median], layout.lags, layout.window_m)
    )


def windows_variables(table: FrictionTable) -> dict[str, store.Variable]:
    """Densities and quantiles of the solved windows."""
    median = table.layout.median
    return distribution(table.mu[0][median], table.mu[1][median]) | histograms(table.mu)


def solve_variables(batches: list[store.Result], shear: Estimate, weights: np.ndarray) -> dict[str, store.Variable]:
    """Shear strength [Pa], what the mesh does to the contact area, and the largest residual of all solves."""
    title = "shear strength that gives the mean at the median"
    variables = store.with_interval("shear_strength", (), columns_of(shear), "Pa", title)
    corrected, of_nodes = (store.join(batches, f"area_{name}").T for name in ("corrected", "of_nodes"))
    pairs = zip(corrected, of_nodes, strict=True)
    ratios = [ratio_of_sums(area[:, None], other[:, None], 1.0, weights) for area, other in pairs]
    variables |= stored("area_correction", ("level",), ratios)
    residual = max(float(batch["residual"].max()) for batch in batches)
    return variables | {"largest_residual": store.Variable((), residual, "1", "largest residual of all contact solves")}
