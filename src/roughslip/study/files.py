"""Files that jobs make: their checksums, and whether a job has ended. Each start of Snakemake imports this."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any


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
