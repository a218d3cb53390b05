"""Hash the code of a stage: the import closure of its module, and the packages that it runs on."""

from __future__ import annotations

import hashlib
from pathlib import Path

from roughslip.compilation.source_hash import closure_hash
from workflow.keys.environment_check import departures

# The values of a scene are in the slice of a stage, and the classes of its sections only hold them.
_SCENE = "roughslip.scene"


def code_hash(module_name: str, source_root: str | Path, lock: str | Path) -> str:
    """SHA-256 of what the closure of a module does, of the locked packages, and of packages that differ from the lock.

    Comments, docstrings, layout and the Python version do not change it. A file that moves changes it.
    """
    digest = hashlib.sha256(closure_hash(module_name, Path(source_root), without=_SCENE).encode())
    locked = Path(lock).read_text(encoding="utf-8")
    pins = (line.strip() for line in locked.splitlines())
    digest.update(
        "\n".join([*(line for line in pins if line and not line.startswith("#")), *departures(locked)]).encode()
    )
    return digest.hexdigest()
