"""What the benchmarks share: timing by turns, rows, ratios of speed, the machine, and the file.

A benchmark file is `{machine, versions, checks, rows, summary}`. A row is `{case, method, error, seconds, work}` with
`seconds_min`, `seconds_max`, `repeats` and `turns`, the seconds of every turn. Rows of one case may be compared.
"""

from __future__ import annotations

import gc
import importlib.metadata
import json
import math
import os
import platform
import statistics
import sys
import time
import tracemalloc
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from workflow.evidence.rows import Row, case, fields, power

OURS = "roughslip"
STARTED = time.perf_counter()

# A turn of a fast method calls it until so much time has passed, so that the clock and an interrupt weigh little.
TURN_SECONDS = 5e-3

__all__ = ["case", "fields", "power"]  # imported from here until callers import them from workflow.evidence
Name = TypeVar("Name", bound=Hashable)
Turns = Callable[[float], int]  # how many turns for a method that takes so many seconds


@dataclass(frozen=True)
class Contender:
    """One method in a race.

    call : what is timed
    seconds : of a call, as a run before the race has shown
    turns : how many of them
    keep : whether that run counts as the first turn; for methods so slow that one more is one too many
    """

    call: Callable[[], object]
    seconds: float
    turns: int
    keep: bool = False


def race(
    contenders: Mapping[Name, Contender], clock: Callable[[], float] = time.perf_counter
) -> dict[Name, list[float]]:
    """Seconds of a call in every turn of every method.

    The methods take turns, forwards and backwards by turns, so that a change of the machine's speed meets all of them.
    """
    seconds = {name: [contender.seconds] * contender.keep for name, contender in contenders.items()}
    collects = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        for turn in range(max(contender.turns for contender in contenders.values())):
            for name in list(contenders)[:: 1 if turn % 2 == 0 else -1]:
                contender = contenders[name]
                if turn in range(len(seconds[name]), contender.turns):
                    calls = max(1, math.ceil(TURN_SECONDS / max(contender.seconds, 1e-9)))
                    start = clock()
                    for _ in range(calls):
                        contender.call()
                    seconds[name].append((clock() - start) / calls)
    finally:
        if collects:
            gc.enable()
    return seconds


def turns(seconds: float) -> int:
    """Turns for a method that takes so long: five, three, or one."""
    return 5 if seconds < 1 else 3 if seconds < 3 else 1


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds of one call, and what it returned."""
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def row(name: str, method: str, error: float, seconds: Sequence[float], work: int, **more: Any) -> Row:
    """A row of the file; `more` is what the reader of this benchmark may want to know besides."""
    if not math.isfinite(error):
        raise ValueError(f"{method} at {name}: the error of a row must be finite, not {error}")
    return {
        "case": name,
        "method": method,
        "error": error,
        "seconds": statistics.median(seconds),
        "work": int(work),
        "seconds_min": min(seconds),
        "seconds_max": max(seconds),
        "repeats": len(seconds),
        "turns": list(seconds),
        **more,
    }


def ratios(rows: Iterable[Row], ours: str = OURS) -> dict[str, dict[str, float]]:
    """Method -> case -> its time over ours, the median over turns, where both came below the case's tolerance."""
    by_case: dict[str, dict[str, Row]] = defaultdict(dict)
    for entry in rows:
        if "tolerance" in fields(entry["case"]) and meets(entry):
            by_case[entry["case"]][entry["method"]] = entry
    found: dict[str, dict[str, float]] = defaultdict(dict)
    for name, methods in by_case.items():
        for method in methods.keys() - {ours} if ours in methods else ():
            pairs = zip(methods[method]["turns"], methods[ours]["turns"], strict=False)
            found[method][name] = statistics.median(theirs / our for theirs, our in pairs)
    return dict(found)


def speed_summary(rows: Sequence[Row]) -> dict[str, Any]:
    """For every peer: the ratios of time by case, their geometric mean at each tolerance, the worst, what it missed."""
    summary = {}
    for method, by_case in sorted(ratios(rows).items()):
        by_tolerance = defaultdict(list)
        for name, ratio in by_case.items():
            by_tolerance[fields(name)["tolerance"]].append(ratio)
        worst = min(by_case, key=lambda name: by_case[name])
        summary[method] = {
            "geometric_mean": {tolerance: statistics.geometric_mean(all_) for tolerance, all_ in by_tolerance.items()},
            "worst": {"case": worst, "ratio": by_case[worst]},
            "missed": [entry["case"] for entry in rows if entry["method"] == method and not meets(entry)],
            "cases": by_case,
        }
    return summary


def meets(entry: Row) -> bool:
    """Whether the error is below the tolerance of the case; True for a case without one."""
    return entry["error"] <= float(fields(entry["case"]).get("tolerance", "inf"))


def growth_exponent(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """The power of the size by which the time grows from the first size to the last."""
    return math.log(seconds[-1] / seconds[0]) / math.log(sizes[-1] / sizes[0])


def peak_memory(call: Callable[[], object]) -> tuple[int, int | None]:
    """Bytes by which a call raises the memory at its peak: as Python and numpy allocate it, and of the whole process.

    The second is None where the system has no high-water mark that can be reset (other than Linux).
    """
    gc.collect()
    resident = _resident("VmRSS") if _reset_high_water_mark() else None
    tracemalloc.start()
    call()
    traced = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return traced, None if resident is None else _resident("VmHWM") - resident


def _reset_high_water_mark() -> bool:
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return False
    return True


def _resident(name: str) -> int:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith(f"{name}:"))


def machine() -> dict[str, Any]:
    """The processor and the number of its cores."""
    model = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    if information.is_file():
        lines = information.read_text().splitlines()
        model = next((line.partition(": ")[2] for line in lines if line.startswith("model name")), model)
    return {"processor": model, "cores": os.cpu_count()}


def versions(packages: Iterable[str]) -> dict[str, str]:
    """Versions of Python and of those of the packages that are installed."""
    found = {"python": platform.python_version()}
    for package in packages:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def say(text: str) -> None:
    """A line on how far the benchmark is, to the standard error, with the time since its start."""
    print(f"{time.perf_counter() - STARTED:7.1f} s  {text}", file=sys.stderr, flush=True)


def write(path: Path, benchmark: Mapping[str, Any]) -> None:
    """Write a benchmark file whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        partial.write_text(json.dumps(benchmark, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
