"""Text files of the workflow itself, written whole. The store of the package does so, too, but brings xarray along."""

from __future__ import annotations

import os
import uuid
from pathlib import Path


def write_if_changed(path: Path, text: str) -> None:
    """Write a file whole where it is not there or holds something else; an equal file keeps its time stamp.

    Safe beside other processes: readers see the old file or the new one. Raises OSError.
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
