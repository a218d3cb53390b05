"""What all benchmarks share: names of cases, times of methods in turns, rows, and their files and pictures.

A file is `{machine, versions, summary, rows}`, a row `{case, method, error, seconds}` with the seconds of every turn,
our work and what else a benchmark adds. Rows of one case, `key=value` pairs, may be compared.
"""

from __future__ import annotations

import argparse
import gc
import importlib.metadata
import json
import math
import os
import platform
import statistics
import sys
import time
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from roughslip import store
from roughslip.figures.figure2 import METHODS
from roughslip.figures.style import heads, panels, save

OURS = "roughslip"
TURN_SECONDS = 5e-3  # A fast method is called repeatedly for so long, which makes clock and interrupts negligible.
LONG = 1.5  # [s] The call that estimates the time of a method counts as its first turn if it takes longer.
PACKAGES = ("numpy", "scipy", "numba", "ducc0", "tamaas", "ContactMechanics", "gstools", "diffrax", "jax")

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

Row = dict[str, Any]
Name = TypeVar("Name", bound=Hashable)


def case(**pairs: object) -> str:
    """Return the name of a case: `key=value` pairs joined by spaces."""
    return " ".join(f"{key}={value}" for key, value in pairs.items())


def fields(name: str) -> dict[str, str]:
    """Return the pairs of a case's name."""
    return dict(pair.split("=", 1) for pair in name.split(" "))


def power(value: float) -> str:
    """Return a tolerance as it stands in the name of a case, for example 1e-6."""
    mantissa, exponent = f"{value:e}".split("e")
    return f"{float(mantissa):g}e{int(exponent)}"


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """Return the seconds of one call, and its result."""
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def race(calls: Mapping[Name, Callable[[], Any]], least: int = 1) -> tuple[dict[Name, list[float]], dict[Name, Any]]:
    """Time methods in turns; return the seconds of a call in every turn, and the result of the first call, by name.

    The first call may compile and the second estimates the time. A call below one second gets five turns, below three
    seconds three, and at least `least`. The order is reversed at every other turn, so that a change of the machine's
    speed affects all alike.
    """
    results = {name: call() for name, call in calls.items()}
    once = {name: timed(call)[0] for name, call in calls.items()}
    turns = {name: max(least, 5 if needed < 1 else 3 if needed < 3 else 1) for name, needed in once.items()}
    seconds: dict[Name, list[float]] = {name: [needed] if needed > LONG else [] for name, needed in once.items()}
    gc.collect()
    gc.disable()
    try:
        for turn in range(max(turns.values())):
            for name in list(calls)[:: 1 if turn % 2 == 0 else -1]:
                if len(seconds[name]) <= turn < turns[name]:
                    count, call = math.ceil(TURN_SECONDS / max(once[name], 1e-9)), calls[name]
                    start = time.perf_counter()
                    for _ in range(count):
                        call()
                    seconds[name].append((time.perf_counter() - start) / count)
    finally:
        gc.enable()
    return seconds, results


def make_row(
    case: str, method: str, error: float, turns: Sequence[float], work: float | None = None, **more: Any
) -> Row:
    """Return a row, and print it. error : relative, of what the case names; work : products, solves or evaluations"""
    assert math.isfinite(error), f"{method} at {case}: the error of a row must be finite, not {error}"
    row = {"case": case, "method": method, "error": error, "seconds": statistics.median(turns)}
    print(f"{case}: {method} {row['seconds']:.3g} s, error {error:.1e}", file=sys.stderr, flush=True)
    return row | ({} if work is None else {"work": int(work)}) | {"turns": list(turns), **more}


def write(subject: str, measure: Callable[[bool], Mapping[str, Any]]) -> None:
    """Run a benchmark as a command and write results/benchmarks/<subject>.json and its picture.

    measure : returns summary and rows, with public solvers where it is asked for them
    """
    parser = argparse.ArgumentParser(description="Measure run time against error.")
    parser.add_argument("--peers", action="store_true", help="include public solvers: make benchmark PEERS=1")
    measured = measure(parser.parse_args().peers)
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.is_file() else []
    models = (line.partition(": ")[2] for line in lines if line.startswith("model name"))
    machine = {"processor": next(models, platform.machine()), "cores": os.cpu_count()}
    installed = {package.metadata["Name"]: package.version for package in importlib.metadata.distributions()}
    versions = {"python": platform.python_version()}
    versions |= {name: installed[name] for name in PACKAGES if name in installed}
    content = {"machine": machine, "versions": versions, **measured}
    text = json.dumps(content, separators=(",", ":"), allow_nan=False)
    file = Path(f"results/benchmarks/{subject}.json")
    store.write_text(file, f"{text}\n")
    save(FIGURES[subject](measured["rows"]), file.with_suffix(".svg"))


