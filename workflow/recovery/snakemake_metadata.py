"""Remove damaged records of Snakemake, and those that contradict the records of the jobs.

Snakemake keeps a JSON file for each output in .snakemake/metadata. A damaged one ends each later run in a traceback.
One of another run than that which left the result, as after results are put back from a copy, hides a change.
"""

from __future__ import annotations

import json
from base64 import urlsafe_b64encode
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

SHARED = ".shared"  # ends the name of a rule that takes results from other scenes


def remove_damaged(state: Path) -> list[str]:
    """Remove damaged records from Snakemake's folder; lines for the user. Only while no other run is at work.

    What is marked as incomplete stays so: such a mark may be empty. The records of results that scenes share are
    removed too: they name another rule than that of the stage, which would run it again.
    """
    lines = []
    for file in filter(Path.is_file, sorted((state / "metadata").rglob("*"))):
        content = _read(file)
        if not content or str(content.get("rule")).endswith(SHARED):
            file.unlink()
        if not content:
            lines.append(f"{file}: damaged record of Snakemake; removed, file times decide what runs again")
    for mark in sorted((state / "incomplete").rglob("*")):
        if mark.is_file() and mark.stat().st_size and _read(mark) is None:
            mark.write_text("", encoding="utf-8")
    return lines


def forget(state: Path, outputs: Iterable[str], changed: Mapping[str, str]) -> None:
    """Remove the records of outputs that name the present content of a changed input as what they were made from.

    changed : by input its present checksum, of inputs that the outputs were not made from
    """
    now = {name: f"sha256:{checksum}" for name, checksum in changed.items()}
    for output in outputs:
        file = state / "metadata" / urlsafe_b64encode(output.encode()).decode()
        record = _read(file) if file.is_file() else None
        if record and now.items() & (record.get("input_checksums") or {}).items():
            file.unlink()


def _read(file: Path) -> dict[str, Any] | None:
    """A record; None where the file is damaged. Snakemake can read a record with another text or number in it."""
    try:
        record = json.loads(file.read_text(encoding="utf-8"))
    except ValueError:
        return None
    return record if isinstance(record, dict) and isinstance(record.get("input_checksums", {}), dict | None) else None
