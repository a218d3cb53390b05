"""The figure of a scan: its statistics, and those of surfaces sampled from the fitted models."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

import numpy as np
import seaborn as sns
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from scipy.ndimage import center_of_mass, label

from roughslip.figures.style import (
    Shown,
    draw_curve,
    draw_map,
    heads,
    legend_above,
    panels,
    with_ends,
)

# Numbers in the last panel: label, factor to the unit shown, unit.
NUMBERS = {
    "rms_height": ("$S_q$", 1e6, " µm"),
    "skewness": ("skewness", 1.0, ""),
    "kurtosis": ("kurtosis", 1.0, ""),
    "length_along": ("length along lay", 1e6, " µm"),
    "length_across": ("length across", 1e6, " µm"),
    "lay": ("lay", 180 / np.pi, "°"),
}


SCAN, TWIN = "0.15", "C1"
WIDEST = 150  # letters in a line across the figure
POSITIVE = ("rms_height", "kurtosis", "length_along", "length_across")
WIDE = 10.0  # values in an interval that excludes nothing
OUTSIDE = 3.0  # half widths of an interval at which a twin is drawn that lies further away


def figure_scan(result: Shown) -> Figure:
    """Maps, density of heights, autocorrelation, spectrum and numbers of a scan and of its twins, if there are any.

    Colours cover 2.5 Sq of the points that are no outliers. A circle surrounds each outlier or spot of them.
    """
    figure, grid = panels(3, 2, 4.3)
    why, outlier = str(result["no_twins"].item()), result["map_outlier"].values.astype(bool)
    scale = 2.5e6 * float(np.std(result["map"].values[~outlier]))
    for axes, name in zip(grid[0], ("map",) if why else ("map", "twin_map"), strict=False):
        heights = 1e6 * (result[name] - (result[name].where(~outlier) if name == "map" else result[name]).mean())
        image = draw_map(axes, result["map_x"], result["map_y"], heights, "viridis", (-scale, scale))
    figure.colorbar(image, ax=grid[0, 0 if why else 1], label="height [µm]", extend="both")
    if outlier.any():
        spots, number = label(outlier, np.ones((3, 3)))
        i, j = np.round(center_of_mass(outlier, spots, range(1, number + 1))).astype(int).T
        places = 1e6 * result["map_x"][i], 1e6 * result["map_y"][j]
        grid[0, 0].plot(*places, "o", mfc="none", mec="C3", mew=0.8, ms=6, label="outliers")
    if why:
        grid[0, 1].set_axis_off()
        why = fill(f"{why[0].upper()}{why[1:]}", 52)
        grid[0, 1].text(0, 1, why, transform=grid[0, 1].transAxes, va="top", fontsize="x-small")
    _density(grid[0, 2], result)
    _correlation(grid[1, 0], result)
    _spectrum(grid[1, 1], result)
    _numbers(grid[1, 2], result)
    numbers = "numbers" if result["sufficient"] else "numbers (scan small for intervals)"
    count = int(result["outliers"])
    scan = f"scan, {count} outlier{'s' if count > 1 else ''} circled" if count else "scan"
    twin = "no sampled twin" if why else "a sampled twin"
    titles = (scan, twin, "density of heights", "autocorrelation", "power spectrum", numbers)
    heads(grid.ravel(), *titles)
    figure.suptitle(fill(f"Read: {result['read'].item()}", WIDEST, max_lines=3, placeholder=" ..."), fontsize="small")
    for axes in grid.ravel()[2:]:
        sns.despine(ax=axes)
    return figure


def _band(
    axes: Axes,
    x: xr.DataArray,
    scan: Sequence[xr.DataArray],
    twins: xr.DataArray | None,
    line: str = "-",
    labels: tuple[str, str] = ("scan (95 %)", "twins (range)"),
) -> None:
    """A curve of the scan with its interval, and the mean, the least and the largest of any twins (twin, ...)."""
    draw_curve(axes, x, scan, {"color": SCAN, "lw": 1.4, "ls": line, "label": labels[0]})
    if twins is None:
        return
    ends = twins.mean("twin"), twins.min("twin"), twins.max("twin")
    draw_curve(axes, x, ends, {"color": TWIN, "lw": 1.2, "ls": line, "label": labels[1]}, alpha=0.3)


def _twins(result: Shown, name: str, factor: float = 1.0) -> xr.DataArray | None:
    """What twins show, in units of 1 / factor, or None without twins."""
    return None if result["no_twins"].item() else factor * result[f"twin_{name}"]


def _density(axes: Axes, result: Shown) -> None:
    edges = 1e6 * result["density_edge"]
    scan = with_ends(result, "density", factor=1e-6)
    _band(axes, 0.5 * (edges[1:] + edges[:-1]), scan, _twins(result, "density", 1e-6))
    reach = 6e6 * float(result["rms_height"])
    axes.set(xlabel="height [µm]", ylabel="density [1/µm]", ylim=(0, None))
    axes.set_xlim(max(float(edges[0]), -reach), min(float(edges[-1]), reach))
    legend_above(axes)


def _correlation(axes: Axes, result: Shown) -> None:
    """Cuts of the table of lags through its middle."""
    i, j = (len(result[f"lag_{axis}"]) // 2 for axis in "xy")
    for axis, cut, line in (("x", (slice(i, None), j), "-"), ("y", (i, slice(j, None)), ":")):
        lag = 1e6 * result[f"lag_{axis}"]
        twins = _twins(result, f"correlation_{axis}")
        twins = None if twins is None else twins[:, len(lag) // 2 :]
        labels = f"scan, along {axis}", f"twins, along {axis}"
        _band(axes, lag[len(lag) // 2 :], [end[cut] for end in with_ends(result, "correlation")], twins, line, labels)
    for level in (0.0, np.exp(-1)):
        axes.axhline(level, color="0.6", lw=0.6)
    axes.set(xlabel="lag [µm]", ylabel="autocorrelation", xlim=(0, None))
    model = f"model: {result['model'].item()}".replace(", ", "\n")
    axes.annotate(model, (0.97, 0.8), xycoords="axes fraction", ha="right", va="top", fontsize="small")
    legend_above(axes)


def _spectrum(axes: Axes, result: Shown) -> None:
    axes.set(xscale="log", yscale="log", xlabel="wavenumber [rad/µm]", ylabel="power spectrum [µm$^4$]")
    _band(axes, 1e-6 * result["wavenumber"], with_ends(result, "power", factor=1e24), _twins(result, "power", 1e24))
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.legend(loc="lower left", fontsize="small")


def _numbers(axes: Axes, result: Shown) -> None:
    """A row a number: the scan's interval goes from -1 to 1, and each twin lies where it does in units of it.

    At the right, how many twins lie inside.
    """
    for row, name in enumerate(NUMBERS):
        value, low, high = map(float, with_ends(result, name))
        twins = _twins(result, name)
        away = (np.empty(0) if twins is None else twins.values) - value
        if name == "lay":  # an angle between undirected lines
            away = (away + np.pi / 2) % np.pi - np.pi / 2
        away = np.clip(np.where(away > 0, away / (high - value), away / (value - low)), -OUTSIDE, OUTSIDE)
        axes.plot([-1, 1], [-row, -row], "|-", color=SCAN, lw=1.4, label="scan" if row == 0 else None)
        if twins is not None:
            name_once = "twins" if row == 0 else None
            axes.plot(away, np.full(len(away), -row), "o", color=TWIN, ms=4, alpha=0.5, label=name_once)
        inside = f"{np.sum(np.abs(away) <= 1)} of {len(away)}"
        if _contains_everything(name, value, low, high, float(result["skewness"])):
            inside = "cannot tell"
        if twins is None:
            inside = ""
        axes.annotate(inside, (OUTSIDE + 0.2, -row), ha="right", va="center", fontsize="x-small")
        _, factor, unit = NUMBERS[name]
        text = f"{factor * value:.3g}{unit} ({factor * low:.3g} to {factor * high:.3g})"
        axes.annotate(text, (0, -row), xytext=(0, 6), textcoords="offset points", ha="center", fontsize="x-small")
    axes.set_yticks(-np.arange(len(NUMBERS)), [label for label, _, _ in NUMBERS.values()])
    axes.set(xlim=(-OUTSIDE - 0.2, OUTSIDE + 0.2), ylim=(0.4 - len(NUMBERS), 0.8))
    axes.set_xlabel("distance [half the 95 % interval]")
    legend_above(axes)


def _contains_everything(name: str, value: float, low: float, high: float, skewness: float) -> bool:
    """Whether an interval excludes nothing: a kurtosis from its bound 1 + Ssk^2 on, a lay of half a turn.

    So does one of a positive quantity that is WIDE times as long as its value.
    """
    if name in POSITIVE and high - low > WIDE * value:
        return True
    if name == "kurtosis":
        return low <= (1.0 + skewness**2) * (1.0 + 1e-9)
    return name == "lay" and high - low >= np.pi
