"""The figure of a scan: its statistics with their intervals, and the model fitted to it."""

from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from scipy.ndimage import center_of_mass, label

from roughslip.figures.style import Look, Shown, draw_curve, draw_map, heads, legend_above, panels, with_ends

# Numbers in the last panel: label, factor to the unit shown, unit.
NUMBERS = {
    "rms_height": ("$S_q$", 1e6, " µm"),
    "skewness": ("skewness", 1.0, ""),
    "kurtosis": ("kurtosis", 1.0, ""),
    "length_along": ("length along lay", 1e6, " µm"),
    "length_across": ("length across", 1e6, " µm"),
    "lay": ("lay from x", 180 / np.pi, "°"),
}
SCAN, MODEL = "0.15", "C1"
WIDEST, NARROW = 150, 42  # letters in a line across the figure, and in one of a panel


def figure_scan(result: Shown) -> Figure:
    """Map, autocorrelation over lags, density of heights, curves and numbers of a scan, and the curves of its model.

    Colours cover 2.5 Sq of the points that are no outliers. A circle surrounds each outlier or spot of them.
    """
    figure, grid = panels(3, 2, 4.3)
    outlier = result["map_outlier"].values.astype(bool)
    kept = result["map"].where(~outlier)
    scale = 2.5e6 * float(kept.std())
    heights = 1e6 * (result["map"] - kept.mean())
    limits = -scale, scale
    draw_map(grid[0, 0], result["map_x"], result["map_y"], heights, "height [µm]", limits, extend="both")
    if outlier.any():
        spots, number = label(outlier, np.ones((3, 3)))
        i, j = np.round(center_of_mass(outlier, spots, range(1, number + 1))).astype(int).T
        places = 1e6 * result["map_x"][i], 1e6 * result["map_y"][j]
        grid[0, 0].plot(*places, "o", mfc="none", mec="C3", mew=0.8, ms=6, label="outliers")
    _over_lags(figure, grid[0, 1], result)
    _density(grid[0, 2], result)
    _correlation(grid[1, 0], result)
    _spectrum(grid[1, 1], result)
    _numbers(grid[1, 2], result)
    numbers = "numbers (95 %)" if result["sufficient"] else "numbers (scan small for intervals)"
    count = int(result["outliers"])
    scan = f"scan, {count} outlier{'s' if count > 1 else ''} circled" if count else "scan"
    heads(grid.ravel(), scan, "over lags", "density of heights", "autocorrelation", "power spectrum", numbers)
    figure.suptitle(fill(f"Read: {result['read'].item()}", WIDEST, max_lines=3, placeholder=" ..."), fontsize="small")
    return figure


def _over_lags(figure: Figure, axes: Axes, result: Shown) -> None:
    """The autocorrelation over all lags, and the lines at which scan and model fall to 1/e."""
    lags = 1e6 * result["lag_x"].values, 1e6 * result["lag_y"].values
    (left, right), (bottom, top) = ((lag[0] - np.ptp(lag[:2]) / 2, lag[-1] + np.ptp(lag[:2]) / 2) for lag in lags)
    look: Look = {"origin": "lower", "aspect": "auto", "cmap": "RdBu_r", "vmin": -1, "vmax": 1}
    image = axes.imshow(result["correlation"].T, extent=(left, right, bottom, top), **look)
    figure.colorbar(image, ax=axes, label="autocorrelation")
    axes.contour(*lags, result["correlation"].T, levels=[np.exp(-1)], colors=SCAN)
    if "model_correlation" in result:
        axes.contour(*lags, result["model_correlation"].T, levels=[np.exp(-1)], colors=MODEL, linestyles="--")
    axes.set(xlabel="lag along x [µm]", ylabel="lag along y [µm]")


def _density(axes: Axes, result: Shown) -> None:
    edges = 1e6 * result["density_edge"]
    axes.plot(0.5 * (edges[1:] + edges[:-1]), 1e-6 * result["density"], color=SCAN, lw=1.4)
    reach = 6e6 * float(result["rms_height"])
    axes.set(xlabel="height [µm]", ylabel="density [1/µm]", ylim=(0, None))
    axes.set_xlim(max(float(edges[0]), -reach), min(float(edges[-1]), reach))


def _correlation(axes: Axes, result: Shown) -> None:
    """Cuts of the table of lags through its middle."""
    i, j = (len(result[f"lag_{axis}"]) // 2 for axis in "xy")
    for axis, cut, line in (("x", (slice(i, None), j), "-"), ("y", (i, slice(j, None)), ":")):
        lag = 1e6 * result[f"lag_{axis}"][i if axis == "x" else j :]
        ends = [end[cut] for end in with_ends(result, "correlation")]
        draw_curve(axes, lag, ends, {"color": SCAN, "lw": 1.4, "ls": line, "label": f"scan, along {axis}"})
        if "model_correlation" in result:
            axes.plot(lag, result["model_correlation"][cut], line, color=MODEL, lw=1.4, label=f"model, along {axis}")
    for level in (0.0, np.exp(-1)):
        axes.axhline(level, color="0.6", lw=0.6)
    axes.set(xlabel="lag [µm]", ylabel="autocorrelation", xlim=(0, None))
    model = fill(f"model: {result['model'].item()}", NARROW)
    axes.annotate(model, (0.97, 0.8), xycoords="axes fraction", ha="right", va="top", fontsize="x-small")
    legend_above(axes)


def _spectrum(axes: Axes, result: Shown) -> None:
    axes.set(xscale="log", yscale="log", xlabel="wavenumber [rad/µm]", ylabel="power spectrum [µm$^4$]")
    ends = with_ends(result, "power", factor=1e24)
    draw_curve(axes, 1e-6 * result["wavenumber"], ends, {"color": SCAN, "lw": 1.4, "label": "scan (95 %)"})
    if "model_power" in result:
        axes.plot(1e-6 * result["wavenumber"], 1e24 * result["model_power"], "--", color=MODEL, lw=1.4, label="model")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.legend(loc="lower left", fontsize="small")


def _numbers(axes: Axes, result: Shown) -> None:
    """A row a number, with the ends of its interval."""
    axes.set_axis_off()
    for row, (name, (title, factor, unit)) in enumerate(NUMBERS.items()):
        value, low, high = (factor * float(end) for end in with_ends(result, name))
        height = 0.9 - 0.9 * row / len(NUMBERS)
        axes.text(0.0, height, title, transform=axes.transAxes)
        axes.text(0.55, height, f"{value:.3g}{unit} ({low:.3g} to {high:.3g})", transform=axes.transAxes)
