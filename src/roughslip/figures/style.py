"""The common style of all figures: panels, titles, legends, and files with the same bytes on every run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np
import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.figure import Figure

Arrays = Mapping[str, np.ndarray]

INTERVAL = ("", "_low", "_high")


def with_interval_names(*names: str) -> list[str]:
    """The names of stored numbers and of both ends of their intervals."""
    return [name + end for name in names for end in INTERVAL]


def panels(columns: int, rows: int, width: float) -> tuple[Figure, np.ndarray]:
    """A figure in the style of the study with its panels, each `width` inches wide."""
    mpl.rcdefaults()  # a user's matplotlibrc changes nothing
    sns.set_theme(context="paper", style="ticks", palette="colorblind", font_scale=1.1)
    mpl.rcParams.update({"svg.hashsalt": "roughslip", "savefig.dpi": 160, "legend.frameon": False})
    figure = Figure(figsize=(width * columns, 3.5 * rows), layout="constrained")
    return figure, figure.subplots(rows, columns)


def save(figure: Figure, path: Path) -> None:
    """Write a figure in the format of its suffix, without date and version: the same figure gives the same bytes."""
    figure.savefig(path, metadata={"Date": None, "Creator": None} if path.suffix == ".svg" else {"Software": None})
    figure.set_layout_engine("none")  # the layout for one format is kept for the next


def head(axes: Axes, letter: str, text: str) -> None:
    """The letter and the title of a panel, above its left edge."""
    axes.set_title(f"({letter}) {text}", loc="left", fontsize="medium")


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
