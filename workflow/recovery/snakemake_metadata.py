"""Snakemake's own records of its jobs, a file an output in .snakemake/metadata, where they would lead a run astray.

One that is damaged ends every later run in a traceback. One of another run than that which left the result, as where
results are put back from a copy, lets what differs from what the result was made from pass for unchanged.
"""

from __future__ import annotations

import json
from base64 import urlsafe_b64encode
from collections.abc import Iterable, Mapping
from pathlib import Path

from snakemake.persistence import MetadataRecord


def settle(state: Path) -> list[str]:
    """Take damaged records out of Snakemake's folder; lines that tell of them. Only while no other run is at work.

    What is marked as half finished stays so: such a mark may be empty.
    """
    lines = []
    for file in sorted((state / "metadata").rglob("*")):
        if file.is_file() and _read(file) is None:
            file.unlink()
            lines.append(f"{file}: damaged; removed, and Snakemake goes by the times of its files")
    for mark in sorted((state / "incomplete").rglob("*")):
        if mark.is_file() and not _is_object(mark):
            mark.write_text("", encoding="utf-8")
    return lines


def forget(state: Path, outputs: Iterable[str], changed: Mapping[str, str]) -> None:
    """Remove the records of outputs of which they say that they were made from what is there now.

    changed : by input the checksum that it has now, of inputs that the outputs were not made from
    """
    now = {name: f"sha256:{checksum}" for name, checksum in changed.items()}
    for output in outputs:
        file = state / "metadata" / urlsafe_b64encode(output.encode()).decode()
        record = _read(file) if file.is_file() else None
        if record and record.input_checksums and now.items() & record.input_checksums.items():
            file.unlink()


def _read(file: Path) -> MetadataRecord | None:
    """A record; None where it is damaged."""
    try:
        return MetadataRecord.model_validate(json.loads(file.read_text(encoding="utf-8")))
    except ValueError:  # of the text, of JSON, or of what Snakemake expects in it
        return None


def _is_object(file: Path) -> bool:
    try:
        return isinstance(json.loads(file.read_text(encoding="utf-8") or "{}"), dict)
    except ValueError:
        return False
