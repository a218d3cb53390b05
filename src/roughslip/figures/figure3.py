"""Figure 3, friction against penetration; on a second sheet its distribution and correlation; friction against load."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from scipy import stats

from roughslip.figures.style import (
    Shown,
    draw_curve,
    draw_points,
    heads,
    legend_above,
    panels,
    pressure_unit,
    with_ends,
)

SOURCES = {"solved": ("solved contact", "C0", "o"), "expansion": ("expansion", "C1", "s")}
BY_SOURCE = ("mean", "std")
MEDIAN = 50.0  # penetration
PAPER_LENGTH = 250e-6  # m
PAPER, PAPER_LABEL = stats.beta(2.1, 5.0), "paper, Beta(2.1, 5)"
MOMENTS = {"skewness": "s", "kurtosis": "k"}  # in the words of scipy.stats
PENETRATION = "penetration [percentile of heights]"
PANELS = {"mean": "mean of $\\mu$", "std": "standard deviation of $\\mu$", "variation": "standard deviation over mean"}
OVER_LOAD = {
    "real_area": ("real area over apparent area", "real area of contact"),
    "mean": ("mean of $\\mu$", "mean friction coefficient"),
    "variation": ("standard deviation over mean", "scatter of the pad"),
    "no_contact": ("share of windows", "windows without contact"),
}


def figure3(result: Shown) -> Figure:
    """The paper's panels (a) and (b) against penetration, by source; then their ratio."""
    figure, axes = panels(3, 1, 4.0)
    look = {"color": "0.15", "lw": 1.2, "label": "$\\mu_{fit}$"}
    draw_curve(axes[0], result["fit_percentile"], with_ends(result, "fit"), look)
    for panel, (name, title) in zip(axes, PANELS.items(), strict=True):
        for source, (label, colour, marker) in SOURCES.items() if name in BY_SOURCE else ():
            look = {"color": colour, "marker": marker, "ls": "none", "ms": 4, "label": label}
            draw_curve(panel, result["percentile"], with_ends(result, name, source=source), look)
        both = {"color": "0.15", "marker": "_", "ms": 7, "label": "combined", "lw": 0.7}
        both["ls"] = "none" if name in BY_SOURCE else "-"
        draw_points(panel, result["percentile"], with_ends(result, f"combined_{name}"), both)
        panel.set(xlabel=PENETRATION, ylabel=title, ylim=(0, None))
    legend_above(axes[0])
    heads(axes, "mean", "standard deviation", "coefficient of variation")
    return figure


def figure3_law(result: Shown) -> Figure:
    """Distribution and autocorrelation of mu; what windows alone make of it."""
    figure, grid = panels(3, 2, 4.6)
    _autocorrelation(grid[0, 0], result)
    _lengths(grid[0, 1], result)
    _marginal(grid[0, 2], result)
    _nearest(grid[1, 0], result)
    _moment(grid[1, 1], result, "skewness", "skewness")
    _moment(grid[1, 2], result, "kurtosis", "excess kurtosis")
    heads(
        grid.ravel(),
        *("autocorrelation", "exponential length", "marginal at median penetration"),
        *("where the paper's Beta lies nearest", "skewness", "excess kurtosis"),
    )
    return figure


def _autocorrelation(axes: Axes, result: Shown) -> None:
    lag, curves = 1e6 * result["lag"], result["combined_autocorrelation"]
    others = [level for level in result["percentile"].values if level != MEDIAN]
    for level in others:
        label = "other penetrations" if level == others[0] else None
        axes.plot(lag, curves.sel(level=level), color="0.75", lw=0.7, zorder=1, label=label)
    own = with_ends(result, "combined_autocorrelation", level=MEDIAN)
    draw_curve(axes, lag, own, {"color": "C0", "label": "median penetration"})
    axes.plot(lag, result["triangle"], color="C3", ls=":", lw=1.8, label="triangle of the window")
    length = float(result["combined_length_least_squares"].sel(level=MEDIAN))
    axes.plot(lag, np.exp(-result["lag"] / length), "k--", lw=1, label=f"exponential, {1e6 * length:.0f} µm")
    axes.plot(lag, np.exp(-result["lag"] / PAPER_LENGTH), color="C2", ls="-.", lw=1, label="paper, 250 µm")
    axes.axhline(0, color="0.6", lw=0.5)
    axes.set(xlabel="distance of windows [µm]", ylabel="autocorrelation", xlim=(0, lag[-1]))
    legend_above(axes)


def _lengths(axes: Axes, result: Shown) -> None:
    """Lengths of fitted exponentials, and that of the triangle of the window."""
    lengths = with_ends(result, "combined_length_least_squares", factor=1e6)
    draw_points(axes, result["percentile"], lengths, {"color": "C0", "label": "rough surfaces"})
    own = float(result["triangle_length"][list(result["length_name"].values).index("least_squares")])
    axes.axhline(1e6 * own, color="C3", ls=":", lw=1.8, label="triangle of the window")
    axes.axhline(1e6 * PAPER_LENGTH, color="C2", ls="-.", lw=1, label="paper")
    axes.set(xlabel=PENETRATION, ylabel="length [µm]")
    legend_above(axes)


