"""What numba compiled, looked at before it is used: numba itself believes any file, and a flipped bit computes.

The folder is that of exactly this source (roughslip/__init__.py). Beside its files stands a list of what the last start
found: a file whose content has changed and whose time has not was damaged. So was one that does not end as it should,
as after a loss of power.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import re
from pathlib import Path

from roughslip.errors import InputError
from workflow.keys.atomic_write import write_if_changed

_LIST = "found.json"
_END = b"."  # of a pickle
_FUNCTION = re.compile(r"(.*?)(\.\d+\.nbc|\.nbi)")  # its index, and what was compiled for each signature


def settle(folder: Path) -> list[str]:
    """Remove all of a function of which a file is damaged, to be compiled anew; lines that tell of it.

    Only while no other run is at work. Raises InputError where such a file cannot be removed.
    """
    found = {file.relative_to(folder).as_posix(): _state(file) for file in sorted(folder.rglob("*.nb[ci]"))}
    before = _listed(folder / _LIST)
    damaged = [
        name
        for name, (changed, content) in found.items()
        if not content or (name in before and before[name][0] == changed and before[name][1] != content)
    ]
    gone = {_function(name) for name in damaged}
    for name in [name for name in found if _function(name) in gone]:
        try:
            (folder / name).unlink(missing_ok=True)
        except OSError as error:
            raise InputError(f"{folder / name}: damaged, and cannot be removed ({error.strerror})") from None
        del found[name]
    if found:
        with contextlib.suppress(OSError):  # a user's own folder may be closed to writing; then there is no list
            write_if_changed(folder / _LIST, json.dumps(found))
    return [f"{folder / name}: damaged; removed, and compiled anew" for name in damaged]


def _function(name: str) -> str:
    match = _FUNCTION.fullmatch(name)
    return match[1] if match else name


def _state(file: Path) -> list:
    """Time and checksum of a file, without a checksum where it is cut short."""
    content = file.read_bytes()
    return [file.stat().st_mtime_ns, hashlib.sha256(content).hexdigest() if content.endswith(_END) else ""]


def _listed(file: Path) -> dict[str, list]:
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        return {name: [changed, content] for name, (changed, content) in found.items()}
    except (OSError, ValueError, TypeError, AttributeError):
        return {}  # none yet, or damaged itself: then what is there is what counts
