"""The friction benchmark drawn: error of the correlation against time."""

from __future__ import annotations

from collections.abc import Sequence

import seaborn as sns
from matplotlib.figure import Figure

from roughslip.figures.style import head, panels
from workflow.benchmarks.draw import draw
from workflow.benchmarks.measure import Row, fields

MARKERS = {"roughslip/recursion": "o", "roughslip/embedding": "s", "roughslip/spectral": "^"}


def figure(rows: Sequence[Row]) -> Figure:
    """Error of the sample autocorrelation, and points per second, against the time of ensembles of every size."""
    canvas, (errors, speeds) = panels(1, 2, 5.6)
    shapes = sorted({(float(fields(row["case"])["a"]), float(fields(row["case"])["b"])) for row in rows})
    for colour, (a, b) in enumerate(shapes):
        for method, marker in MARKERS.items():
            found = [
                row
                for row in rows
                if row["method"] == method and (fields(row["case"])["a"], fields(row["case"])["b"]) == (str(a), str(b))
            ]
            look = {"color": f"C{colour}", "marker": marker, "label": f"Beta({a:g}, {b:g}), {method.split('/')[1]}"}
            seconds = [row["seconds"] for row in found]
            errors.plot(seconds, [row["error"] for row in found], **look)
            speeds.plot([row["work"] for row in found], [row["work"] / row["seconds"] for row in found], **look)
    errors.set(
        xscale="log", yscale="log", xlabel="time of all paths [s]", ylabel="largest error of the autocorrelation"
    )
    speeds.set(xscale="log", yscale="log", xlabel="points of all paths", ylabel="points a second")
    speeds.legend(fontsize="x-small")
    head(errors, "a", "error against time")
    head(speeds, "b", "speed")
    sns.despine(canvas)
    return canvas


if __name__ == "__main__":
    draw(figure, __doc__)
