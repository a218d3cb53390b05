"""What all benchmarks share: cases, times of methods in turns, rows, and the command that runs one.

    python -m workflow.benchmarks.runner contact --output results/benchmarks/contact.json

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
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

from roughslip import store

SUBJECTS = ("surface", "contact", "chaos", "oscillator")
OURS = "roughslip"
TURN_SECONDS = 5e-3  # A fast method is called repeatedly for so long, which makes clock and interrupts negligible.
LONG = 1.5  # [s] The call that estimates the time of a method counts as its first turn if it takes longer.
PACKAGES = ("numpy", "scipy", "numba", "ducc0", "tamaas", "ContactMechanics", "gstools", "diffrax", "jax")

Row = dict[str, Any]
Name = TypeVar("Name", bound=Hashable)


def case(**pairs: object) -> str:
    """Return the name of a case: `key=value` pairs joined by spaces."""
    return " ".join(f"{key}={value}" for key, value in pairs.items())


def power(value: float) -> str:
    """Return a tolerance as it stands in the name of a case, for example 1e-6."""
    mantissa, exponent = f"{value:e}".split("e")
    return f"{float(mantissa):g}e{int(exponent)}"


def fields(name: str) -> dict[str, str]:
    """Return the pairs of a case's name."""
    return dict(pair.split("=", 1) for pair in name.split(" "))


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
    results = {name: call() for name, call in calls.items()}
    once = {name: timed(call)[0] for name, call in calls.items()}
    turns = {
        name: 1 if quick else max(least, 5 if needed < 1 else 3 if needed < 3 else 1) for name, needed in once.items()
    }
    seconds: dict[Name, list[float]] = {name: [needed] if needed > LONG else [] for name, needed in once.items()}
    gc.collect()
    gc.disable()
    try:
        for turn in range(max(turns.values())):
            for name in list(calls)[:: 1 if turn % 2 == 0 else -1]:
                if len(seconds[name]) <= turn < turns[name]:
                    count, call = math.ceil(TURN_SECONDS / max(once[name], 1e-9)), calls[name]
                    seconds[name].append(
                        timed(lambda call=call, count=count: [call() for _ in range(count)])[0] / count
                    )
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


def summarise_speed(rows: Iterable[Row]) -> dict[str, Any]:
    """Return by peer the geometric mean at each tolerance of its time over ours, and the least ratio.

    A ratio is the median over turns; methods that miss the tolerance of a case do not count.
    """
    met = [row for row in rows if row["error"] <= float(fields(row["case"])["tolerance"])]
    ours = {row["case"]: row["turns"] for row in met if row["method"] == OURS}
    ratios: dict[str, dict[str, float]] = defaultdict(dict)
    for row in met:
        if row["method"] != OURS and row["case"] in ours:
            pairs = zip(row["turns"], ours[row["case"]], strict=False)
            ratios[row["method"]][row["case"]] = statistics.median(theirs / our for theirs, our in pairs)
    summary = {}
    for method, of_case in sorted(ratios.items()):
        of: dict[str, list[float]] = defaultdict(list)
        for name, ratio in of_case.items():
            of[fields(name)["tolerance"]].append(ratio)
        worst = min(of_case, key=lambda name: of_case[name])
        means = {tolerance: statistics.geometric_mean(some) for tolerance, some in of.items()}
        summary[method] = {"geometric_mean": means, "worst": {"case": worst, "ratio": of_case[worst]}}
    return summary


def main() -> None:
    """Run a benchmark and write its file."""
    parser = argparse.ArgumentParser(description="Measure run time against error.")
    parser.add_argument("subject", choices=SUBJECTS, help="its module has `measure(quick, peers)`: summary and rows")
    parser.add_argument("--output", type=Path, required=True, help="the JSON file")
    parser.add_argument("--peers", action="store_true", help="include public solvers: make benchmark PEERS=1")
    parser.add_argument("--quick", action="store_true", help="small problems, one turn each")
    arguments = parser.parse_args()
    measured = import_module(f"workflow.benchmarks.{arguments.subject}").measure(arguments.quick, arguments.peers)
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.is_file() else []
    models = (line.partition(": ")[2] for line in lines if line.startswith("model name"))
    processor = next(models, platform.processor() or platform.machine())
    installed = {package.metadata["Name"]: package.version for package in importlib.metadata.distributions()}
    versions = {name: installed[name] for name in PACKAGES if name in installed}
    head = {"machine": {"processor": processor, "cores": os.cpu_count()}}
    head["versions"] = {"python": platform.python_version(), **versions}
    store.write_text(arguments.output, json.dumps({**head, **measured}, separators=(",", ":"), allow_nan=False) + "\n")


if __name__ == "__main__":
    main()
