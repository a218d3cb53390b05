"""The surface benchmark drawn: times beside what is promised, and error against time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughslip.figures.style import head, panels
from workflow.benchmarks.draw import draw
from workflow.benchmarks.measure import OURS, Row, fields

COLOURS = {"gaussian": "C0", "exponential": "C1"}
WAYS: dict[str, tuple[str, dict[str, Any]]] = {
    "roughslip": ("by axes", {"marker": "o", "linestyle": "-"}),
    "roughslip/lanczos": ("Lanczos", {"marker": "s", "linestyle": "--"}),
    "scipy/eigh": ("whole matrix, LAPACK", {"marker": "^", "linestyle": ":"}),
}
"""Label and look of the ways to modes; colours are for the covariance."""

GENERATORS: dict[str, tuple[str, dict[str, Any]]] = {
    "roughslip": ("roughslip, embedding", {"color": "0.1", "marker": "o", "linewidth": 2.0}),
    "gstools/randomization": ("GSTools randomization, waves", {"color": "C0", "linestyle": "--"}),
    "gstools/fourier": ("GSTools Fourier, waves an axis", {"color": "C1", "linestyle": "-."}),
}
MARKERS = ("s", "^", "v")
SAMPLED = "exponential"  # the one whose spectrum falls slowly


def figure(rows: Sequence[Row]) -> Figure:
    """Times beside the limits, variance left out against time, and covariance error against time on two meshes."""
    canvas, ((limits, modes), meshes) = panels(2, 2, 5.6)
    canvas.set_figheight(9.0)
    _limits(limits, [row for row in rows if "limit" in row])
    _expansions(modes, [row for row in rows if fields(row["case"]).get("quantity") == "uncaptured_variance"])
    compared = [row for row in rows if fields(row["case"]).get("quantity") == "covariance"]
    sizes = sorted({int(fields(row["case"])["n"]) for row in compared})
    for letter, axes, n in zip("cd", meshes, (sizes[0], sizes[-1]), strict=True):
        _samples(axes, [row for row in compared if row["case"] == f"n={n} covariance={SAMPLED} quantity=covariance"])
        head(axes, letter, f"samples, {n} x {n}, {SAMPLED}")
    sns.despine(canvas)
    return canvas


def _limits(axes: Axes, rows: Sequence[Row]) -> None:
    labels = []
    for place, row in enumerate(rows):
        axes.plot([row["seconds_min"], row["seconds_max"]], [place, place], color="0.1")
        axes.plot(row["seconds"], place, color="0.1", marker="o")
        axes.plot(row["limit"], place, color="C3", marker="|", markersize=12, markeredgewidth=2)
        of_case = fields(row["case"])
        what = f"{of_case['modes']} modes" if "modes" in of_case else of_case["quantity"]
        labels.append(f"{of_case['covariance'].replace('_', ' ')}, {what}, {of_case['n']}")
    axes.set(xscale="log", xlabel="time [s]; bars are the limits", yticks=range(len(rows)), yticklabels=labels)
    axes.invert_yaxis()
    head(axes, "a", "modes and exact samples of square meshes")


def _expansions(axes: Axes, rows: Sequence[Row]) -> None:
    meshes = sorted({int(fields(row["case"])["n"]) for row in rows})
    for n in meshes:
        for name, colour in COLOURS.items():
            for method, (label, look) in WAYS.items():
                case = f"n={n} covariance={name} quantity=uncaptured_variance"
                of_method = [row for row in rows if row["case"] == case and row["method"] == method]
                # the smaller mesh is for LAPACK, for which the larger is too large
                if of_method and (n == meshes[-1] or method == "scipy/eigh"):
                    text = f"{name}, {label}" + f", {n} x {n}" * (n < meshes[-1])
                    axes.plot(*_work_precision(of_method), color=colour, label=text, **look)
    axes.set(xscale="log", yscale="log", xlabel="time [s]", ylabel="variance left out [-]")
    axes.legend(fontsize="x-small", loc="upper center", bbox_to_anchor=(0.42, -0.18), ncols=2, columnspacing=1.0)
    orders = [row["setting"] for row in rows]
    head(axes, "b", f"{min(orders)} to {max(orders)} modes, {meshes[-1]} x {meshes[-1]}")


def _samples(axes: Axes, rows: Sequence[Row]) -> None:
    for method, (label, look) in GENERATORS.items():
        settings = sorted({row["setting"] for row in rows if row["method"] == method})
        for marker, setting in zip(MARKERS, settings, strict=False):
            of_method = [row for row in rows if row["method"] == method and row["setting"] == setting]
            text = label if method == OURS else f"{setting} {label.split(', ')[1]}, {label.split(', ')[0]}"
            axes.plot(*_work_precision(of_method), label=text, **{"marker": marker, **look})
    ours = [row for row in rows if row["method"] == OURS]
    floor = [row["seconds"] for row in ours], [row["floor"] for row in ours]
    axes.plot(*floor, color="C3", linestyle=":", linewidth=2.0, zorder=3, label="expected of exact samples")
    axes.set(xscale="log", yscale="log", xlabel="time of all samples [s]", ylabel="RMS error of the covariance / Sq²")
    axes.legend(fontsize="x-small", loc="upper center", bbox_to_anchor=(0.42, -0.18), ncols=2, columnspacing=1.0)


def _work_precision(rows: Sequence[Row]) -> tuple[list[float], list[float]]:
    return [row["seconds"] for row in rows], [row["error"] for row in rows]


if __name__ == "__main__":
    draw(figure, __doc__)
