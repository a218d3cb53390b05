"""Draw a benchmark from its file: error against time.

The figure follows from the name of the file, results/benchmarks/<name>.json.
"""

from __future__ import annotations

import argparse
import contextlib
import json
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from roughslip.figures.figure2 import METHODS
from roughslip.figures.style import despine, head, panels, save
from roughslip.stages.runtime.usage import Usage
from workflow.benchmarks.runner import OURS, times_faster
from workflow.evidence.rows import Row, fields

Looks = Mapping[str, tuple[str, dict[str, Any]]]  # by method its label and its look
LETTERS = "abcdefghijkl"
FLOOR = 1e-17  # errors below are drawn there

LOOKS: Looks = {
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
}
DISTRIBUTIONS: Looks = {
    "monte_carlo": ("Monte Carlo", {**METHODS["monte_carlo"][1], "linewidth": 1.6, "marker": "o"}),
    "latin_hypercube": ("Latin hypercube", {**METHODS["latin_hypercube"][1], "marker": "s"}),
    "sobol": ("Sobol", {"color": "C4", "linestyle": (0, (5, 1)), "marker": "D"}),
    "equation_8": ("PC, eq. (8)", {**METHODS["equation_8"][1], "marker": "^"}),
    "equation_9": ("PC, eq. (9)", {**METHODS["equation_9"][1], "marker": "v"}),
    "roughslip": ("PC, all samples", {**METHODS["roughslip"][1], "linewidth": 2.2, "marker": "o"}),
}
WAYS: Looks = {
    "roughslip": ("roughslip, half width", LOOKS["roughslip"][1]),
    "plain": ("direct cold solves, counted", {"color": "C2", "marker": "v", "linestyle": "-."}),
}
TRUE_ERROR = {"label": "roughslip, true error", "color": "C3", "marker": "D", "linestyle": "", "markerfacecolor": "w"}


def plot_methods(axes: Axes, rows: Sequence[Row], x: Callable[[Row], float], looks: Looks = LOOKS) -> None:
    """Plot the error of every method against x, in the order of the looks."""
    for method, (label, look) in looks.items():
        found = [row for row in rows if row["method"] == method]
        if found:
            errors = [max(row["error"], FLOOR) for row in found]
            axes.plot([x(row) for row in found], errors, **{"label": label, "markersize": 4, **look})
    axes.set(xscale="log", yscale="log")


def seconds(row: Row) -> float:
    """The time of a row."""
    return row["seconds"]


def of_case(row: Row, key: str) -> str:
    """Return a value of the case of a row, empty where it has no such key."""
    return fields(row["case"]).get(key, "")


def values_of(rows: Sequence[Row], key: str) -> list[str]:
    """Return the values of a key of the cases, each once, in their order."""
    return list(dict.fromkeys(of_case(row, key) for row in rows if of_case(row, key)))


def draw_surface(rows: Sequence[Row]) -> Figure:
    """Draw the times of modes and exact samples, and the error of the covariance against the time of samples."""
    compared = [row for row in rows if of_case(row, "quantity") == "covariance"]
    names = values_of(compared, "covariance")
    canvas, (times, *others) = panels(1 + len(names), 1, 5.6)
    canvas.set_figheight(4.8)
    single = [row for row in rows if row not in compared]
    labels = []
    for place, row in enumerate(single):
        times.plot([min(row["turns"]), max(row["turns"])], [place, place], color="0.1")
        times.plot(row["seconds"], place, color="0.1", marker="o")
        what = f"{of_case(row, 'modes')} modes" if of_case(row, "modes") else "sample"
        labels.append(f"{of_case(row, 'covariance').replace('_', ' ')}, {what}, {of_case(row, 'n')}")
    times.set(xscale="log", xlabel="time [s]", yticks=range(len(single)), yticklabels=labels)
    times.invert_yaxis()
    head(times, "a", "modes and exact samples of square meshes")
    for letter, axes, name in zip("bc", others, names, strict=True):
        here = [row for row in compared if of_case(row, "covariance") == name]
        marks: dict[str, int] = defaultdict(int)  # settings of a method that are drawn
        for method, setting in dict.fromkeys((row["method"], row["setting"]) for row in here):
            label, look = LOOKS[method]
            label += f", {setting} waves" if setting else ""
            part = [row for row in here if row["setting"] == setting]
            plot_methods(axes, part, seconds, {method: (label, {"marker": "s^v"[marks[method]], **look})})
            marks[method] += 1
        axes.set(xlabel="time of all samples [s]", ylabel="RMS error of the covariance / Sq²")
        axes.legend(fontsize="x-small", loc="upper center", bbox_to_anchor=(0.42, -0.15), ncols=2)
        head(axes, letter, f"samples, {of_case(here[0], 'n')} x {of_case(here[0], 'n')}, {name}")
    return canvas


