"""Clear stale Snakemake locks.

Snakemake's own lock is files, which a killed run leaves behind, and they do not say whether their owner is alive. So
each Snakemake process also holds a shared lock of the kernel, which ends with the process. A process that can get
this lock alone is the only one in the folder, and all of Snakemake's lock files are stale.
"""

from __future__ import annotations

import fcntl
from pathlib import Path
from typing import IO, NamedTuple

from roughslip.errors import InputError

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
        lines = [f"{state.resolve().parent}: another Snakemake reads this folder; results were not checked"]
    fcntl.flock(file, fcntl.LOCK_SH)
    return Hold(is_alone, lines)
