"""Refuse to start while orphaned Slurm jobs are queued.

If Snakemake is killed on a login node, its jobs stay in the queue. A job that starts after a new run has made its
result would remove that result while others read it. Slurm is asked only if an earlier run in the folder used it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

from roughslip.errors import InputError

ALIVE = "PENDING,CONFIGURING,RUNNING,SUSPENDED"  # states of jobs that will still write
_OF_A_RULE = "rule_"  # begins the comment of each job that the plug-in submits
_SECONDS = 15.0  # for Slurm to answer
_MARK = "slurm"  # a file in Snakemake's folder


def mark(state: Path) -> None:
    """Note that a run in this folder submits jobs. state : Snakemake's folder"""
    (state / _MARK).touch()


def refuse(state: Path) -> None:
    """Raise InputError where jobs of an earlier run are in the queue; call it while no run is at work in the folder."""
    folder = state.resolve().parent
    if (state / _MARK).is_file() and (queued := jobs(folder)):
        raise InputError(
            f"{folder}: jobs of an interrupted run are in the queue of Slurm and would overwrite new results; start "
            f"again when they have ended, or after: scancel {' '.join(queued)}"
        )


def jobs(folder: Path, states: str = ALIVE) -> list[str]:
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
