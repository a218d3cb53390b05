"""What all figures share: panels, titles, intervals, maps, legends, and files with the same bytes on every run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.rcsetup import cycler

Arrays = Mapping[str, np.ndarray]
Look = dict[str, Any]  # colour, marker and line of an artist, in matplotlib's words

INTERVAL = ("", "_low", "_high")

DARK, LARGE, SMALL = ".15", 10.56, 9.68  # a grey, and sizes of text [pt]
BLIND_SAFE = "#0173b2 #de8f05 #029e73 #d55e00 #cc78bc #ca9161 #fbafe4 #949494 #ece133 #56b4e9"
STYLE: Any = {
    "axes.axisbelow": True,
    "axes.edgecolor": DARK,
    "axes.labelcolor": DARK,
    "axes.labelsize": LARGE,
    "axes.linewidth": 1.0,
    "axes.prop_cycle": cycler(color=BLIND_SAFE.split()),
    "axes.titlesize": LARGE,
    "font.size": LARGE,
    "legend.fontsize": SMALL,
    "legend.frameon": False,
    "legend.title_fontsize": LARGE,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.8,
    "lines.solid_capstyle": "round",
    "patch.edgecolor": "w",
    "patch.force_edgecolor": True,
    "patch.linewidth": 0.8,
    "path.simplify_threshold": 0.3,
    "savefig.dpi": 160,
    "svg.hashsalt": "roughslip",
    "text.color": DARK,
} | {
    f"{axis}tick.{name}": value
    for axis in "xy"
    for name, value in {
        "color": DARK,
        "labelsize": SMALL,
        "major.size": 4.8,
        "major.width": 1.0,
        "minor.size": 3.2,
        "minor.width": 0.8,
    }.items()
}
"""seaborn's theme for papers, with ticks, its colours for the colour-blind and text of 1.1 times the size. Its import
would take 1.5 s of every figure."""


def with_interval_names(*names: str) -> list[str]:
    """The names of stored numbers and of both ends of their intervals."""
    return [name + end for name in names for end in INTERVAL]


def panels(columns: int, rows: int, width: float) -> tuple[Figure, np.ndarray]:
    """A figure in the style of the study with its panels, each `width` inches wide."""
    mpl.rcdefaults()  # a user's matplotlibrc changes nothing
    mpl.rcParams.update(STYLE)
    figure = Figure(figsize=(width * columns, 3.5 * rows), layout="constrained")
    return figure, figure.subplots(rows, columns)


def save(figure: Figure, path: Path) -> None:
    """Write a figure in the format of its suffix, without date and version: the same figure gives the same bytes."""
    figure.savefig(path, metadata={"Date": None, "Creator": None} if path.suffix == ".svg" else {"Software": None})
    figure.set_layout_engine("none")  # the layout for one format is kept for the next


def despine(*panels: Axes) -> None:
    """Leave out the upper and the right side of panels."""
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)


def head(axes: Axes, letter: str, text: str) -> None:
    """The letter and the title of a panel, above its left edge."""
    axes.set_title(f"({letter}) {text}", loc="left", fontsize="medium")


def heads(axes: Iterable[Axes], *texts: str) -> None:
    """Letters in their order, and a title for each panel."""
    for panel, letter, text in zip(axes, "abcdefghi", texts, strict=False):
        head(panel, letter, text)


def with_ends(result: Arrays, name: str, index: Any = ..., factor: float = 1.0) -> list[np.ndarray]:
    """A stored number and both ends of its interval, in units of 1 / factor: value, low, high."""
    return [factor * result[name + end][index] for end in INTERVAL]


def draw_curve(axes: Axes, x: np.ndarray, ends: Sequence[np.ndarray], look: Look, alpha: float = 0.2) -> None:
    """A curve of values with the band of their intervals. ends : value, low, high"""
    value, low, high = ends
    axes.fill_between(x, low, high, color=look["color"], alpha=alpha, linewidth=0)
    axes.plot(x, value, **look)


def draw_points(axes: Axes, x: np.ndarray, ends: Sequence[np.ndarray], look: Look, lw: float = 1.2) -> None:
    """Markers of values with their intervals. ends : value, low, high"""
    value, low, high = ends
    axes.vlines(x, low, high, color=look["color"], lw=lw)
    axes.plot(x, value, **{"marker": "o", "ls": "none", "ms": 4, **look})


def draw_map(
    axes: Axes, x: np.ndarray, y: np.ndarray, values: np.ndarray, colours: str, limits: Sequence[float]
) -> AxesImage:
    """Values (x, y) at the centres of cells [m] as colours between two limits."""
    extent = (0, 1e6 * (x[0] + x[-1]), 0, 1e6 * (y[0] + y[-1]))
    axes.set(xlabel="x [µm]", ylabel="y [µm]")
    return axes.imshow(values.T, extent=extent, origin="lower", cmap=colours, vmin=limits[0], vmax=limits[1])


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
