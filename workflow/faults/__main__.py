"""The campaign as a command: faults one after another, after each a new run; exit 1 where anything was lost."""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import NamedTuple

import psutil

from roughslip import store
from roughslip.stages.runtime import record
from workflow.faults.injections import FAULTS
from workflow.faults.scratch import TINY, Scratch, copy_project, digests

ROOT = Path(__file__).resolve().parents[2]
_COMMAND = re.compile(r"rebuild it with: (rm -f .* && snakemake .*)")
_PROGRAMS = {"snakemake": (sys.executable, "-m", "snakemake")}


class Outcome(NamedTuple):
    """number, kind : of the fault
    description : of what was done
    recovery : how many commands mended it
    wrong : results that differ from the undisturbed run, empty if all were restored
    """

    number: int
    kind: str
    description: str
    recovery: int
    wrong: list[str]


def outcomes(scratch: Scratch, seed: int, numbers: range) -> Iterator[Outcome]:
    """Yield the outcome of each fault. Fault n of a seed is the same in each campaign."""
    kinds = list(FAULTS)
    for number in numbers:
        scratch.reset()
        kind = kinds[number % len(kinds)]
        description = FAULTS[kind](scratch, Random(f"{seed} {number}"))
        wrong = end_living_jobs(scratch)
        recovery, failed = recover(scratch)
        yield Outcome(number, kind, description, recovery, wrong + (failed or differences(scratch)))


def end_living_jobs(scratch: Scratch, seconds: float = 10.0) -> list[str]:
    """Kill jobs that outlived the run that started them, and return a line for each."""
    working, lines = [], []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error, OSError):
            if Path(process.cwd()).is_relative_to(scratch.folder) and process.pid != os.getpid():
                working.append(process)
    for process in psutil.wait_procs(working, timeout=seconds)[1]:
        with contextlib.suppress(psutil.NoSuchProcess):  # ended meanwhile, or a zombie
            lines.append(f"process {process.pid} is alive: {' '.join(process.cmdline())}")
            process.kill()
    return lines


def recover(scratch: Scratch) -> tuple[int, list[str]]:
    """Run again, and where that run prints a command that mends, run it and start again.

    Returns how many commands were needed, and what failed.
    """
    status, output = scratch.run()
    if status == 0:
        return 1, []
    commands = set(_COMMAND.findall(output))
    if len(commands) != 1:
        return 1, [f"exit {status}, and no command that mends: {output[-3000:]}"]
    (command,) = commands
    for part in command.split(" && "):
        words = [word for given in shlex.split(part) for word in _PROGRAMS.get(given, (given,))]
        done = subprocess.run(words, capture_output=True, **scratch.options)
        if done.returncode != 0:
            return 2, [f"{part}: exit {done.returncode}: {(done.stdout + done.stderr)[-3000:]}"]
    status, output = scratch.run()
    return 3, [] if status == 0 else [f"exit {status} after {command}: {output[-3000:]}"]


def differences(scratch: Scratch) -> list[str]:
    """Return results that are not as the undisturbed run left them, and records of cost that are not whole."""
    was, found = digests(scratch.saved / "results" / scratch.scene), digests(scratch.results)
    lines = [f"{name}: missing" for name in was.keys() - found.keys()]
    lines += [f"{name}: new" for name in found.keys() - was.keys()]
    lines += [f"{name}: differs" for name in was.keys() & found.keys() if was[name] != found[name]]
    records = (scratch.results / "usage").glob("*.json")
    lines += [f"usage/{path.name}: damaged" for path in records if not record.is_whole(path)]
    return sorted(lines)


def main() -> int:
    """Run the faults and write results/faults.json, a row each."""
    parser = argparse.ArgumentParser(prog="python -m workflow.faults", description=__doc__)
    parser.add_argument("--count", type=int, default=200, help="faults (200)")
    parser.add_argument("--first", type=int, default=0, help="number of the first (0)")
    parser.add_argument("--seed", type=int, default=1, help="of what is broken, and when (1)")
    parser.add_argument("--output", type=Path, default=Path("results/faults.json"), help="where the outcomes go")
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory(prefix="roughslip-faults-") as base:
        folder = Path(base) / "project"
        copy_project(ROOT, folder)
        (folder / "config/scenes/tiny.yaml").write_text(TINY, encoding="utf-8")
        environment = {**os.environ, "PYTHONPATH": str(folder / "src"), "NUMBA_CACHE_DIR": str(Path(base) / "numba")}
        scratch = Scratch(folder, Path(base) / "saved", "tiny", environment)
        status, output = scratch.run()
        if status:
            print(f"the undisturbed run failed:\n{output}", file=sys.stderr)
            return 1
        scratch.save()
        for outcome in outcomes(scratch, arguments.seed, range(arguments.first, arguments.first + arguments.count)):
            fate = "LOST: " + "; ".join(outcome.wrong) if outcome.wrong else f"mended by {outcome.recovery}"
            print(f"{outcome.number} {outcome.kind} ({outcome.description}): {fate}", flush=True)
            rows.append(outcome._asdict())
            store.write_json(arguments.output, rows)
    lost = sum(bool(row["wrong"]) for row in rows)
    print(f"{len(rows)} faults, {lost} lost something", file=sys.stderr)
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
