"""Results against the records of the jobs that made them, before Snakemake looks at time stamps.

A result that is not what its job wrote is set aside, so that it is made again. One that was made from something else
than what is there now has that touched, and Snakemake's record of it removed where that says otherwise, so that
Snakemake sees the change even where times of files are in disorder, its own records are gone, or the result was put
back from a copy. Nothing is lost by either, not in a dry run and not where an edit is taken back.
"""

from __future__ import annotations

import contextlib
import os
import re
import time
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from roughslip.stages.runtime import record
from workflow.recovery import snakemake_metadata

DAMAGED = ".damaged"  # what is added to the name of a file that is set aside
_TEMPORARY = re.compile(r"\..+\.(\d+|[0-9a-f]{32})(\.\w+)?")  # a name, and the process or the chance that wrote it
_TEMPORARY_SECONDS = 3600.0  # after which the temporary file of a job is that of a dead one


def settle(records: Iterable[str], state: Path = Path(".snakemake")) -> list[str]:
    """Set aside what is damaged and touch what has changed; lines that tell what was set aside.

    records : records of cost, whether they exist or not
    state : Snakemake's folder

    Key files must be those of now.
    """
    lines: list[str] = []
    sound: list[tuple[Path, Mapping[str, dict[str, str]]]] = []
    for path in map(Path, records):
        if path.is_file():
            found = record.read(path)
            if found is None or not _is_of(path, found):
                lines.append(f"{path}: damaged; its job runs again")
                path.unlink()
            elif found["made"]:
                sound.append((path, {"made": found["made"], "read": found["read"]}))
    now = cache(record.checksum)
    for path, found in sound:
        lost = [Path(name) for name in found["made"] if not Path(name).is_file()]
        damaged = [Path(name) for name, was in found["made"].items() if Path(name) not in lost and now(name) != was]
        for one in damaged:
            os.replace(one, f"{one}{DAMAGED}")
            lines.append(f"{one}: not what its job wrote; set aside as {one.name}{DAMAGED}, and made again")
        if lost or damaged:
            path.unlink()
    for path, found in sound:
        if path.is_file():
            _make_seen(found, now, state)
    return lines


def tidy(folder: Path, others: Iterable[Path] = ()) -> None:
    """Remove temporary files that dead jobs left in a folder of results, and bring files out of the future.

    others : files that jobs read from elsewhere

    Only while no other run is at work. Snakemake fails a job whose input is newer than what it has just made.
    """
    now = time.time()
    for path in (*folder.rglob("*"), *others):
        with contextlib.suppress(PermissionError, FileNotFoundError):  # of another user, or gone meanwhile
            changed = path.stat().st_mtime if path.is_file() else now
            if _TEMPORARY.fullmatch(path.name) and changed < now - _TEMPORARY_SECONDS:
                path.unlink()
            elif changed > now:
                os.utime(path, (now - 1.0, now - 1.0))


def _is_of(path: Path, found: Mapping[str, Any]) -> bool:
    """Whether a record tells of results beside it: a stranger's, or a copy of another scene's, may name any file."""
    if not all(isinstance(found.get(part), dict) for part in ("read", "made")):
        return False
    folder = str(Path(os.path.realpath(path)).parents[1])
    return all(os.path.commonpath([os.path.realpath(name), folder]) == folder for name in found["made"])


def _make_seen(found: Mapping[str, dict[str, str]], now: Callable[[str], str], state: Path) -> None:
    """Let Snakemake see the inputs that changed since the results were made, newer than the oldest of them."""
    there = {name: now(name) for name in found["read"] if Path(name).is_file()}
    changed = {name: is_now for name, is_now in there.items() if is_now != found["read"][name] and _is_ours(name)}
    snakemake_metadata.forget(state, found["made"], changed)
    oldest = min(Path(name).stat().st_mtime for name in found["made"])
    for name in changed:
        if Path(name).stat().st_mtime <= oldest:
            os.utime(name)


def _is_ours(name: str) -> bool:
    """Whether a changed file is one of this folder or of its results, wherever these lie."""
    real = os.path.realpath(name)
    return any(os.path.commonpath([real, folder]) == folder for folder in map(os.path.realpath, (".", "results")))
