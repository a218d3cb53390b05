"""What every start of Snakemake does first: lock and jobs of a dead run and damaged results are out of the way."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from roughslip.errors import InputError
from workflow.lib import integrity, orphans, run_lock
from workflow.lib.scenes import Scenes


def settle(scenes: Scenes) -> list[str]:
    """Clear what an earlier run left, and check results of the scenes asked for; lines that tell the user.

    Nothing is touched while another run is at work. Raises InputError where the folder or one of results cannot be
    written to, and where jobs of a dead run are in the queue of a cluster.
    """
    alone, lines = run_lock.hold()
    if not alone:
        return lines
    orphans.refuse(Path())
    refuse_read_only(scenes.asked)
    scans = [Path(scenes.scan_file(name)) for name in scenes.asked if "scan" in scenes.stages(name)]
    integrity.tidy(Path("results"), scans)
    return lines + integrity.settle(record for name in scenes.asked for record in scenes.all_records(name))


def refuse_read_only(names: Iterable[str], results: Path = Path("results")) -> None:
    """Snakemake would end with a traceback where it is to remove what it makes anew.

    names : of scenes. Raises InputError with a line for each folder of theirs that is not to be written to.
    """
    folders = [results, *(folder for name in names for folder in [results / name, *(results / name).rglob("*/")])]
    closed = [folder for folder in folders if folder.is_dir() and not os.access(folder, os.W_OK | os.X_OK)]
    if closed:
        raise InputError([f"{folder}: cannot be written to; allow it with: chmod u+rwx {folder}" for folder in closed])
