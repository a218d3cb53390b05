"""What every start of Snakemake does first: lock and jobs of a dead run and damaged results are out of the way."""

from __future__ import annotations

from pathlib import Path

from workflow.keys import environment_check
from workflow.recovery import integrity, run_lock, slurm_orphans, snakemake_metadata
from workflow.study.scenes import Scenes

STATE = Path(".snakemake")
BESIDE = ("", "evidence", "benchmarks")  # folders of results beside those of scenes


def settle(scenes: Scenes) -> list[str]:
    """Clear what an earlier run left, and check results of the scenes asked for; lines that tell the user.

    Nothing is touched while another run is at work. Raises InputError where the folder cannot be written to, and
    where jobs of a dead run are in the queue of a cluster.
    """
    lines = environment_check.told((scenes.root / "requirements.lock").read_text(encoding="utf-8"))
    alone, found = run_lock.hold(STATE)
    lines += found
    if not alone:
        return lines
    slurm_orphans.refuse(Path())
    scans = [Path(scenes.scan_file(name)) for name in scenes.asked if "scan" in scenes.stages(name)]
    integrity.tidy(Path("results"), scans)
    scenes.write_keys()
    records = [*_beside_scenes(), *(record for name in scenes.asked for record in scenes.all_records(name))]
    return lines + snakemake_metadata.settle(STATE) + integrity.settle(records, STATE)


def _beside_scenes() -> list[str]:
    """Records of what belongs to no scene alone: the joint page, comparisons, figures of benchmarks."""
    found = [file for folder in BESIDE for file in Path("results", folder, "usage").glob("*.json")]
    return [file.as_posix() for file in sorted(found)]
