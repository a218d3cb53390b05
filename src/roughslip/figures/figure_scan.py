"""The figure of a scan: its statistics, and those of surfaces sampled from the fitted models."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.ticker import LogLocator, NullFormatter

from roughslip.figures.style import INTERVAL, Arrays, head, legend_above, panels, with_interval_names

# Numbers in the last panel: label, factor to the unit shown, unit.
NUMBERS = {
    "rms_height": ("$S_q$", 1e6, " µm"),
    "skewness": ("skewness", 1.0, ""),
    "kurtosis": ("kurtosis", 1.0, ""),
    "length_along": ("length along lay", 1e6, " µm"),
    "length_across": ("length across", 1e6, " µm"),
    "lay": ("lay", 180 / np.pi, "°"),
    "fractal_dimension": ("fractal dimension", 1.0, ""),
}

DRAWN = [
    *("map", "map_x", "map_y", "twin_map", "density_edge", "lag_x", "lag_y", "wavenumber", "sufficient"),
    *("twin_density", "twin_correlation_x", "twin_correlation_y", "twin_power"),
    *with_interval_names("density", "correlation", "power", *NUMBERS),
    *(f"twin_{name}" for name in NUMBERS),
]
"""Variables of the result that the figure draws; they are stored with it."""

SCAN, TWIN = "0.15", "C1"
OUTSIDE = 3.0  # half widths of an interval at which a twin is drawn that lies further away


def figure_scan(result: Arrays) -> Figure:
    """Maps, density of heights, autocorrelation, spectrum and numbers of a scan and of its twins."""
    figure, grid = panels(3, 2, 4.3)
    scale = 2.5e6 * float(result["rms_height"])
    for axes, name, letter, text in ((grid[0, 0], "map", "a", "scan"), (grid[0, 1], "twin_map", "b", "a sampled twin")):
        image = _map(axes, result, name, scale)
        head(axes, letter, text)
    figure.colorbar(image, ax=grid[0, 1], label="height [µm]", extend="both")
    _density(grid[0, 2], result)
    _correlation(grid[1, 0], result)
    _spectrum(grid[1, 1], result)
    _numbers(grid[1, 2], result)
    head(grid[0, 2], "c", "density of heights")
    head(grid[1, 0], "d", "autocorrelation")
    head(grid[1, 1], "e", "power spectrum")
    head(grid[1, 2], "f", "numbers" if result["sufficient"] else "numbers (scan small for intervals)")
    for axes in grid.ravel()[2:]:
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def _map(axes: Axes, result: Arrays, name: str, scale: float) -> AxesImage:
    x, y = 1e6 * result["map_x"], 1e6 * result["map_y"]
    heights = 1e6 * (result[name] - np.mean(result[name]))
    image = axes.imshow(
        heights.T, extent=(0, x[0] + x[-1], 0, y[0] + y[-1]), origin="lower", cmap="viridis", vmin=-scale, vmax=scale
    )
    axes.set(xlabel="x [µm]", ylabel="y [µm]")
    return image


def _band(
    axes: Axes,
    x: np.ndarray,
    scan: Sequence[np.ndarray],
    twins: np.ndarray,
    line: str = "-",
    labels: tuple[str, str] = ("scan (95 %)", "twins (range)"),
) -> None:
    """A curve of the scan with its interval, and the mean, the least and the largest of the twins (twin, ...)."""
    axes.fill_between(x, scan[1], scan[2], color=SCAN, alpha=0.2, linewidth=0)
    axes.plot(x, scan[0], color=SCAN, lw=1.4, ls=line, label=labels[0])
    axes.fill_between(x, twins.min(axis=0), twins.max(axis=0), color=TWIN, alpha=0.3, linewidth=0)
    axes.plot(x, twins.mean(axis=0), color=TWIN, lw=1.2, ls=line, label=labels[1])


def _density(axes: Axes, result: Arrays) -> None:
    edges = 1e6 * result["density_edge"]
    scan = [1e-6 * result[f"density{end}"] for end in INTERVAL]
    _band(axes, 0.5 * (edges[1:] + edges[:-1]), scan, 1e-6 * result["twin_density"])
    reach = 6e6 * float(result["rms_height"])
    axes.set(xlabel="height [µm]", ylabel="density [1/µm]", ylim=(0, None))
    axes.set_xlim(max(edges[0], -reach), min(edges[-1], reach))
    legend_above(axes)


def _correlation(axes: Axes, result: Arrays) -> None:
    """Cuts of the table of lags through its middle."""
    i, j = (len(result[f"lag_{axis}"]) // 2 for axis in "xy")
    for axis, cut, line in (("x", (slice(i, None), j), "-"), ("y", (i, slice(j, None)), ":")):
        lag = 1e6 * result[f"lag_{axis}"]
        twins = result[f"twin_correlation_{axis}"][:, len(lag) // 2 :]
        scan = [result[f"correlation{end}"][cut] for end in INTERVAL]
        _band(axes, lag[len(lag) // 2 :], scan, twins, line, (f"scan, along {axis}", f"twins, along {axis}"))
    for level in (0.0, np.exp(-1)):
        axes.axhline(level, color="0.6", lw=0.6)
    axes.set(xlabel="lag [µm]", ylabel="autocorrelation", xlim=(0, None))
    legend_above(axes)


def _spectrum(axes: Axes, result: Arrays) -> None:
    axes.set(xscale="log", yscale="log", xlabel="wavenumber [rad/µm]", ylabel="power spectrum [µm$^4$]")
    scan = [1e24 * result[f"power{end}"] for end in INTERVAL]
    _band(axes, 1e-6 * result["wavenumber"], scan, 1e24 * result["twin_power"])
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.legend(loc="lower left", fontsize="small")


def _numbers(axes: Axes, result: Arrays) -> None:
    """A row a number: the scan's interval goes from -1 to 1, and each twin lies where it does in units of it.

    At the right, how many twins lie inside.
    """
    shown = [name for name in NUMBERS if name != "fractal_dimension" or 2.0 <= result[name] <= 3.0]
    for row, name in enumerate(shown):
        value, low, high = (float(result[f"{name}{end}"]) for end in INTERVAL)
        away = result[f"twin_{name}"] - value
        if name == "lay":  # an angle between undirected lines
            away = (away + np.pi / 2) % np.pi - np.pi / 2
        away = np.clip(np.where(away > 0, away / (high - value), away / (value - low)), -OUTSIDE, OUTSIDE)
        axes.plot([-1, 1], [-row, -row], "|-", color=SCAN, lw=1.4, label="scan" if row == 0 else None)
        axes.plot(away, np.full(len(away), -row), "o", color=TWIN, ms=4, alpha=0.5, label="twins" if row == 0 else None)
        inside = f"{np.sum(np.abs(away) <= 1)} of {len(away)}"
        axes.annotate(inside, (OUTSIDE + 0.2, -row), ha="right", va="center", fontsize="x-small")
        _, factor, unit = NUMBERS[name]
        text = f"{factor * value:.3g}{unit} ({factor * low:.3g} to {factor * high:.3g})"
        axes.annotate(text, (0, -row), xytext=(0, 6), textcoords="offset points", ha="center", fontsize="x-small")
    axes.set_yticks(-np.arange(len(shown)), [NUMBERS[name][0] for name in shown])
    axes.set(xlim=(-OUTSIDE - 0.2, OUTSIDE + 0.2), ylim=(0.4 - len(shown), 0.8))
    axes.set_xlabel("distance [half the 95 % interval]")
    legend_above(axes)
