"""The oscillator benchmark drawn: error of the reattachment point against time, a panel a motion."""

from __future__ import annotations

from collections.abc import Sequence

import seaborn as sns
from matplotlib.figure import Figure

from roughslip.figures.style import head, panels
from workflow.benchmarks.draw import draw
from workflow.benchmarks.measure import Row, fields

LOOKS = {
    "roughslip/fehlberg45": ("C0", "o"),
    "roughslip/dormand_prince853": ("C1", "s"),
    "scipy/RK45": ("C2", "^"),
    "scipy/DOP853": ("C3", "v"),
    "diffrax/Tsit5": ("C4", "D"),
    "diffrax/Dopri8": ("C5", "X"),
}
FLOOR = 1e-16  # where an error is less than can be told


def figure(rows: Sequence[Row]) -> Figure:
    """Work and precision of every method on every motion."""
    motions = list(dict.fromkeys(fields(row["case"])["motion"] for row in rows if "asked" in fields(row["case"])))
    canvas, axes = panels(1, len(motions), 5.6)
    for letter, axis, motion in zip("abcd", axes, motions, strict=False):
        for method, (colour, marker) in LOOKS.items():
            found = [
                row for row in rows if row["method"] == method and fields(row["case"])["motion"] == motion
                and "asked" in fields(row["case"])
            ]  # fmt: skip
            if not found:  # a peer that was not there
                continue
            errors = [max(row["error"], FLOOR) for row in found]
            axis.plot([row["seconds"] for row in found], errors, color=colour, marker=marker, label=method)
        axis.set(xscale="log", yscale="log", xlabel="time of a cycle [s]", ylabel="relative error of X")
        head(axis, letter, motion.replace("-", " "))
    axes[0].legend(fontsize="x-small")
    sns.despine(canvas)
    return canvas


if __name__ == "__main__":
    draw(figure, __doc__)
