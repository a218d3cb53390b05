"""Apply faults one after another; after each, run again and compare with the undisturbed run."""

from __future__ import annotations

import contextlib
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator
from random import Random
from typing import NamedTuple

import psutil

from roughslip.stages.runtime import record
from workflow.faults.injections import FAULTS
from workflow.faults.scratch import Scratch

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
        random = Random(f"{seed} {number}")
        kind = kinds[number % len(kinds)]
        description = FAULTS[kind](scratch, random)
        wrong = still_alive(scratch)
        recovery, failed = recover(scratch)
        wrong += failed or differences(scratch)
        yield Outcome(number, kind, description, recovery, wrong)


def still_alive(scratch: Scratch, seconds: float = 10.0) -> list[str]:
    """Jobs that outlived the run that started them."""
    lines = []
    for process in psutil.wait_procs(scratch.processes(), timeout=seconds)[1]:
        with contextlib.suppress(psutil.NoSuchProcess):  # ended meanwhile, or a zombie
            lines.append(f"process {process.pid} is alive: {' '.join(process.cmdline())}")
            process.kill()
    return lines


def recover(scratch: Scratch) -> tuple[int, list[str]]:
    """A new run, and where it prints a command that mends, that command and another run: how many, and what failed."""
    status, said = scratch.run()
    if status == 0:
        return 1, []
    commands = set(_COMMAND.findall(said))
    if len(commands) != 1:
        return 1, [f"exit {status}, and no command that mends: {said[-3000:]}"]
    (command,) = commands
    for part in command.split(" && "):
        words = [word for given in shlex.split(part) for word in _PROGRAMS.get(given, (given,))]
        done = subprocess.run(words, capture_output=True, **scratch.options)
        if done.returncode != 0:
            return 2, [f"{part}: exit {done.returncode}: {(done.stdout + done.stderr)[-3000:]}"]
    status, said = scratch.run()
    return 3, [] if status == 0 else [f"exit {status} after {command}: {said[-3000:]}"]


def differences(scratch: Scratch) -> list[str]:
    """Results that are not as the undisturbed run left them, and records of cost that are not whole."""
    was, found = scratch.undisturbed(), scratch.digests()
    lines = [f"{name}: missing" for name in was.keys() - found.keys()]
    lines += [f"{name}: new" for name in found.keys() - was.keys()]
    lines += [f"{name}: differs" for name in was.keys() & found.keys() if was[name] != found[name]]
    records = (scratch.results / "usage").glob("*.json")
    lines += [f"usage/{path.name}: damaged" for path in records if record.read(path) is None]
    return sorted(lines)


def line(outcome: Outcome, started: float) -> str:
    """What is shown of a fault while a campaign runs."""
    fate = "LOST: " + "; ".join(outcome.wrong) if outcome.wrong else f"mended by {outcome.recovery}"
    return f"{outcome.number} {outcome.kind} ({outcome.description}): {fate} [{time.monotonic() - started:.0f} s]"
