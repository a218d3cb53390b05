"""The contact benchmark drawn: error against time, and time against the mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughslip.figures.style import head, panels
from workflow.benchmarks.draw import draw
from workflow.benchmarks.measure import OURS, Row, fields, ratios

LOOKS: dict[str, tuple[str, dict[str, Any]]] = {
    "roughslip": ("roughslip", {"color": "0.1", "marker": "o", "linewidth": 2.0}),
    "tamaas/load": ("Tamaas, given the load", {"color": "C0", "marker": "s"}),
    "tamaas/penetration": ("Tamaas, searching the load", {"color": "C0", "marker": "s", "mfc": "w", "ls": "--"}),
    "contactmechanics/bugnicourt": ("ContactMechanics, Bugnicourt", {"color": "C1", "marker": "^"}),
    "contactmechanics/polonsky-keer": (
        "ContactMechanics, Polonsky-Keer",
        {"color": "C1", "marker": "^", "mfc": "w", "ls": "--"},
    ),
    "polonsky-keer": ("Polonsky-Keer in numpy", {"color": "C2", "marker": "v", "ls": "-."}),
}
"""Label and look of the methods; told apart by style as well as by colour."""

RATIO = "tamaas/load"
MEDIAN = "surface=gauss level=50 tolerance=1e-10"


def figure(rows: Sequence[Row]) -> Figure:
    """Work and precision on one mesh; time at the median plane, 1e-10, against the mesh, with the ratio to Tamaas."""
    canvas, (precision, growth) = panels(2, 1, 5.2)
    _precision(precision, [row for row in rows if "quantity" in fields(row["case"])])
    _growth(growth, [row for row in rows if row["case"].endswith(MEDIAN)])
    handles = {label: line for axes in (precision, growth) for line, label in zip(*_lines(axes), strict=True)}
    order = [label for label, _ in LOOKS.values() if label in handles]
    canvas.legend([handles[label] for label in order], order, loc="outside lower center", ncols=3)
    sns.despine(canvas)
    return canvas


def _lines(axes: Axes) -> tuple[list, list]:
    return axes.get_legend_handles_labels()


def _precision(axes: Axes, rows: Sequence[Row]) -> None:
    n = max(int(fields(row["case"])["n"]) for row in rows)
    for method, (label, look) in LOOKS.items():
        of_method = [row for row in rows if row["method"] == method and int(fields(row["case"])["n"]) == n]
        if of_method:
            axes.plot(
                [1e3 * row["seconds"] for row in of_method], [row["error"] for row in of_method], label=label, **look
            )
    axes.set(xscale="log", yscale="log", xlabel="time of a solve [ms]", ylabel="relative error of the pressure")
    head(axes, "a", f"work and precision, {n} x {n}, median plane")


def _growth(axes: Axes, rows: Sequence[Row]) -> None:
    meshes = sorted({int(fields(row["case"])["n"]) for row in rows})
    for method, (label, look) in LOOKS.items():
        seconds = {int(fields(row["case"])["n"]): row["seconds"] for row in rows if row["method"] == method}
        if seconds:
            axes.plot(sorted(seconds), [1e3 * seconds[n] for n in sorted(seconds)], label=label, **look)
    compared = ratios(rows).get(RATIO, {})
    for row in rows:
        if row["method"] == OURS and row["case"] in compared:
            place, text = (int(fields(row["case"])["n"]), 1e3 * row["seconds"]), f"{compared[row['case']]:.0f}x"
            axes.annotate(text, place, xytext=(0, -14), textcoords="offset points", ha="center", fontsize="small")
    axes.set(xscale="log", yscale="log", xlabel="nodes on an edge", ylabel="time of a solve [ms]")
    axes.set_xticks(meshes, [f"{n}" for n in meshes])
    axes.minorticks_off()
    axes.margins(x=0.08, y=0.15)
    head(axes, "b", "residual 1e-10, median plane" + "; times faster than Tamaas" * bool(compared))


if __name__ == "__main__":
    draw(figure, __doc__)
