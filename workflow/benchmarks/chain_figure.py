"""The error budget drawn: what each source leaves in every number of the figures."""

from __future__ import annotations

from collections.abc import Sequence

import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughslip.figures.style import head, panels
from workflow.benchmarks.draw import draw
from workflow.benchmarks.measure import Row, fields

SOURCES = {
    "mesh": ("C0", "s"),
    "modes": ("C1", "D"),
    "solver tolerance": ("C2", "v"),
    "expansion": ("C3", "^"),
    "path nodes": ("C0", "P"),
    "integrator": ("C2", "<"),
    "friction mean": ("C4", "d"),
    "friction std": ("C4", "X"),
    "friction length_m": ("C4", "*"),
    "sampling": ("0.15", "o"),
}
LEAST = 1e-6  # of the axis; a change of nothing is drawn at its edge
FIGURES = (("2", ("contact", "mean_p", "quantile")), ("3", ("mu_",)), ("5", ("cycles",)))


def figure(rows: Sequence[Row]) -> Figure:
    """A row of panels a scene, a panel a figure of the paper, a line a number."""
    scenes = list(dict.fromkeys(fields(row["case"])["scene"] for row in rows))
    canvas, axes = panels(3, len(scenes), 4.6)
    for line, scene in zip(axes.reshape(len(scenes), 3), scenes, strict=True):
        of_scene = [row for row in rows if fields(row["case"])["scene"] == scene]
        for one, letter, (number, begins) in zip(line, "abc", FIGURES, strict=True):
            _panel(one, [row for row in of_scene if fields(row["case"])["number"].startswith(begins)])
            head(one, letter, f"{scene}, Figure {number}")
    handles = {
        label: handle for one in axes.flat for handle, label in zip(*one.get_legend_handles_labels(), strict=True)
    }
    canvas.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=5)
    sns.despine(canvas)
    return canvas


def _panel(axes: Axes, rows: Sequence[Row]) -> None:
    numbers = list(dict.fromkeys(fields(row["case"])["number"] for row in rows))
    for source, (colour, marker) in SOURCES.items():
        found = [row for row in rows if row["method"] == source]
        places = [-numbers.index(fields(row["case"])["number"]) for row in found]
        errors = [max(row["error"], LEAST) for row in found]
        if found:
            ends = [max(row["error"] + 2 * row["standard_error"], LEAST) for row in found]
            axes.hlines(places, errors, ends, color=colour, lw=0.8)
            axes.plot(errors, places, marker, color=colour, ms=5, label=source.removesuffix("_m"))
    axes.axvline(0.01, color="0.7", lw=0.6)
    axes.set(xscale="log", xlabel="error as a share of the number", xlim=(LEAST, 3))
    axes.set_yticks([-place for place in range(len(numbers))], [name.replace("_", " ") for name in numbers])


if __name__ == "__main__":
    draw(figure, __doc__)
