"""Draw benchmarks from their files: error against time or work, a panel a case.

    python -m workflow.benchmarks.plot results/benchmarks/contact.json

A picture stands next to its file, and the name of that, <subject>.json, says what is drawn.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from roughslip.figures.figure2 import METHODS
from roughslip.figures.style import heads, panels, save
from workflow.benchmarks.timing import OURS, Row, fields

MARKERS = "os^vDXP"
FLOOR = 1e-17  # errors below are drawn there
# By method its label and its look.
LOOKS: dict[str, tuple[str, dict[str, Any]]] = {
    "roughslip": ("roughslip", {"color": "0.1", "marker": "o", "linewidth": 2.0}),
    "tamaas/load": ("Tamaas, given the load", {"color": "C0", "marker": "s"}),
    "contactmechanics/bugnicourt": ("ContactMechanics, Bugnicourt", {"color": "C1", "marker": "^"}),
    "polonsky-keer": ("Polonsky-Keer in numpy", {"color": "C2", "marker": "v", "linestyle": "-."}),
    "gstools/randomization": ("GSTools randomization", {"color": "C0", "linestyle": "--"}),
    "gstools/fourier": ("GSTools Fourier", {"color": "C1", "linestyle": "-."}),
    "scipy/RK45": ("scipy RK45", {"color": "C2", "marker": "^"}),
    "scipy/DOP853": ("scipy DOP853", {"color": "C3", "marker": "v"}),
    "diffrax/Tsit5": ("diffrax Tsit5", {"color": "C4", "marker": "D"}),
    "diffrax/Dopri8": ("diffrax Dopri8", {"color": "C5", "marker": "X"}),
    "monte_carlo": ("Monte Carlo", {"color": "0.6", "marker": "o"}),
    "latin_hypercube": ("Latin hypercube", {**METHODS["latin_hypercube"][1], "marker": "s"}),
    "sobol": ("Sobol", {"color": "C4", "linestyle": (0, (5, 1)), "marker": "D"}),
    "equation_8": ("PC, eq. (8)", {**METHODS["equation_8"][1], "marker": "^"}),
    "equation_9": ("PC, eq. (9)", {**METHODS["equation_9"][1], "marker": "v"}),
}


def seconds(row: Row) -> float:
    """The time of a row."""
    return row["seconds"]


def error(row: Row) -> float:
    return max(row["error"], FLOOR)


def of_case(row: Row, key: str) -> str:
    """Return a value of the case of a row, empty where it has no such key."""
    return fields(row["case"]).get(key, "")


def plot_methods(axes: Axes, rows: Sequence[Row], x: Callable[[Row], float], y: Callable[[Row], float] = error) -> None:
    """Plot a line for every method and its settings that the rows name, in the order of the looks."""
    for method, (label, look) in LOOKS.items():
        waves = dict.fromkeys(row["setting"] for row in rows if row["method"] == method and "samples" in row)
        for marker, setting in zip(MARKERS, waves or [None], strict=False):
            line = [row for row in rows if row["method"] == method and setting in (None, row.get("setting"))]
            if line:
                name = f"{label}, {setting} waves" if setting else label
                points = [x(row) for row in line], [y(row) for row in line]
                axes.plot(*points, **{"label": name, "markersize": 4, "marker": marker, **look})
    axes.set(xscale="log", yscale="log")


def by(rows: Iterable[Row], *keys: str) -> dict[str, list[Row]]:
    """Return the rows that have these keys, by their values."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        values = [of_case(row, key) for key in keys]
        if all(values):
            groups.setdefault(", ".join(values), []).append(row)
    return groups


def draw(shown: dict[str, list[Row]], xlabel: str, ylabel: str, x: Callable[[Row], float] = seconds) -> Figure:
    """Draw a panel for each group of rows, with one legend, and the scatter over designs where rows have it."""
    columns = min(len(shown), 3)
    canvas, places = panels(columns, len(shown) // columns, 4.6 if columns < 3 else 3.7)
    for axes, rows in zip(np.ravel(places), shown.values(), strict=False):
        plot_methods(axes, rows, x)
        for row in rows:
            if row["method"] == OURS and "errors" in row:  # percentiles 10 and 90 of the designs
                axes.plot([x(row)] * 2, np.percentile(row["errors"]["distance"], (10, 90)), "0.1", lw=5, alpha=0.3)
        axes.set(xlabel=xlabel, ylabel=ylabel)
        if x is not seconds:
            tick_counts(axes, {x(row) for row in rows})
    return finish(canvas, *shown)


def tick_counts(axes: Axes, counts: Iterable[float]) -> None:
    """Name whole numbers on the x axis, which powers of ten do not name."""
    axes.set_xticks(sorted(counts), [f"{count:g}" for count in sorted(counts)])
    axes.xaxis.set_minor_locator(NullLocator())


def finish(canvas: Figure, *titles: str) -> Figure:
    """Give a figure its titles and one legend for all panels."""
    heads(canvas.axes, *titles)
    named = [zip(*axes.get_legend_handles_labels()[::-1], strict=True) for axes in canvas.axes]
    handles = {label: handle for pairs in named for label, handle in pairs}
    canvas.legend(handles.values(), handles, loc="outside lower center", ncols=3, fontsize="small")
    sns.despine(canvas)
    return canvas


def draw_surface(rows: Sequence[Row]) -> Figure:
    """Draw errors of sample covariances; times of leading modes and of exact samples are in the rows alone."""
    parts = by((row for row in rows if of_case(row, "quantity") == "covariance"), "covariance", "n")
    shown = {f"{name} squared": part for name, part in parts.items()}
    return draw(shown, "time of all samples [s]", "RMS error of the covariance / Sq²")


def draw_contact(rows: Sequence[Row]) -> Figure:
    """Draw the error of the pressure against time, and the time against the mesh at equal residual."""
    canvas, (precision, growth) = panels(2, 1, 4.6)
    n, precise = list(by(rows, "n", "quantity").items())[-1]
    plot_methods(precision, precise, seconds)
    precision.set(xlabel="time [s]", ylabel="relative error of the pressure")
    median = [row for row in rows if row["case"].endswith("surface=gauss level=50 tolerance=1e-10")]
    plot_methods(growth, median, lambda row: int(of_case(row, "n")), seconds)
    growth.set(xlabel="nodes on an edge", ylabel="time of a solve [s]")
    tick_counts(growth, {int(of_case(row, "n")) for row in median})
    return finish(canvas, f"{n.split(',')[0]} squared, median plane", "residual 1e-10, median plane")


def draw_chaos(rows: Sequence[Row]) -> Figure:
    """Draw the error of the distribution against the number of solves, by scene and penetration."""
    parts = by(sorted(rows, key=lambda row: row["work"]), "scene", "percentile")
    shown = {f"{name} %": part for name, part in sorted(parts.items())}
    return draw(shown, "contact solves", "error of the distribution [-]", lambda row: row["work"])


def draw_oscillator(rows: Sequence[Row]) -> Figure:
    """Draw the error of the reattachment point against the time of a cycle, by motion."""
    shown = {name.replace("-", " "): part for name, part in by(rows, "motion").items()}
    return draw(shown, "time of a cycle [s]", "relative error of X")


FIGURES: dict[str, Callable[[Sequence[Row]], Figure]] = {
    "surface": draw_surface,
    "contact": draw_contact,
    "chaos": draw_chaos,
    "oscillator": draw_oscillator,
}


if __name__ == "__main__":
    for file in map(Path, sys.argv[1:]):
        save(FIGURES[file.stem](json.loads(file.read_text(encoding="utf-8"))["rows"]), file.with_suffix(".svg"))
