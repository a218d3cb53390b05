"""None of a dead run's jobs beside a new run.

Where the Snakemake on a login node is killed, its jobs stay in the queue of the cluster. One of them that starts after
a new run has made its result removes that first, under the jobs that read it, and then makes it again.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

from roughslip.errors import InputError

ALIVE = "PENDING,CONFIGURING,RUNNING,SUSPENDED"  # states of jobs that will still write
_OF_A_RULE = "rule_"  # begins the comment of every job that the plug-in submits
_SECONDS = 60.0  # for Slurm to answer


def refuse(folder: Path) -> None:
    """Raise InputError where jobs of rules that were submitted from the folder are in the queue of Slurm.

    To be asked where no run is at work in the folder, so that nobody waits for them.
    """
    if left := jobs(folder):
        raise InputError(
            f"{folder.resolve()}: jobs of a run that is gone are in the queue of Slurm and would write over those of "
            f"this one; start again when they are done, or after: scancel {' '.join(left)}"
        )


def jobs(folder: Path, states: str = ALIVE) -> list[str]:
    """Numbers of the jobs of rules that were submitted from a folder and are in such a state.

    Without Slurm there are none, and where it does not answer none are known.
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
