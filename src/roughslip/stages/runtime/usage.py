"""The record of a job: what it cost and what it did. costs.json sums the records of a scene.

A record also has size and checksum of the files that its job made. Every start of Snakemake imports this module, so it
imports little.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from roughslip.atomic_write import replacing


def checksum(path: Path) -> str:
    """SHA-256 of the bytes of a file."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def describe(record: Path, made: Iterable[Path]) -> dict[str, dict[str, Any]]:
    """Size [B] and checksum of files, by their names from the folder above that of their record of cost."""
    folder = record.parent.parent
    return {
        os.path.relpath(path, folder): {"bytes": path.stat().st_size, "sha256": checksum(path)}
        for path in sorted(made)
        if path.is_file()
    }


def is_whole(record: Path) -> bool:
    """Whether a job has ended: its record is there, and each of its files has the size that the record says.

    A job writes its record last.
    """
    try:
        made = json.loads(record.read_text(encoding="utf-8"))["made"]
        return all((record.parent.parent / name).stat().st_size == file["bytes"] for name, file in made.items())
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False


_IMPORTED = time.perf_counter()
_LINES_APART = 5.0  # seconds between two lines of progress


class Usage:
    """Recorder of one job; on leaving without an error it writes its record as JSON, atomically.

    path : the record
    stage : name of the stage, also in front of each line of progress

    The record holds the stage, the number of jobs (1), and the wall and CPU seconds of the process from its start. The
    CPU seconds of `core` follow, and the peak memory, null where the platform gives none. Its entries `did` and
    `skipped` are counts by name. Its entry `warnings` holds texts for the user. Its entry `made` holds size
    and checksum of each file that the job made, by its name from the folder above that of the record.
    """

    def __init__(self, path: str | Path, stage: str) -> None:
        self.path = Path(path)
        self.stage = stage
        self.did: dict[str, float] = {}
        self.skipped: dict[str, int] = {}
        self.warnings: list[str] = []
        self.made: dict[str, dict[str, Any]] = {}
        self.core_cpu_seconds = 0.0
        self._last_line = time.perf_counter()
        self._done = 0
        self._first = (0, 0.0)  # done at the first call of a loop, and when

    def __enter__(self) -> Usage:
        return self

    def __exit__(self, error: type[BaseException] | None, *_: object) -> None:
        if error is None:
            with replacing(self.path) as temporary:
                temporary.write_text(json.dumps(self.record(), indent=2) + "\n", encoding="utf-8")

    def record(self) -> dict[str, Any]:
        """The record up to now."""
        peak = peak_memory_mib()
        return {
            "stage": self.stage,
            "jobs": 1,
            "cpu_seconds": round(time.process_time(), 3),
            "wall_seconds": round(_seconds_since_process_start(), 3),
            "core_cpu_seconds": round(self.core_cpu_seconds, 3),
            "peak_memory_mib": None if peak is None else round(peak, 1),
            "did": dict(sorted(self.did.items())),
            "skipped": dict(sorted(self.skipped.items())),
            "warnings": self.warnings,
            "made": self.made,
        }

    @contextlib.contextmanager
    def core(self) -> Iterator[None]:
        """Count the CPU time of a block as solving, fitting or integrating; numba's compiling in it is not counted."""
        with _numba_compiler_seconds() as compiler:
            start = time.process_time()
            try:
                yield
            finally:
                self.core_cpu_seconds += time.process_time() - start - compiler()

    def count(self, **did: float) -> None:
        """Add to the counts of what the job did: `usage.count(solves=3)`."""
        for name, number in did.items():
            self.did[name] = self.did.get(name, 0) + number

    def skip(self, counts: Mapping[str, int]) -> None:
        """Add to the counts of what the job did not compute, by what it is and why: `{"solves: no contact": 3}`."""
        for name, number in counts.items():
            self.skipped[name] = self.skipped.get(name, 0) + int(number)

    def warn(self, *texts: str) -> None:
        """Tell the user what limits the result: in the job's log, in costs.json, on the page, at the end of the run.

        texts : each one line: what, its number, what follows or what to do
        """
        for text in texts:
            if text not in self.warnings:
                self.warnings.append(text)
                print(f"{self.stage}: warning: {text}", file=sys.stderr, flush=True)

    def say(self, text: str) -> None:
        """A line on stderr, which is the job's log."""
        print(f"{self.stage}: {text}", file=sys.stderr, flush=True)

    def files(self, made: Iterable[Path]) -> None:
        """Take size and checksum of the files that the job made."""
        self.made = describe(self.path, made)

    def progress(self, done: int, total: int) -> None:
        """A line on stderr, which is the job's log: every few seconds, with the time to go, and when all is done.

        done : from 1 up; a lower one than before begins another loop. Time is counted from the first call of a loop, so
            that compiling does not count
        """
        now = time.perf_counter()
        if done <= self._done or not self._done:
            self._first = done, now
        self._done = done
        if now - self._last_line >= _LINES_APART or done == total:
            self._last_line = now
            seconds = _seconds_since_process_start()
            first, began = self._first
            to_go = (total - done) * (now - began) / max(done - first, 1)
            left = f", about {to_go:.0f} s to go" if first < done < total else ""
            print(f"{self.stage}: {done} of {total} after {seconds:.0f} s{left}", file=sys.stderr, flush=True)


def peak_memory_mib() -> float | None:
    """Peak resident memory of the process [MiB], None where the platform gives none.

    On Linux from /proc: getrusage there starts from what the parent held when it forked.
    """
    if sys.platform == "linux":
        status = Path("/proc/self/status").read_text(encoding="ascii")
        return int(status.partition("VmHWM:")[2].split()[0]) / 1024
    if sys.platform == "darwin":
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return None


def _seconds_since_process_start() -> float:
    """From the kernel's start time on Linux (to 10 ms), elsewhere from the import of this module."""
    if sys.platform == "linux":
        stat = Path("/proc/self/stat").read_text(encoding="utf-8", errors="replace")
        ticks = int(stat.rpartition(")")[2].split()[19])  # field 22; the name before it may hold spaces
        return time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")
    return time.perf_counter() - _IMPORTED


@contextlib.contextmanager
def _numba_compiler_seconds() -> Iterator[Callable[[], float]]:
    """A function that returns the CPU seconds of numba's compiler, for compiling and for loading its cache."""
    if "numba" not in sys.modules:
        yield lambda: 0.0
        return
    from numba.core import event

    class CompilerClock(event.Listener):
        seconds = 0.0
        depth = 0

        def on_start(self, event: object) -> None:
            if self.depth == 0:
                self.start = time.process_time()
            self.depth += 1

        def on_end(self, event: object) -> None:
            self.depth -= 1
            if self.depth == 0:
                self.seconds += time.process_time() - self.start

    clock = CompilerClock()
    with event.install_listener("numba:compiler_lock", clock):
        yield lambda: clock.seconds
