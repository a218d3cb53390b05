"""Draw a benchmark from its file: error against time or work, a panel a case.

The figure follows from the name of the file, results/benchmarks/<name>.json.
"""

from __future__ import annotations

import argparse
import contextlib
import json
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from roughslip.figures.figure2 import METHODS
from roughslip.figures.style import despine, head, panels, save
from roughslip.stages.runtime.usage import Usage
from workflow.benchmarks.runner import OURS, Row, fields

LETTERS, MARKERS = "abcdefghijkl", "os^vDXP"
FLOOR = 1e-17  # errors below are drawn there
# By method its label and its look.
LOOKS: dict[str, tuple[str, dict[str, Any]]] = {
    "roughslip": ("roughslip", {"color": "0.1", "marker": "o", "linewidth": 2.0}),
    "tamaas/load": ("Tamaas, given the load", {"color": "C0", "marker": "s"}),
    "contactmechanics/bugnicourt": ("ContactMechanics, Bugnicourt", {"color": "C1", "marker": "^"}),
    "polonsky-keer": ("Polonsky-Keer in numpy", {"color": "C2", "marker": "v", "linestyle": "-."}),
    "gstools/randomization": ("GSTools randomization", {"color": "C0", "linestyle": "--"}),
    "gstools/fourier": ("GSTools Fourier", {"color": "C1", "linestyle": "-."}),
    "roughslip/fehlberg45": ("roughslip, order 5(4)", {"color": "C0", "marker": "o"}),
    "roughslip/dormand_prince853": ("roughslip, order 8(5, 3)", {"color": "C1", "marker": "s"}),
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


class Panel(NamedTuple):
    """Rows that are drawn together, and what against what."""

    title: str
    rows: Sequence[Row]
    xlabel: str = "time [s]"
    ylabel: str = "relative error"
    x: Callable[[Row], float] = seconds
    y: Callable[[Row], float] = error


def panels_of(subject: str, rows: Sequence[Row]) -> list[Panel]:
    """Return the panels of a benchmark: by covariance, scene and penetration, or motion; of contact two."""
    if subject == "surface":  # times of leading modes and of exact samples are in the rows
        parts = by((row for row in rows if of_case(row, "quantity") == "covariance"), "covariance", "n")
        time, off = "time of all samples [s]", "RMS error of the covariance / Sq²"
        return [Panel(f"{name} squared", part, time, off) for name, part in parts.items()]
    if subject == "contact":
        n, precise = list(by(rows, "n", "quantity").items())[-1]
        median = [row for row in rows if row["case"].endswith("surface=gauss level=50 tolerance=1e-10")]
        of_error = Panel(f"{n.split(',')[0]} squared, median plane", precise, ylabel="relative error of the pressure")
        axes = "nodes on an edge", "time of a solve [s]", lambda row: int(of_case(row, "n")), seconds
        return [of_error, Panel("residual 1e-10, median plane", median, *axes)]
    if subject == "chaos":
        axes = "contact solves", "error of the distribution [-]", lambda row: row["work"]
        ordered = sorted(rows, key=lambda row: row["work"])
        return [Panel(f"{name} %", part, *axes) for name, part in sorted(by(ordered, "scene", "percentile").items())]
    axes = "time of a cycle [s]", "relative error of X"
    return [Panel(name.replace("-", " "), part, *axes) for name, part in by(rows, "motion").items()]


def draw(subject: str, rows: Sequence[Row]) -> Figure:
    """Draw the panels of a benchmark with one legend, and the scatter over designs where rows have it."""
    shown = panels_of(subject, rows)
    columns = min(len(shown), 3)
    canvas, places = panels(columns, len(shown) // columns, 4.6 if columns < 3 else 3.7)
    for letter, axes, panel in zip(LETTERS, np.ravel(places), shown, strict=False):
        plot_methods(axes, panel.rows, panel.x, panel.y)
        for row in panel.rows:
            if row["method"] == OURS and "errors" in row:  # percentiles 10 and 90 of the designs
                ends = np.percentile(row["errors"]["distance"], (10, 90))
                axes.plot([panel.x(row)] * 2, ends, color="0.1", linewidth=5, alpha=0.3)
        axes.set(xlabel=panel.xlabel, ylabel=panel.ylabel)
        if panel.x is not seconds:  # whole numbers, which powers of ten do not name
            counts = sorted({panel.x(row) for row in panel.rows})
            axes.set_xticks(counts, [f"{count:g}" for count in counts])
            axes.xaxis.set_minor_locator(NullLocator())
        if len(shown) > 1:
            head(axes, letter, panel.title)
    named = [zip(*axes.get_legend_handles_labels()[::-1], strict=True) for axes in canvas.axes]
    handles = {label: handle for pairs in named for label, handle in pairs}
    canvas.legend(handles.values(), handles, loc="outside lower center", ncols=3, fontsize="small")
    return canvas


FIGURES = {name: partial(draw, name) for name in ("surface", "contact", "chaos", "oscillator")}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--benchmark", type=Path, required=True, help=f"<name>.json, name one of {', '.join(FIGURES)}")
    parser.add_argument("--output", type=Path, nargs="+", required=True, help="pictures, PNG or SVG")
    parser.add_argument("--usage", type=Path, help="record of cost to write")
    arguments = parser.parse_args()
    with Usage(arguments.usage, "draw") if arguments.usage else contextlib.nullcontext() as usage:
        drawn = FIGURES[arguments.benchmark.stem](json.loads(arguments.benchmark.read_text(encoding="utf-8"))["rows"])
        despine(*drawn.axes)
        for path in arguments.output:
            save(drawn, path)
        if usage:
            usage.files(arguments.output)


if __name__ == "__main__":
    main()
