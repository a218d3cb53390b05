"""The command of every benchmark: options, times of methods in turns, rows, and a record of the machine.

A benchmark file is `{machine, versions, summary, rows}`. A row is `{case, method, error, seconds, work}` with `turns`,
the seconds of every turn, and what else a benchmark adds. Rows of one case may be compared.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import importlib.metadata
import math
import os
import platform
import statistics
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

from roughslip import store
from workflow.evidence.rows import Row, fields

OURS = "roughslip"
TURN_SECONDS = 5e-3  # A fast method is called repeatedly for so long, which makes clock and interrupts negligible.
LONG = 1.5  # [s] The call that estimates the time of a method counts as its first turn if it takes longer.

Name = TypeVar("Name", bound=Hashable)


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """Return the seconds of one call, and its result."""
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def race(
    calls: Mapping[Name, Callable[[], Any]], quick: bool = False, least: int = 1
) -> tuple[dict[Name, list[float]], dict[Name, Any]]:
    """Time methods in turns; return the seconds of a call in every turn, and the result of the first call, by name.

    The first call may compile and the second estimates the time. A call below one second gets five turns, below three
    seconds three, at least `least`, and one turn if `quick`. The order is reversed at every other turn, so that a
    change of the machine's speed affects all alike.
    """
    results = {}
    seconds: dict[Name, list[float]] = {}
    turns, repeats = {}, {}
    for name, call in calls.items():
        results[name] = call()
        one = timed(call)[0]
        turns[name] = 1 if quick else max(least, 5 if one < 1 else 3 if one < 3 else 1)
        repeats[name], seconds[name] = math.ceil(TURN_SECONDS / max(one, 1e-9)), [one] if one > LONG else []
    gc.collect()
    gc.disable()
    try:
        for turn in range(max(turns.values())):
            for name in list(calls)[:: 1 if turn % 2 == 0 else -1]:
                if len(seconds[name]) <= turn < turns[name]:
                    whole, _ = timed(lambda call=calls[name], count=repeats[name]: [call() for _ in range(count)])
                    seconds[name].append(whole / repeats[name])
    finally:
        gc.enable()
    return seconds, results


def make_row(case: str, method: str, error: float, turns: Sequence[float], work: float, **more: Any) -> Row:
    """Return a row, and print it.

    error : relative, of the quantity that the case names
    turns : [s] of every turn; `seconds` is their median
    work : the natural count: products, solves, evaluations

    Raises ValueError for an error that is not finite.
    """
    if not math.isfinite(error):
        raise ValueError(f"{method} at {case}: the error of a row must be finite, not {error}")
    row = {"case": case, "method": method, "error": error, "seconds": statistics.median(turns), "work": int(work)}
    print(f"{case}: {method} {row['seconds']:.3g} s, error {error:.1e}", file=sys.stderr, flush=True)
    return {**row, "turns": list(turns), **more}


def times_faster(rows: Iterable[Row]) -> dict[str, dict[str, float]]:
    """Return the time over ours by peer and case, the median over turns, where both meet the tolerance of the case."""
    met = [row for row in rows if row["error"] <= float(fields(row["case"]).get("tolerance", 0.0))]
    ours = {row["case"]: row["turns"] for row in met if row["method"] == OURS}
    found: dict[str, dict[str, float]] = defaultdict(dict)
    for row in met:
        if row["method"] != OURS and row["case"] in ours:
            pairs = zip(row["turns"], ours[row["case"]], strict=False)
            found[row["method"]][row["case"]] = statistics.median(theirs / our for theirs, our in pairs)
    return dict(found)


def summarise_speed(rows: Sequence[Row]) -> dict[str, Any]:
    """Return by peer the geometric mean of the time ratios at each tolerance, and the least ratio."""
    summary = {}
    for method, by_case in sorted(times_faster(rows).items()):
        by_tolerance: dict[str, list[float]] = defaultdict(list)
        for name, ratio in by_case.items():
            by_tolerance[fields(name)["tolerance"]].append(ratio)
        means = {tolerance: statistics.geometric_mean(ratios) for tolerance, ratios in by_tolerance.items()}
        worst = min(by_case, key=lambda name: by_case[name])
        summary[method] = {"geometric_mean": means, "worst": {"case": worst, "ratio": by_case[worst]}}
    return summary


def head(packages: Iterable[str]) -> dict[str, Any]:
    """Return the processor, the number of its cores, and the versions of Python and of the installed packages."""
    information, versions = Path("/proc/cpuinfo"), {"python": platform.python_version()}
    lines = information.read_text().splitlines() if information.is_file() else []
    models = (line.partition(": ")[2] for line in lines if line.startswith("model name"))
    machine = {"processor": next(models, platform.processor() or platform.machine()), "cores": os.cpu_count()}
    for package in ("numpy", "scipy", "numba", *packages):
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            versions[package] = importlib.metadata.version(package)
    return {"machine": machine, "versions": versions}


def run_command(
    description: str | None,
    measure: Callable[[bool, bool], Mapping[str, Any]],
    packages: Sequence[str] = (),
    peers: Sequence[str] = (),
) -> None:
    """Run a benchmark from the command line and write its file.

    measure : (quick, with peers) -> `summary` and `rows`
    packages : whose versions the file records
    peers : import names of the public packages that `--peers` needs
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--output", type=Path, required=True, help="the JSON file")
    parser.add_argument("--peers", action="store_true", help=f"include public solvers: {', '.join(peers) or 'none'}")
    parser.add_argument("--quick", action="store_true", help="small problems, one turn each")
    arguments = parser.parse_args()
    missing = [name for name in peers if arguments.peers and find_spec(name) is None]
    if missing:
        parser.error(f"not installed: {', '.join(missing)}; `make benchmark PEERS=1` sets up an environment with them")
    store.write_json(arguments.output, {**head(packages), **measure(arguments.quick, arguments.peers)})
