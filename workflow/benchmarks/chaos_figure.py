"""The chaos benchmark drawn: error of the distribution of the pressure at the centre against solves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughslip.figures.style import METHODS, head, panels
from workflow.benchmarks.chaos_summary import LIMITS
from workflow.benchmarks.draw import draw
from workflow.benchmarks.measure import Row, fields

LOOKS: dict[str, tuple[str, dict[str, Any]]] = {
    "monte_carlo": ("Monte Carlo", {**METHODS["monte_carlo"][1], "linewidth": 1.6, "marker": "o"}),
    "latin_hypercube": ("Latin hypercube", {**METHODS["latin_hypercube"][1], "marker": "s"}),
    "sobol": ("Sobol", {"color": "C4", "linestyle": (0, (5, 1)), "marker": "D"}),
    "equation_8": ("PC, eq. (8)", {**METHODS["equation_8"][1], "marker": "^"}),
    "equation_9": ("PC, eq. (9)", {**METHODS["equation_9"][1], "marker": "v"}),
    "roughslip": ("PC, all samples", {**METHODS["roughslip"][1], "linewidth": 2.2, "marker": "o"}),
}
BAR = (10, 90)  # percentiles of the designs


def figure(rows: Sequence[Row]) -> Figure:
    """A row of panels a scene, a panel a penetration."""
    rows = [row for row in rows if "distance" in row.get("errors", {})]
    scenes = list(dict.fromkeys(fields(row["case"])["scene"] for row in rows))
    percentiles = sorted({int(fields(row["case"])["percentile"]) for row in rows})
    canvas, grid = panels(len(percentiles), len(scenes), 3.7)
    places = np.reshape(grid, (len(scenes), len(percentiles)))
    letters = iter("abcdefghijkl")
    for scene, line in zip(scenes, places, strict=True):
        for percentile, axes in zip(percentiles, line, strict=True):
            of_panel = [r for r in rows if r["case"].startswith(f"scene={scene} percentile={percentile} ")]
            _panel(axes, of_panel)
            head(axes, next(letters), f"{scene}, penetration {percentile} %")
        line[0].set_ylabel("largest error of the distribution [-]")
    errors = [row["error"] for row in rows]
    for axes in places.ravel():
        axes.set_ylim(0.6 * min(errors), 1.5 * max(errors))
    for axes in places[-1]:
        axes.set_xlabel("contact solves")
    canvas.legend(*places[0, -1].get_legend_handles_labels(), loc="outside lower center", ncols=7, fontsize="small")
    sns.despine(canvas)
    return canvas


def _panel(axes: Axes, rows: Sequence[Row]) -> None:
    for method, (label, look) in LOOKS.items():
        found = sorted((row for row in rows if row["method"] == method), key=lambda row: row["work"])
        if method == "roughslip":
            for row in found:
                ends = np.percentile(row["errors"]["distance"], BAR)
                axes.plot([row["work"]] * 2, ends, color=look["color"], linewidth=5, alpha=0.3)
        work, errors = [row["work"] for row in found], [row["error"] for row in found]
        axes.plot(work, errors, label=label, markersize=4, **look)
    axes.axhline(LIMITS["distance"], color="C7", linestyle=":", label="limit of ours")
    axes.set(xscale="log", yscale="log")
    axes.set_xticks([250, 500, 1000, 2000, 4000], ["250", "500", "1000", "2000", "4000"])
    axes.minorticks_off()


if __name__ == "__main__":
    draw(figure, __doc__)
