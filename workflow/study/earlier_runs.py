"""Clear stale locks of killed runs, and refuse to start while jobs of one are queued.

Snakemake's own lock is files, which a killed run leaves behind, and they do not say whether their owner is alive. So
each Snakemake process also holds a shared lock of the kernel, which ends with the process. A process that can get
this lock alone is the only one in the folder, and all of Snakemake's lock files are stale.

If Snakemake is killed on a login node, its jobs stay in the queue of Slurm. A job that starts after a new run has made
its result would remove it while others read it.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
from pathlib import Path
from typing import IO, NamedTuple

from roughslip.errors import InputError

ALIVE = "PENDING,CONFIGURING,RUNNING,SUSPENDED"  # states of jobs that will still write
_OF_A_RULE = "rule_"  # begins the comment of each job that the plug-in submits
_SECONDS = 15.0  # for Slurm to answer
_held: list[IO[str]] = []  # open as long as the process lives


class Hold(NamedTuple):
    """is_alone : whether no other Snakemake is at work in the folder; lines : for the user"""

    is_alone: bool
    lines: list[str]


def hold(state: Path) -> Hold:
    """Hold the lock of a folder until this process ends, and clear the lock files of a killed run.

    state : Snakemake's folder

    On a file system without locks Snakemake's own lock decides, and after a crash `snakemake --unlock` is needed.
    Raises InputError where the folder cannot be written to.
    """
    try:
        state.mkdir(exist_ok=True)
        file = (state / "alive").open("a", encoding="utf-8")
    except OSError as error:
        raise InputError(f"{state}: cannot be written to ({error.strerror})") from None
    _held.append(file)
    locks = sorted((state / "locks").glob("*.lock")) if (state / "locks").is_dir() else [*state.glob("locks")]
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        is_alone = True
    except BlockingIOError:
        is_alone = False
    except OSError:
        return Hold(not locks, [])
    lines = []
    if is_alone:
        for lock in locks:
            lock.unlink(missing_ok=True)
        if locks:
            lines = [f"{state / 'locks'}: stale lock of an interrupted run; removed"]
    elif locks:
        lines = [f"{state.resolve().parent}: another run is at work in this folder; wait for its end, or stop it"]
    else:
        lines = [f"{state.resolve().parent}: another Snakemake reads this folder"]
    fcntl.flock(file, fcntl.LOCK_SH)
    return Hold(is_alone, lines)


def refuse_queued_jobs(state: Path) -> None:
    """Raise InputError where jobs of an earlier run are in the queue; call it while no run is at work in the folder."""
    folder = state.resolve().parent
    if queued := queued_jobs(folder):
        raise InputError(
            f"{folder}: jobs of an interrupted run are in the queue of Slurm and would overwrite new results; start "
            f"again when they have ended, or after: scancel {' '.join(queued)}"
        )


def queued_jobs(folder: Path, states: str = ALIVE) -> list[str]:
    """Numbers of the jobs of rules that were submitted from a folder and are in one of these states.

    Empty without Slurm, or where it does not answer.
    """
    if shutil.which("squeue") is None:
        return []
    command = ["squeue", "--noheader", f"--user={os.getuid()}", f"--states={states}", "--format=%A|%k|%Z"]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=_SECONDS)
    except (OSError, subprocess.TimeoutExpired):
        return []
    lines = [line.split("|", 2) for line in answer.stdout.splitlines() if line.count("|") > 1]
    here = folder.resolve()
    return [job for job, comment, at in lines if comment.startswith(_OF_A_RULE) and Path(at.strip()).resolve() == here]
