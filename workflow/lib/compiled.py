"""What numba compiled, looked at before it is used: numba itself believes any file, and a flipped bit computes.

The folder is that of exactly this source (roughslip/__init__.py). Beside its files stands a list of what the last start
found: a file whose content has changed and whose time has not was damaged. So was one that does not end as it should,
as after a loss of power.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path

from roughslip import PREFIX
from roughslip.stages.record import checksum
from workflow.lib.whole import write_if_changed

_LIST = "found.json"
_END = b"."  # of a pickle


def settle(folder: Path) -> list[str]:
    """Remove the folder where one of its files is damaged, to be compiled anew, and tell so. Only while nothing runs.

    A folder that a user chose for all that numba compiles is left alone.
    """
    if not folder.name.startswith(PREFIX):
        return []
    found = {file.relative_to(folder).as_posix(): _state(file) for file in sorted(folder.rglob("*.nb[ci]"))}
    if not found:
        return []
    before = _listed(folder / _LIST)
    damaged = [
        name
        for name, (changed, content) in found.items()
        if not content or (before.get(name, [changed, content]) != [changed, content] and before[name][0] == changed)
    ]
    if damaged:
        shutil.rmtree(folder)
        return [f"{folder / damaged[0]}: damaged; what numba compiled is removed, and compiled anew"]
    write_if_changed(folder / _LIST, json.dumps(found))
    return []


def _state(file: Path) -> list:
    """Time and checksum of a file, without a checksum where it is cut short."""
    content = file.read_bytes()
    return [file.stat().st_mtime_ns, checksum(file) if content.endswith(_END) else ""]


def _listed(file: Path) -> dict[str, list]:
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        return {name: [changed, content] for name, (changed, content) in found.items()}
    except (OSError, ValueError, TypeError, AttributeError):
        return {}  # none yet, or damaged itself: then what is there is what counts