def draw(
    rows: Sequence[Row], keys: str, quantity: str = "", x: str = "seconds", xlabel: str = "time [s]", ylabel: str = ""
) -> Figure:
    """Draw error against time or work, a panel for each value of the keys of a case, with one legend.

    quantity : that of the cases that are drawn
    """
    groups: dict[str, list[Row]] = {}
    for row in sorted(rows, key=lambda row: row[x]):
        pairs = fields(row["case"])
        if pairs.get("quantity", "") == quantity:
            groups.setdefault(", ".join(pairs[name] for name in keys.split()), []).append(row)
    columns = min(len(groups), 3)
    canvas, places = panels(columns, len(groups) // columns, 4.6 if columns < 3 else 3.7)
    for axes, name in zip(np.ravel(places), groups, strict=False):
        draw_methods(axes, groups[name], x)
        axes.set(xlabel=xlabel, ylabel=ylabel)
    return _finished(canvas, *groups)


def draw_contact(rows: Sequence[Row]) -> Figure:
    """Draw the error of the pressure against time, and the time against the mesh at equal residual."""
    canvas, (precision, growth) = panels(2, 1, 4.6)
    draw_methods(precision, [row for row in rows if row["case"] == "n=256 surface=gauss level=50 quantity=pressure"])
    precision.set(xlabel="time [s]", ylabel="relative error of the pressure")
    median = [row for row in rows if row["case"].endswith("surface=gauss level=50 tolerance=1e-10")]
    sizes = [{**row, "nodes": int(fields(row["case"])["n"]), "error": row["seconds"]} for row in median]
    draw_methods(growth, sizes, "nodes")
    growth.set(xlabel="nodes on an edge", ylabel="time of a solve [s]")
    return _finished(canvas, "256 x 256, median plane", "residual 1e-10, median plane")


def _finished(canvas: Figure, *titles: str) -> Figure:
    """A figure with its titles and one legend for all panels."""
    heads(canvas.axes, *titles)
    named = [zip(*axes.get_legend_handles_labels()[::-1], strict=True) for axes in canvas.axes]
    handles = {label: handle for pairs in named for label, handle in pairs}
    canvas.legend(handles.values(), handles, loc="outside lower center", ncols=3, fontsize="small")
    return canvas


def draw_methods(axes: Axes, rows: Sequence[Row], x: str = "seconds") -> None:
    """Draw the error of every method and of each of its settings that has rows of several numbers of samples.

    Of several designs the percentiles 10 and 90 of ours are a bar.
    """
    for method, (label, look) in LOOKS.items():
        own = [row for row in rows if row["method"] == method]
        settings = dict.fromkeys(row["setting"] if "samples" in row else None for row in own)
        for marker, setting in zip("os^v", settings, strict=False):
            line = [row for row in own if setting in (None, row.get("setting"))]
            errors = [max(row["error"], FLOOR) for row in line]
            name = f"{label}, {setting} waves" if setting else label
            options = {"label": name, "markersize": 4, "marker": marker, **look}
            axes.plot([row[x] for row in line], errors, **options)
        for row in own if method == OURS else ():
            if "errors" in row:
                axes.plot([row[x]] * 2, np.percentile(row["errors"]["distance"], (10, 90)), "0.1", lw=5, alpha=0.3)
    axes.set(xscale="log", yscale="log")
    if x != "seconds":  # whole numbers, which powers of ten do not name
        counts = sorted({row[x] for row in rows})
        axes.set_xticks(counts, [f"{count:g}" for count in counts])
        axes.xaxis.set_minor_locator(NullLocator())


FIGURES: dict[str, Callable[[Sequence[Row]], Figure]] = {
    "surface": partial(draw, keys="covariance n", quantity="covariance", ylabel="RMS error of the covariance / Sq²"),
    "contact": draw_contact,
    "chaos": partial(
        draw,
        keys="scene percentile",
        quantity="pressure",
        x="work",
        xlabel="contact solves",
        ylabel="error of the distribution [-]",
    ),
    "oscillator": partial(draw, keys="motion", xlabel="time of a cycle [s]", ylabel="relative error of X"),
}
