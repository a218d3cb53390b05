"""Checksums of what a job read and wrote, kept in its record of cost, and the seal of the record itself.

With them a later run finds a damaged result, and one that was made from other inputs, at any times of the files. Every
start of Snakemake imports this module, so it imports little.
"""

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

SEAL = "checksum"


def checksum(path: Path) -> str:
    """SHA-256 of the bytes of a file."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def checksums(paths: Iterable[Path]) -> dict[str, str]:
    """Checksums by path; what is no file is left out."""
    return {path.as_posix(): checksum(path) for path in sorted(set(paths)) if path.is_file()}


def sealed(record: dict[str, Any]) -> dict[str, Any]:
    """The record with a checksum of itself."""
    return {**record, SEAL: _seal(record)}


def read(path: Path) -> dict[str, Any] | None:
    """A sealed record; None where the file is damaged or is none. Raises FileNotFoundError where there is no file."""
    try:
        record = json.loads(Path(path).read_text(encoding="utf-8"))
    except ValueError:
        return None
    if not isinstance(record, dict):
        return None
    seal = record.pop(SEAL, None)
    return record if seal == _seal(record) else None


def _seal(record: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()