def _nearest(axes: Axes, result: Shown) -> None:
    """Standardised densities at the median, and where the skewness is near the paper's, the nearest level."""
    level, edges = int(result["beta_nearest"]), result["standard_edge"]
    percentile, distance = (float(result[name][level]) for name in ("percentile", "beta_distance_standardised"))
    label = f"at {percentile:g} %, distance {distance:.3f}"
    axes.stairs(result["standard_histogram"][level], edges, fill=True, color="C0", alpha=0.35, label=label)
    axes.stairs(result["standard_histogram"].sel(level=MEDIAN), edges, color="0.15", lw=1.0, label="at the median")
    axes.plot(*_density(PAPER, PAPER.mean(), PAPER.std()), "C2-.", label=PAPER_LABEL)
    axes.set(xlabel="standardised friction coefficient", ylabel="density", xlim=(-3.0, 4.5), ylim=(0, None))
    legend_above(axes)


def _density(law: Any, mean: float, std: float) -> tuple[np.ndarray, np.ndarray]:
    """Places and density of a law of scipy.stats, less the mean, over the standard deviation."""
    x = law.ppf(np.linspace(1e-4, 1 - 1e-4, 400))
    return (x - mean) / std, std * law.pdf(x)


def _marginal(axes: Axes, result: Shown) -> None:
    """Densities of mu less its mean, over its standard deviation, so that the shapes compare."""
    mean, std = (float(result[name].sel(source="solved", level=MEDIAN)) for name in ("mean", "std"))
    edges, density = result["standard_edge"], result["standard_histogram"].sel(level=MEDIAN)
    axes.stairs(density, edges, fill=True, color="C0", alpha=0.35, label="solved contact")
    a, b, lower, upper = (float(result[f"beta_{name}"].sel(level=MEDIAN)) for name in ("a", "b", "lower", "upper"))
    label = "fitted Beta at bound" if result["beta_at_bound"].sel(level=MEDIAN) else f"fitted Beta({a:.3g}, {b:.3g})"
    axes.plot(*_density(stats.beta(a, b, lower, upper - lower), mean, std), "k-", lw=1.2, label=label)
    axes.plot(*_density(PAPER, PAPER.mean(), PAPER.std()), "C2-.", label=PAPER_LABEL)
    axes.plot(*_density(stats.norm, 0.0, 1.0), color="C3", lw=1.2, ls=":", label="normal")
    axes.set(xlabel="standardised friction coefficient", ylabel="density", xlim=(-3.0, 4.5), ylim=(0, None))
    legend_above(axes)


def _moment(axes: Axes, result: Shown, name: str, title: str) -> None:
    """A moment against penetration; linear up to 1, as windows with hardly any contact have moments without bound."""
    value, low, high = with_ends(result, f"combined_{name}")
    draw_points(axes, result["percentile"], (value, low, high), {"color": "C0", "label": "rough surfaces"})
    axes.axhline(0, color="C3", ls=":", lw=1.2, label="normal")
    axes.axhline(float(PAPER.stats(MOMENTS[name])), color="C2", ls="-.", lw=1, label=PAPER_LABEL)
    if np.max(np.abs(high)) > 2:
        axes.set_yscale("symlog", linthresh=1.0)
    axes.set(xlabel=PENETRATION, ylabel=title)
    legend_above(axes)


def friction_against_load(result: Shown) -> Figure:
    """Four panels over the nominal pressure; the scene's load is a line in each."""
    figure, axes = panels(4, 1, 3.4)
    own = float(result["nominal_pressure"])
    factor, unit = pressure_unit(own)
    pressures = factor * result["over_loads_nominal_pressure"]
    for panel, (name, (label, _)) in zip(axes, OVER_LOAD.items(), strict=True):
        ends = with_ends(result, f"over_loads_{name}")
        draw_curve(panel, pressures, ends, {"color": "C0", "marker": "o", "ms": 4})
        panel.axvline(factor * own, color="C3", ls="--", lw=1.2, label="load of the scene")
        panel.set(xscale="log", xlabel=f"nominal pressure [{unit}]", ylabel=label)
        panel.set_xticks(pressures, [f"{pressure:.2g}" for pressure in pressures.values])  # those of the points alone
        panel.xaxis.set_minor_locator(NullLocator())
        if name in ("real_area", "variation"):
            panel.set_yscale("log")
        else:
            panel.set_ylim(0, 1.0 if name == "no_contact" else None)
    axes[0].legend(loc="lower right", fontsize="small", frameon=True)
    heads(axes, *(title for _, title in OVER_LOAD.values()))
    return figure
