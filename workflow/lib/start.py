"""What every start of Snakemake does first: the lock of a dead run and damaged results are out of the way."""

from __future__ import annotations

from pathlib import Path

from workflow.lib import integrity, run_lock
from workflow.lib.scenes import Scenes


def settle(scenes: Scenes) -> list[str]:
    """Clear what an earlier run left, and check results of the scenes asked for; lines that tell the user.

    Nothing is touched while another run is at work. Raises InputError where the folder cannot be written to.
    """
    alone, lines = run_lock.hold()
    if not alone:
        return lines
    scans = [Path(scenes.scan_file(name)) for name in scenes.asked if "scan" in scenes.stages(name)]
    integrity.tidy(Path("results"), scans)
    return lines + integrity.settle(record for name in scenes.asked for record in scenes.all_records(name))
