"""What every start does first: recover from an interrupted run, check packages, warn, write key files."""

from __future__ import annotations

from pathlib import Path

from workflow.keys import code_hash, key_files
from workflow.recovery import earlier_runs, integrity, snakemake_metadata
from workflow.study.scenes import Scenes
from workflow.study.sharing import Taken, taken

STATE = Path(".snakemake")
JOINT_FOLDERS = ("", "evidence", "benchmarks")  # below results, of what belongs to several scenes


def recover(scenes: Scenes) -> tuple[list[str], dict[str, Taken]]:
    """Clear what an earlier run left, and check the results of the scenes asked for.

    Returns lines for the user, and by scene what it takes from others.

    A dry run changes nothing outside .snakemake, and nothing is changed while another run is at work. Raises InputError
    where the folder cannot be written to, and where jobs of an earlier run are queued.
    """
    lines = code_hash.report((scenes.root / "requirements.lock").read_text(encoding="utf-8"))
    is_alone, found = earlier_runs.hold(STATE)
    lines += found
    if not is_alone:
        return lines, {}
    lines += [f"{name}: warning: {text}" for name in scenes.asked for text in scenes.warnings(name)]
    lines += snakemake_metadata.remove_damaged(STATE)
    if not key_files.is_dry_run():
        earlier_runs.refuse_queued_jobs(STATE)
        scans = [Path(scenes.scan_file(name)) for name in scenes.asked if "scan" in scenes.stages(name)]
        integrity.remove_leftovers(Path("results"), scans)
    scenes.write_keys()
    jobs = integrity.jobs_of(
        [*_joint_records(), *(record for name in scenes.asked for record in scenes.all_records(name))]
    )
    lines += integrity.announce(jobs) if key_files.is_dry_run() else integrity.repair(jobs, STATE)
    return lines, taken(scenes, jobs)


def _joint_records() -> list[str]:
    """Records of what belongs to several scenes: the joint page, comparisons, figures of benchmarks."""
    found = [file for folder in JOINT_FOLDERS for file in Path("results", folder, "usage").glob("*.json")]
    return [file.as_posix() for file in sorted(found)]