def draw_contact(rows: Sequence[Row]) -> Figure:
    """Draw error against time on one mesh, and time at the median plane against the mesh."""
    canvas, (precision, growth) = panels(2, 1, 5.2)
    errors = [row for row in rows if of_case(row, "quantity")]
    n = values_of(errors, "n")[-1]
    plot_methods(precision, [row for row in errors if of_case(row, "n") == n], lambda row: 1e3 * row["seconds"])
    precision.set(xlabel="time of a solve [ms]", ylabel="relative error of the pressure")
    head(precision, "a", f"work and precision, {n} x {n}, median plane")
    median = [row for row in rows if row["case"].endswith("surface=gauss level=50 tolerance=1e-10")]
    for method, (label, look) in LOOKS.items():
        found = [row for row in median if row["method"] == method]
        times = [1e3 * row["seconds"] for row in found]
        if found:
            growth.plot([int(of_case(row, "n")) for row in found], times, label=label, **look)
    compared = times_faster(median).get("tamaas/load", {})
    for row in median:
        if row["method"] == OURS and row["case"] in compared:
            place, text = (int(of_case(row, "n")), 1e3 * row["seconds"]), f"{compared[row['case']]:.0f}x"
            growth.annotate(text, place, xytext=(0, -14), textcoords="offset points", ha="center", fontsize="small")
    growth.set(xscale="log", yscale="log", xlabel="nodes on an edge", ylabel="time of a solve [ms]")
    sizes = values_of(median, "n")
    growth.set_xticks([int(size) for size in sizes], sizes)
    growth.minorticks_off()
    growth.margins(x=0.08, y=0.15)
    head(growth, "b", "residual 1e-10, median plane" + "; times faster than Tamaas" * bool(compared))
    canvas.legend(*growth.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return canvas


def draw_chaos(rows: Sequence[Row]) -> Figure:
    """Draw the error of the distribution against contact solves: a row of panels a scene, a panel a penetration."""
    scenes, percentiles = values_of(rows, "scene"), values_of(rows, "percentile")
    canvas, grid = panels(len(percentiles), len(scenes), 3.7)
    places = np.reshape(grid, (len(scenes), len(percentiles)))
    errors = [row["error"] for row in rows]
    for number, axes in enumerate(places.ravel()):
        scene, percentile = scenes[number // len(percentiles)], percentiles[number % len(percentiles)]
        here = [row for row in rows if row["case"].startswith(f"scene={scene} percentile={percentile} ")]
        here.sort(key=lambda row: row["work"])
        for row in here:
            if row["method"] == OURS:  # percentiles 10 and 90 of the designs
                ends = np.percentile(row["errors"]["distance"], (10, 90))
                axes.plot([row["work"]] * 2, ends, color=DISTRIBUTIONS[OURS][1]["color"], linewidth=5, alpha=0.3)
        plot_methods(axes, here, lambda row: row["work"], DISTRIBUTIONS)
        axes.set_xticks([250, 500, 1000, 2000, 4000], ["250", "500", "1000", "2000", "4000"])
        axes.minorticks_off()
        axes.set_ylim(0.6 * min(errors), 1.5 * max(errors))
        head(axes, LETTERS[number], f"{scene}, penetration {percentile} %")
    for line in places:
        line[0].set_ylabel("largest error of the distribution [-]")
    for axes in places[-1]:
        axes.set_xlabel("contact solves")
    canvas.legend(*places[0, -1].get_legend_handles_labels(), loc="outside lower center", ncols=6, fontsize="small")
    return canvas


def draw_oscillator(rows: Sequence[Row]) -> Figure:
    """Draw the error of the reattachment point against the time of a cycle, a panel a motion."""
    rows = [row for row in rows if of_case(row, "asked")]
    motions = values_of(rows, "motion")
    canvas, places = panels(len(motions), 1, 5.6)
    for letter, axes, motion in zip(LETTERS, places, motions, strict=False):
        plot_methods(axes, [row for row in rows if of_case(row, "motion") == motion], seconds)
        axes.set(xlabel="time of a cycle [s]", ylabel="relative error of X")
        head(axes, letter, motion.replace("-", " "))
    places[0].legend(fontsize="x-small")
    return canvas


def draw_chain(rows: Sequence[Row]) -> Figure:
    """Draw half widths and true errors against CPU time, ours and of direct solves."""
    canvas, axes = panels(1, 1, 6.4)
    canvas.set_figheight(4.2)
    plot_methods(axes, rows, seconds, WAYS)
    ours = [row for row in rows if row["method"] == OURS]
    known = [row for row in ours if "true_error" in row]
    errors, deviations = ([row[name] for row in known] for name in ("true_error", "reference_error"))
    axes.errorbar([seconds(row) for row in known], errors, deviations, **TRUE_ERROR)
    for row in ours:
        place, text = (seconds(row), row["error"]), f"{of_case(row, 'asked')} asked"
        axes.annotate(text, place, xytext=(4, 5), textcoords="offset points", fontsize="small")
    axes.set(xlabel="CPU time [s]", ylabel="relative half width or error")
    for axis, subs in ((axes.xaxis, (1,)), (axes.yaxis, (1, 2, 5))):
        axis.set_major_locator(LogLocator(subs=subs))
        axis.set_major_formatter("{x:g}")
    axes.minorticks_off()
    axes.legend()
    return canvas


FIGURES: dict[str, Callable[[Sequence[Row]], Figure]] = {
    "surface": draw_surface,
    "contact": draw_contact,
    "chaos": draw_chaos,
    "oscillator": draw_oscillator,
    "chain": draw_chain,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--benchmark", type=Path, required=True, help=f"<name>.json, name one of {', '.join(FIGURES)}")
    parser.add_argument("--output", type=Path, nargs="+", required=True, help="pictures, PNG or SVG")
    parser.add_argument("--usage", type=Path, help="record of cost to write")
    arguments = parser.parse_args()
    if arguments.benchmark.stem not in FIGURES:
        parser.error(f"{arguments.benchmark}: no such benchmark; its name must be one of {', '.join(FIGURES)}")
    with Usage(arguments.usage, "draw") if arguments.usage else contextlib.nullcontext() as usage:
        drawn = FIGURES[arguments.benchmark.stem](json.loads(arguments.benchmark.read_text(encoding="utf-8"))["rows"])
        despine(*drawn.axes)
        for path in arguments.output:
            save(drawn, path)
        if usage:
            usage.files(read=[arguments.benchmark], made=arguments.output)


if __name__ == "__main__":
    main()
