"""roughslip: from rough surfaces to the scatter of friction and of stick-slip vibration."""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path

__version__ = "0.1.0"
_PREFIX = "roughslip-"


def _numba_cache() -> Path:
    """Folder of the compiled functions of exactly this source.

    numba notices an edit in a function's own file only: a compiled function that calls one in another file goes stale
    without a word. So the folder is named by a hash of the whole package: in the project's .cache where the package
    runs from its project, else in the user's cache, else in the working folder: the first that can be written to.
    """
    source = Path(__file__).resolve().parent
    digest = hashlib.blake2b(digest_size=10)
    for file in sorted(source.rglob("*.py")):
        digest.update(file.relative_to(source).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    project = source.parents[1]
    user = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA") or os.path.expanduser("~/.cache")
    caches = [Path(user) / "roughslip", Path.cwd() / ".cache"]
    if (project / "pyproject.toml").is_file():
        caches.insert(0, project / ".cache")
    cache = next((folder for folder in caches if _writable(folder)), caches[-1])
    return cache / "numba" / f"{_PREFIX}{digest.hexdigest()}"


def _writable(folder: Path) -> bool:
    """Whether a folder can be written to, or made."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return folder.is_dir() and os.access(folder, os.W_OK)


# A folder that a parent process chose is chosen anew, because the source may have changed since; a user's own is kept.
if os.path.basename(os.environ.get("NUMBA_CACHE_DIR") or _PREFIX).startswith(_PREFIX):
    os.environ["NUMBA_CACHE_DIR"] = str(_numba_cache())
    if "numba" in sys.modules:  # it read the environment when it was imported
        sys.modules["numba"].config.reload_config()
