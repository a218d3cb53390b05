"""What every stage of the scene cost, did, left out and warned of; which did not run."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any


def total(
    records: list[dict[str, Any]], not_needed: Mapping[str, str], warnings: Sequence[str] = ()
) -> list[dict[str, Any]]:
    """A row a stage, in the order of their names, and a last row for the whole scene.

    not_needed : stages that did not run, and why; they stand in the last row
    warnings : on the scene itself, which the last row shows before those of the stages

    Seconds and counts add up over the jobs; peak memory is that of the largest job.
    """
    stages = sorted({record["stage"] for record in records})
    rows = [_sum(stage, [record for record in records if record["stage"] == stage]) for stage in stages]
    of_stages = (f"{row['stage']}: {text}" for row in rows for text in row["warnings"])
    last = {"warnings": [*warnings, *of_stages], "not_needed": dict(sorted(not_needed.items()))}
    return [*rows, _sum("all", records) | last]


def _sum(stage: str, records: list[dict[str, Any]]) -> dict[str, Any]:
    did: Counter[str] = Counter()
    skipped: Counter[str] = Counter()
    for record in records:
        did.update(record["did"])
        skipped.update(record["skipped"])
    seconds = {name: round(sum(record[name] for record in records), 3) for name in ("cpu_seconds", "wall_seconds")}
    return {
        "stage": stage,
        "jobs": len(records),
        **seconds,
        "peak_memory_mib": max((record["peak_memory_mib"] for record in records), default=0.0),
        "did": dict(sorted(did.items())),
        "skipped": dict(sorted(skipped.items())),
        "warnings": list(dict.fromkeys(text for record in records for text in record["warnings"])),
    }
