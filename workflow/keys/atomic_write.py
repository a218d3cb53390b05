"""Write text files of the workflow whole; the store of the package does so too, but imports numpy and netCDF4."""

from __future__ import annotations

import os
import uuid
from pathlib import Path


def write_if_changed(path: Path, text: str) -> None:
    """Write a file if it is missing or holds another text; an equal file keeps its time.

    Other processes read the old file or the new one, whole. Raises OSError.
    """
    if path.is_file() and path.read_bytes() == text.encode():
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.name}.{uuid.uuid4().hex}")
    try:
        partial.write_bytes(text.encode())
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
