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
STARTED = time.perf_counter()
TURN_SECONDS = 5e-3  # A fast method is called repeatedly for so long, which makes clock and interrupts negligible.
LONG = 1.5  # [s] The call that estimates the time of a method counts as its first turn if it takes longer.

Name = TypeVar("Name", bound=Hashable)


def race(
    calls: Mapping[Name, Callable[[], Any]],
    quick: bool = False,
    least: int = 1,
    clock: Callable[[], float] = time.perf_counter,
) -> tuple[dict[Name, list[float]], dict[Name, Any]]:
    """Time methods in turns; return the seconds of a call in every turn, and the result of the first call, by name.

    calls : the methods by name
    quick : one turn each
    least : the least number of turns

    The first call may compile and the second estimates the time. A call below one second gets five turns, below three
    seconds three. The order is reversed at every other turn, so that a change of the machine's speed affects all alike.
    """
    results, single = {}, {}
    for name, call in calls.items():
        results[name] = call()
        start = clock()
        call()
        single[name] = max(clock() - start, 1e-9)
    turns = {name: 1 if quick else max(least, 5 if one < 1 else 3 if one < 3 else 1) for name, one in single.items()}
    seconds: dict[Name, list[float]] = {name: [one] if one > LONG else [] for name, one in single.items()}
    gc.collect()
    gc.disable()
    try:
        for turn in range(max(turns.values())):
            for name in list(calls)[:: 1 if turn % 2 == 0 else -1]:
                if turn in range(len(seconds[name]), turns[name]):
                    count = math.ceil(TURN_SECONDS / single[name])
                    start = clock()
                    for _ in range(count):
                        calls[name]()
                    seconds[name].append((clock() - start) / count)
    finally:
        gc.enable()
    return seconds, results


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """Return the seconds of one call, and its result."""
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def make_row(name: str, method: str, error: float, turns: Sequence[float], work: float, **more: Any) -> Row:
    """Return a row of the file.

    name : of the case
    error : relative, of the quantity that the case names
    turns : [s] of every turn; `seconds` is their median
    work : the natural count: products, solves, evaluations
    more : further columns

    Raises ValueError for an error that is not finite.
    """
    if not math.isfinite(error):
        raise ValueError(f"{method} at {name}: the error of a row must be finite, not {error}")
    row = {"case": name, "method": method, "error": error, "seconds": statistics.median(turns), "work": int(work)}
    return {**row, "turns": list(turns), **more}


def is_met(row: Row) -> bool:
    """Whether the error is below the tolerance of the case; True for a case without one."""
    return row["error"] <= float(fields(row["case"]).get("tolerance", "inf"))


def time_ratios(rows: Iterable[Row], ours: str = OURS) -> dict[str, dict[str, float]]:
    """Return the time over ours by method and case, the median over turns, of cases that both solve to tolerance."""
    met = [row for row in rows if "tolerance" in fields(row["case"]) and is_met(row)]
    our_turns = {row["case"]: row["turns"] for row in met if row["method"] == ours}
    found: dict[str, dict[str, float]] = defaultdict(dict)
    for row in met:
        if row["method"] != ours and row["case"] in our_turns:
            pairs = zip(row["turns"], our_turns[row["case"]], strict=False)
            found[row["method"]][row["case"]] = statistics.median(theirs / our for theirs, our in pairs)
    return dict(found)


def summarise_speed(rows: Sequence[Row]) -> dict[str, Any]:
    """Return by peer the geometric mean of the time ratios at each tolerance, and the least ratio."""
    summary = {}
    for method, by_case in sorted(time_ratios(rows).items()):
        tolerances = dict.fromkeys(fields(name)["tolerance"] for name in by_case)
        means = {
            one: statistics.geometric_mean(ratio for name, ratio in by_case.items() if fields(name)["tolerance"] == one)
            for one in tolerances
        }
        worst = min(by_case, key=lambda name: by_case[name])
        summary[method] = {"geometric_mean": means, "worst": {"case": worst, "ratio": by_case[worst]}}
    return summary


def describe_machine() -> dict[str, Any]:
    """Return the processor and the number of its cores."""
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.is_file() else []
    models = (line.partition(": ")[2] for line in lines if line.startswith("model name"))
    return {"processor": next(models, platform.processor() or platform.machine()), "cores": os.cpu_count()}


def installed_versions(packages: Iterable[str]) -> dict[str, str]:
    """Return the versions of Python and of those packages that are installed."""
    found = {"python": platform.python_version()}
    for package in packages:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            found[package] = importlib.metadata.version(package)
    return found


def report_progress(text: str) -> None:
    """Print a line with the time since the start to standard error."""
    print(f"{time.perf_counter() - STARTED:7.1f} s  {text}", file=sys.stderr, flush=True)


def report_rows(rows: Sequence[Row]) -> None:
    """Print the time and error of every method of one case."""
    times = ", ".join(f"{row['method']} {1e3 * row['seconds']:.3g} ms {row['error']:.1e}" for row in rows)
    report_progress(f"{rows[0]['case']}: {times}")


def run_command(
    description: str | None,
    measure: Callable[[bool, bool], Mapping[str, Any]],
    packages: Sequence[str] = (),
    peers: Sequence[str] = (),
) -> None:
    """Run a benchmark from the command line and write its file.

    description : of the command
    measure : (quick, with peers) -> `summary`, `rows` and further parts of the file
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
    head = {"machine": describe_machine(), "versions": installed_versions(("numpy", "scipy", "numba", *packages))}
    store.write_json(arguments.output, {**head, **measure(arguments.quick, arguments.peers)})
