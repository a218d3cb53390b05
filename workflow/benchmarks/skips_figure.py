"""The skips drawn: time with everything computed over time with the skip, and how far the results are apart."""

from __future__ import annotations

from collections.abc import Sequence

import seaborn as sns
from matplotlib.figure import Figure

from roughslip.figures.style import head, panels
from workflow.benchmarks.draw import draw
from workflow.benchmarks.measure import OURS, Row, fields

FLOOR = 1e-17  # where nothing differs


def figure(rows: Sequence[Row]) -> Figure:
    """A line a skip: the ratio of times to the left, the difference with its tolerance to the right."""
    by_case: dict[str, dict[str, Row]] = {}
    for row in rows:
        by_case.setdefault(row["case"], {})[row["method"]] = row
    names = list(by_case)
    canvas, (times, results) = panels(2, 1, 6.4)
    places = [-place for place in range(len(names))]
    for place, name in zip(places, names, strict=True):
        ours = by_case[name][OURS]
        plain = next(row for method, row in by_case[name].items() if method != OURS)
        pairs = zip(plain["turns"], ours["turns"], strict=False)
        turns = [everything / skipping for everything, skipping in pairs]
        times.hlines(place, min(turns), max(turns), color="C0", lw=0.8)
        times.plot(plain["seconds"] / ours["seconds"], place, "o", color="C0", ms=5)
        tolerance = float(fields(name)["tolerance"])
        results.plot(max(ours["error"], FLOOR), place, "o", color="C0", ms=5)
        results.plot(max(tolerance, FLOOR), place, "|", color="0.3", ms=10)
    times.axvline(1.0, color="0.7", lw=0.6)
    labels = [fields(name)["skip"].replace("-", " ") for name in names]
    times.set(xscale="log", xlabel="time with all computed\nover time with the skip")
    times.set_yticks(places, labels, fontsize="x-small")
    results.set(xscale="log", xlabel="difference of the results\n(bar: tolerance)", yticks=[], xlim=(FLOOR / 3, 1))
    head(times, "a", "What it saves")
    head(results, "b", "What it changes")
    sns.despine(canvas)
    return canvas


if __name__ == "__main__":
    draw(figure, __doc__)
