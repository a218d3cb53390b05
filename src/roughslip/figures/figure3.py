"""Figure 3 of the paper, friction against penetration, and its second sheet: law and correlation at all depths."""

from __future__ import annotations

import numpy as np
import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.special import betaln, ndtri

from roughslip.figures.style import INTERVAL, Arrays, head, legend_above, panels, with_interval_names

DRAWN = {
    "figure3": [
        *("source", "percentile", "fit_percentile"),
        *with_interval_names("combined_mean", "combined_std", "mean", "std", "fit"),
    ],
    "figure3_law": [
        *("percentile", "lag", "triangle", "histogram", "histogram_edge", "mean", "std", "family"),
        *("beta_a", "beta_b", "beta_lower", "beta_upper", "beta_at_bound", "p_equal_law", "p_equal_correlation"),
        *with_interval_names("autocorrelation", "white_autocorrelation", "length_least_squares", "white_length"),
        *with_interval_names("beta_misfit", "family_distance", "skewness", "kurtosis"),
    ],
}
"""Variables of the result that the figure draws; they are stored with it."""

SOURCES = {"solved": ("solved contact", "C0", "o"), "expansion": ("expansion", "C1", "s")}
FAMILIES = {"normal": ("C3", ":", "^"), "gamma": ("C4", "--", "s"), "lognormal": ("C1", "-.", "D")}
SOLVED = 0  # row of the sources
PAPER_LENGTH = 250e-6  # m
PAPER_BETA, PAPER_LABEL = (2.1, 5.0), "paper, Beta(2.1, 5)"
PAPER_MOMENTS = {"skewness": 0.560, "kurtosis": -0.171}  # of this Beta
PENETRATION = "penetration [percentile of heights]"


def figure3(result: Arrays) -> Figure:
    """Mean and standard deviation of mu against penetration, from both sources of pressure and from both together."""
    figure, axes = panels(2, 1, 4.6)
    for one, name, title in zip(axes, ("mean", "std"), ("mean", "standard deviation"), strict=True):
        _sources(one, result, name)
        one.set(xlabel=PENETRATION, ylabel=f"{title} of $\\mu$", ylim=(0, None))
    axes[0].plot(result["fit_percentile"], result["fit"], color="0.15", lw=1.2, label="$\\mu_{fit}$")
    axes[0].fill_between(result["fit_percentile"], result["fit_low"], result["fit_high"], color="0.15", alpha=0.2, lw=0)
    legend_above(axes[0])
    head(axes[0], "a", "mean friction coefficient")
    head(axes[1], "b", "standard deviation")
    sns.despine(figure)
    return figure


def _sources(axes: Axes, result: Arrays, name: str) -> None:
    percentile = result["percentile"]
    for row, source in enumerate(map(str, result["source"])):
        label, colour, marker = SOURCES[source]
        axes.plot(percentile, result[name][row], marker, color=colour, ms=4, label=label)
        band = result[f"{name}_low"][row], result[f"{name}_high"][row]
        axes.fill_between(percentile, *band, color=colour, alpha=0.2, linewidth=0)
    axes.vlines(percentile, result[f"combined_{name}_low"], result[f"combined_{name}_high"], color="0.15", lw=1.2)
    axes.plot(percentile, result[f"combined_{name}"], "_", color="0.15", ms=7, label="expansion as control")


def figure3_law(result: Arrays) -> Figure:
    """Autocorrelation and what the windows alone make of it, and the law of mu, at the median and at all depths."""
    figure, grid = panels(3, 2, 4.2)
    _autocorrelation(grid[0, 0], result)
    _lengths(grid[0, 1], result)
    _marginal(grid[0, 2], result)
    _distances(grid[1, 0], result)
    for axes, name, title in ((grid[1, 1], "skewness", "skewness"), (grid[1, 2], "kurtosis", "excess kurtosis")):
        _moment(axes, result, name, title)
    several = len(result["percentile"]) > 1
    equal = {
        name: f", one for all: $p$ = {float(result[f'p_equal_{name}']):.2g}" if several else ""
        for name in ("law", "correlation")
    }
    head(grid[0, 0], "a", "autocorrelation" + equal["correlation"])
    head(grid[0, 1], "b", "exponential length")
    head(grid[0, 2], "c", "marginal at median penetration")
    head(grid[1, 0], "d", "distance to families" + equal["law"])
    head(grid[1, 1], "e", "skewness")
    head(grid[1, 2], "f", "excess kurtosis")
    sns.despine(figure)
    return figure


def _median(result: Arrays) -> int:
    return int(np.flatnonzero(result["percentile"] == 50.0)[0])


def _autocorrelation(axes: Axes, result: Arrays) -> None:
    median, lag = _median(result), 1e6 * result["lag"]
    others = [level for level in range(len(result["percentile"])) if level != median]
    for level in others:
        label = "other penetrations" if level == others[0] else None
        axes.plot(lag, result["autocorrelation"][SOLVED, level], color="0.75", lw=0.7, zorder=1, label=label)
    band = (result[f"autocorrelation{end}"][SOLVED, median] for end in INTERVAL[1:])
    axes.fill_between(lag, *band, color="C0", alpha=0.2, linewidth=0)
    axes.plot(lag, result["autocorrelation"][SOLVED, median], color="C0", label="median penetration")
    band = (result[f"white_autocorrelation{end}"] for end in INTERVAL[1:])
    axes.fill_between(lag, *band, color="C3", alpha=0.15, linewidth=0)
    axes.plot(lag, result["white_autocorrelation"], color="C3", ls=":", lw=1.8, label="white pressure")
    axes.plot(lag, result["triangle"], color="0.4", lw=0.7, label="triangle of the window")
    length = float(result["length_least_squares"][SOLVED, median])
    axes.plot(lag, np.exp(-result["lag"] / length), "k--", lw=1, label=f"exponential, {1e6 * length:.0f} µm")
    axes.plot(lag, np.exp(-result["lag"] / PAPER_LENGTH), color="C2", ls="-.", lw=1, label="paper, 250 µm")
    axes.axhline(0, color="0.6", lw=0.5)
    axes.set(xlabel="distance of windows [µm]", ylabel="autocorrelation", xlim=(0, lag[-1]))
    legend_above(axes)


