"""None locked out of a folder by a run that is gone.

Snakemake's own lock is files that a killed run leaves behind, and nothing tells whether their owner lives. So every
start of Snakemake holds beside them a shared lock of the kernel, which ends with the process however that dies. Who can
have this lock alone knows that nobody else is at work, and that any lock of Snakemake's is a dead one's.
"""

from __future__ import annotations

import fcntl
from pathlib import Path
from typing import IO, NamedTuple

from roughslip.errors import InputError

_held: list[IO[str]] = []  # open as long as the process lives


class Start(NamedTuple):
    """alone : whether no other Snakemake is at work in the folder; lines : what to tell the user"""

    alone: bool
    lines: list[str]


def hold(state: Path) -> Start:
    """Be known in the folder until this process ends, and clear the lock of a run that is gone.

    state : Snakemake's folder
    On a file system without locks Snakemake's own decides, and after a crash `snakemake --unlock` is needed. Raises
    InputError where the folder cannot be written to.
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
        alone = True
    except BlockingIOError:
        alone = False
    except OSError:
        return Start(not locks, [])
    lines = []
    if alone:
        for lock in locks:
            lock.unlink(missing_ok=True)
        if locks:
            lines = [f"{state / 'locks'}: left by a run that was killed, as nothing is at work here; cleared"]
    elif locks:
        lines = [f"{state.resolve().parent}: another run is at work here; wait for it, or stop it"]
    else:
        lines = [f"{state.resolve().parent}: another snakemake looks at this folder; results were not checked"]
    fcntl.flock(file, fcntl.LOCK_SH)
    return Start(alone, lines)
