"""What every start of Snakemake does first: lock and jobs of a dead run and damaged results are out of the way."""

from __future__ import annotations

from pathlib import Path

from workflow.lib import integrity, orphans, run_lock
from workflow.lib.scenes import Scenes


def settle(scenes: Scenes) -> list[str]:
    """Clear what an earlier run left, and check results of the scenes asked for; lines that tell the user.

    Nothing is touched while another run is at work. Raises InputError where the folder cannot be written to, and
    where jobs of a dead run are in the queue of a cluster.
    """
    alone, lines = run_lock.hold()
    if not alone:
        return lines
    orphans.refuse(Path())
    scans = [Path(scenes.scan_file(name)) for name in scenes.asked if "scan" in scenes.stages(name)]
    integrity.tidy(Path("results"), scans)
    return lines + integrity.settle(record for name in scenes.asked for record in scenes.all_records(name))
