"""The study: its graph of stages, the job that runs one, and the work of each stage in a module.

Here is what each start needs, of Snakemake too: the end of a job with its parent, and the files that jobs make.
A job ends with the process that started it, so that a killed Snakemake leaves no writer behind.
"""

import ctypes
import hashlib
import json
import os
import signal
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

PARENT = "ROUGHSLIP_PARENT"  # in the environment: the process that starts the jobs


def die_with_parent() -> None:
    """Ask the kernel to kill this process when its parent dies.

    Linux only, and only for the direct parent: a rule's shell line starts the job with `exec`. A parent that died
    before this call sends no signal any more. The Snakefile puts its process id into PARENT.
    """
    if sys.platform == "linux":
        set_parent_death_signal = 1  # PR_SET_PDEATHSIG of <linux/prctl.h>
        ctypes.CDLL(None).prctl(set_parent_death_signal, signal.SIGKILL, 0, 0, 0)
        if os.environ.get(PARENT, str(os.getppid())) != str(os.getppid()):
            os.kill(os.getpid(), signal.SIGKILL)


def checksum(path: Path) -> str:
    """SHA-256 of the bytes of a file."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def describe(record: Path, made: Iterable[Path]) -> dict[str, dict[str, Any]]:
    """Size [B] and checksum of files, by their names from the folder above that of the record of a job."""
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