def _lengths(axes: Axes, result: Arrays) -> None:
    """Lengths of exponentials fitted to all lags up to three windows, and that of windows of white pressure."""
    percentile = result["percentile"]
    value, low, high = (1e6 * result[f"length_least_squares{end}"][SOLVED] for end in INTERVAL)
    axes.vlines(percentile, low, high, color="C0", lw=1.2)
    axes.plot(percentile, value, "o", color="C0", ms=4, label="solved contact")
    white = [1e6 * float(result[f"white_length{end}"]) for end in INTERVAL]
    axes.axhspan(white[1], white[2], color="C3", alpha=0.15, lw=0)
    axes.axhline(white[0], color="C3", ls=":", lw=1.8, label="white pressure")
    axes.axhline(1e6 * PAPER_LENGTH, color="C2", ls="-.", lw=1, label="paper")
    axes.set(xlabel=PENETRATION, ylabel="length [µm]")
    legend_above(axes)


def _marginal(axes: Axes, result: Arrays) -> None:
    """Densities of mu less its mean, over its standard deviation, so that the shapes compare."""
    median = _median(result)
    mean, std = (float(result[name][SOLVED, median]) for name in ("mean", "std"))
    edges = (result["histogram_edge"] - mean) / std
    axes.stairs(result["histogram"] * std, edges, fill=True, color="C0", alpha=0.35, label="solved contact")
    a, b, lower, upper = (float(result[f"beta_{name}"][SOLVED, median]) for name in ("a", "b", "lower", "upper"))
    u = np.linspace(1e-4, 1 - 1e-4, 400)
    axes.plot(
        (lower + (upper - lower) * u - mean) / std, _beta_density(u, a, b) * std / (upper - lower), "k-", lw=1.2,
        label="fitted Beta at bound" if result["beta_at_bound"][SOLVED, median] else f"fitted Beta({a:.3g}, {b:.3g})",
    )  # fmt: skip
    a, b = PAPER_BETA
    paper_mean, paper_std = a / (a + b), np.sqrt(a * b / ((a + b) ** 2 * (a + b + 1)))
    axes.plot((u - paper_mean) / paper_std, _beta_density(u, a, b) * paper_std, "C2-.", label=PAPER_LABEL)
    normal = ndtri(u)
    axes.plot(normal, np.exp(-(normal**2) / 2) / np.sqrt(2 * np.pi), color="C3", lw=1.2, ls=":", label="normal")
    axes.set(xlabel="standardised friction coefficient", ylabel="density", ylim=(0, None))
    axes.set_xlim(min(-3.0, edges[0]), max(3.5, edges[-1]))
    legend_above(axes)


def _distances(axes: Axes, result: Arrays) -> None:
    """2-Wasserstein distance of the windows from the nearest member of each family, in standard deviations."""
    percentile = result["percentile"]
    rows = {"fitted Beta": ("k", "-", "o", "beta_misfit", SOLVED)}
    rows |= {str(name): (*FAMILIES[str(name)], "family_distance", row) for row, name in enumerate(result["family"])}
    for label, (colour, style, marker, name, row) in rows.items():
        axes.fill_between(
            percentile, result[f"{name}_low"][row], result[f"{name}_high"][row], color=colour, alpha=0.1, linewidth=0
        )
        axes.plot(percentile, result[name][row], marker, ls=style, color=colour, ms=3.5, lw=1, label=label)
    axes.set(xlabel=PENETRATION, ylabel="distance over standard deviation", ylim=(0, None))
    legend_above(axes)


def _moment(axes: Axes, result: Arrays, name: str, title: str) -> None:
    """A moment against penetration; linear up to 1, as windows with hardly any contact have moments without bound."""
    percentile = result["percentile"]
    axes.vlines(percentile, result[f"{name}_low"][SOLVED], result[f"{name}_high"][SOLVED], color="C0", lw=1.2)
    axes.plot(percentile, result[name][SOLVED], "o", color="C0", ms=4, label="solved contact")
    axes.axhline(0, color="C3", ls=":", lw=1.2, label="normal")
    axes.axhline(PAPER_MOMENTS[name], color="C2", ls="-.", lw=1, label=PAPER_LABEL)
    if np.max(np.abs(result[f"{name}_high"][SOLVED])) > 2:
        axes.set_yscale("symlog", linthresh=1.0)
    axes.set(xlabel=PENETRATION, ylabel=title)
    legend_above(axes)


def _beta_density(u: np.ndarray, a: float, b: float) -> np.ndarray:
    return np.exp((a - 1) * np.log(u) + (b - 1) * np.log1p(-u) - betaln(a, b))
