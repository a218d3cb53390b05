"""How many jobs the batches of a scene come to."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from roughslip.scene.declarations import declarations
from roughslip.scene.roughness import Mistake
from roughslip.scene.strict_yaml import shown

MOST_JOBS = 2000  # of one total: Snakemake plans each of them, and each takes a second or two to start


def mistakes(scene: dict[str, Any]) -> Iterator[Mistake]:
    """Batches so small that a stage has too many jobs; what the schema refuses is left to it."""
    for batches in (stage.batches for stage in declarations().values() if stage.batches):
        key = batches.size.partition(".")[2]
        size = scene["batches"].get(key)
        for total in batches.totals.values():
            section, name = total.split(".")
            count = scene[section].get(name) if isinstance(scene.get(section), dict) else None
            if isinstance(size, int) and isinstance(count, int) and count > MOST_JOBS * size:
                text = f"{shown(size)} is not allowed; enough that {total} = {count} takes at most {MOST_JOBS} jobs"
                yield Mistake((f"batches.{key}", total), text)
