"""What all figures share: the numbers they take, seaborn's theme, intervals, maps, and files with the same bytes."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import seaborn as sns
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

Look = dict[str, Any]  # colour, marker and line of an artist, in matplotlib's words
STYLE: Any = {
    "font.sans-serif": ["DejaVu Sans"],  # which matplotlib brings: the same picture everywhere
    "image.cmap": "viridis",
    "legend.frameon": False,
    "path.simplify_threshold": 0.3,
    "svg.hashsalt": "roughslip",
}


class Shown:
    """The variables of a Dataset that a figure takes. `taken` has their names: these numbers are written next to it."""

    def __init__(self, results: xr.Dataset) -> None:
        self.results = results
        self.taken: dict[str, None] = {}

    def __getitem__(self, name: str) -> xr.DataArray:
        self.taken[name] = None
        return self.results[name]

    def __contains__(self, name: str) -> bool:
        return name in self.results


def panels(columns: int, rows: int, width: float) -> tuple[Figure, np.ndarray]:
    """A figure in seaborn's theme for papers with its panels, each `width` inches wide."""
    mpl.rcdefaults()  # a user's matplotlibrc changes nothing
    sns.set_theme("paper", "ticks", "colorblind", font_scale=1.1, rc=STYLE)
    figure = Figure(figsize=(width * columns, 3.5 * rows), layout="constrained")
    grid = figure.subplots(rows, columns)
    sns.despine(figure)
    return figure, grid


def save(figure: Figure, path: Path) -> None:
    """Write a figure in the format of its suffix, without date and version: the same figure gives the same bytes.

    `savefig` would draw it twice, once for its layout, which the first drawing here finds.
    """
    figure.dpi = 160
    if path.suffix == ".svg":
        FigureCanvasSVG(figure).print_svg(path, metadata={"Date": None, "Creator": None})
    else:
        FigureCanvasAgg(figure).print_png(path, metadata={"Software": None}, pil_kwargs={"compress_level": 3})
    figure.set_layout_engine("none")  # the layout for one format is kept for the next


def heads(axes: Iterable[Axes], *texts: str) -> None:
    """A letter in their order and a title for each panel, above its left edge."""
    for panel, letter, text in zip(axes, "abcdefghi", texts, strict=False):
        panel.set_title(f"({letter}) {text}", loc="left", fontsize="medium")


def with_ends(result: Shown, name: str, factor: float = 1.0, **at: Any) -> list[xr.DataArray]:
    """A stored number and both ends of its interval, in units of 1 / factor: value, low, high. at : as for `sel`"""
    return [factor * result[name + end].sel(at) for end in ("", "_low", "_high")]


def draw_curve(axes: Axes, x: Any, ends: Sequence[Any], look: Look, alpha: float = 0.2) -> None:
    """A curve of values with the band of their intervals. ends : value, low, high"""
    value, low, high = ends
    axes.fill_between(x, low, high, color=look["color"], alpha=alpha, linewidth=0)
    axes.plot(x, value, **look)


def draw_points(axes: Axes, x: Any, ends: Sequence[Any], look: Look, lw: float = 1.2) -> None:
    """Markers of values with their intervals. ends : value, low, high"""
    value, low, high = ends
    axes.vlines(x, low, high, color=look["color"], lw=lw)
    axes.plot(x, value, **{"marker": "o", "ls": "none", "ms": 4, **look})


def draw_map(
    axes: Axes,
    x: xr.DataArray,
    y: xr.DataArray,
    values: xr.DataArray,
    label: str,
    limits: tuple[float, float],
    colours: str = "viridis",
    extend: str = "neither",
) -> None:
    """Values (x, y) at the centres of cells [m] as colours between two limits, with their bar."""
    extent = (0, 1e6 * float(x[0] + x[-1]), 0, 1e6 * float(y[0] + y[-1]))
    axes.set(xlabel="x [µm]", ylabel="y [µm]")
    image = axes.imshow(values.T, extent=extent, origin="lower", cmap=colours, vmin=limits[0], vmax=limits[1])
    axes.get_figure(root=True).colorbar(image, ax=axes, label=label, extend=extend)  # type: ignore[union-attr]


def pressure_unit(largest: float) -> tuple[float, str]:
    """Factor from Pa to the unit of a pressure axis, and the name of the unit."""
    return (1e-9, "GPa") if largest > 1e9 else (1e-6, "MPa")


def legend_above(axes: Axes, columns: int = 2) -> None:
    """A legend at the top, over nothing: the axis is raised by the height of its lines."""
    labels = axes.get_legend_handles_labels()[1]
    share = 0.03 + 0.07 * -(-len(labels) // columns)
    scale, (low, high) = axes.yaxis.get_transform(), axes.get_ylim()
    axes.set_yticks([tick for tick in axes.get_yticks() if low <= tick <= high])
    below, above = scale.transform([low, high])
    axes.set_ylim(low, float(scale.inverted().transform([below + (above - below) / (1 - share)])[0]))
    axes.legend(
        loc="upper left", ncols=columns, fontsize="small", columnspacing=0.8, handlelength=1.7, borderaxespad=0.1
    )
