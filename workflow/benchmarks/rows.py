"""What all benchmarks share: names of cases, times of methods in turns, rows, and their files and pictures.

A file is `{machine, versions, summary, rows}`, a row `{case, method, error, seconds}` with the seconds of every turn,
our work and what else a benchmark adds. Rows of one case, `key=value` pairs, may be compared.
"""

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
from pathlib import Path
from typing import Any, TypeVar

import seaborn as sns
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from roughslip import store
from roughslip.figures.style import STYLE, save

OURS = "roughslip"
TURN_SECONDS = 5e-3  # A fast method is called repeatedly for so long, which makes clock and interrupts negligible.
LONG = 1.5  # [s] The call that estimates the time of a method counts as its first turn if it takes longer.
PACKAGES = ("numpy", "scipy", "numba", "ducc0", "tamaas", "ContactMechanics", "gstools", "diffrax", "jax")

FLOOR = 1e-17  # errors below are drawn there
LABELS = {
    "tamaas/load": "Tamaas, given the load",
    "contactmechanics/bugnicourt": "ContactMechanics, Bugnicourt",
    "polonsky-keer": "Polonsky-Keer in numpy",
    "gstools/randomization": "GSTools randomization",
    "gstools/fourier": "GSTools Fourier",
    "monte_carlo": "Monte Carlo",
    "latin_hypercube": "Latin hypercube",
    "sobol": "Sobol",
    "equation_8": "PC, eq. (8)",
    "equation_9": "PC, eq. (9)",
}  # of methods whose names say less

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


def draw(rows: Sequence[Row], keys: str, xlabel: str, ylabel: str, x: str = "seconds", quantity: str = "") -> Figure:
    """Draw error against time or work by method and setting, a panel for each value of the keys of a case.

    quantity : that of the cases that are drawn
    """
    pairs = [fields(row["case"]) for row in rows]
    shown = [(row, one) for row, one in zip(rows, pairs, strict=True) if one.get("quantity", "") == quantity]
    points = {
        "x": [row[x] for row, _ in shown],
        "y": [max(row["error"], FLOOR) for row, _ in shown],
        "method": [_label(row) for row, _ in shown],
        "panel": [", ".join(one[name] for name in keys.split()) for _, one in shown],
    }
    look = {"hue": "method", "style": "method", "markers": True, "kind": "line", "estimator": None}
    sns.set_theme("paper", "ticks", "colorblind", rc=STYLE)
    wrap = min(3, len(set(points["panel"])))
    grid = sns.relplot(points, x="x", y="y", col="panel", col_wrap=wrap, height=3.5, facet_kws=FREE, **look)
    grid.set(xscale="log", yscale="log", xlabel=xlabel, ylabel=ylabel).set_titles("{col_name}")
    for axes in grid.axes.flat:
        axes.xaxis.set_minor_formatter(NullFormatter())
    grid.figure.set_layout_engine("constrained")
    sns.move_legend(grid, "outside lower center", ncols=3, title=None)
    return grid.figure


def _label(row: Row) -> str:
    label = LABELS.get(row["method"], row["method"].replace("/", " "))
    return f"{label}, {row['setting']} waves" if "samples" in row and row.get("setting") else label


def draw_contact(rows: Sequence[Row]) -> Figure:
    """Draw the error of the pressure against time, and the time against the mesh at equal residual."""
    chosen = []
    for row in rows:
        if row["case"] == "n=256 surface=gauss level=50 quantity=pressure":
            chosen.append(row | {"case": "panel=256x256", "x": row["seconds"]})
        elif row["case"].endswith("surface=gauss level=50 tolerance=1e-10"):
            nodes = int(fields(row["case"])["n"])
            chosen.append(row | {"case": "panel=residual_1e-10", "x": nodes, "error": row["seconds"]})
    figure = draw(chosen, "panel", "time [s]", "relative error of the pressure", "x")
    for axes in figure.axes:
        if axes.get_title() != "256x256":
            axes.set(xlabel="nodes on an edge", ylabel="time of a solve [s]")
    return figure


FREE = {"sharex": False, "sharey": False}
COVARIANCE, SOLVES, CYCLE = "RMS error of the covariance / Sq²", "contact solves", "time of a cycle [s]"
FIGURES: dict[str, Callable[[Sequence[Row]], Figure]] = {
    "surface": lambda rows: draw(rows, "covariance n", "time [s]", COVARIANCE, quantity="covariance"),
    "contact": draw_contact,
    "chaos": lambda rows: draw(rows, "scene percentile", SOLVES, "error of the distribution", "work", "pressure"),
    "oscillator": lambda rows: draw(rows, "motion", CYCLE, "relative error of X"),
}
