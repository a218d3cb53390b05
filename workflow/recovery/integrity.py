"""Compare results with the checksums that their jobs recorded, before Snakemake compares file times.

A damaged result is moved away, so that its job runs again. Where an input changed after a result was made, but file
times or Snakemake's own records hide it, the input gets a new time. So a run is right even if times are in disorder,
the folder .snakemake is gone, or results were put back from a copy. An edit that is taken back makes no job run again.
"""

from __future__ import annotations

import contextlib
import os
import re
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

from roughslip.stages.runtime import record
from workflow.keys import key_files
from workflow.recovery import snakemake_metadata

DAMAGED = ".damaged"  # appended to the name of a file that is moved away
_TEMPORARY = re.compile(r"\..+\.(\d+|[0-9a-f]{32})(\.\w+)?")  # a name, and the process or the chance that wrote it
_TEMPORARY_SECONDS = 3600.0  # after which no job still writes a temporary file


@dataclass(frozen=True)
class Job:
    """A job that has run, and what became of its files.

    record : its record of cost, with the checksums of what it read and made
    is_readable : whether the record is whole and about results of its own scene
    made : its results
    damaged : those that differ from what it wrote
    is_complete : whether all results exist
    read : by input the checksum of what it read
    changed : by name the present checksum of inputs that differ from what it read
    """

    record: Path
    is_readable: bool = True
    made: tuple[str, ...] = ()
    damaged: tuple[str, ...] = ()
    is_complete: bool = True
    read: Mapping[str, str] = field(default_factory=dict)
    changed: Mapping[str, str] | None = None

    def is_up_to_date(self) -> bool:
        """Whether the results are what the job would make of its present inputs."""
        return self.is_readable and self.is_complete and not self.damaged and not self.changed


def jobs_of(records: Iterable[str]) -> list[Job]:
    """Compare what is on disk with the records that exist; key files must be written, or drafts in a dry run."""
    checksum = cache(lambda name: record.checksum(key_files.content_of(name)))
    found: list[Job] = []
    for path in map(Path, records):
        if path.is_file():
            content = record.read(path)
            if content is None or not _is_about_its_scene(path, content):
                found.append(Job(path, is_readable=False))
            elif content["made"]:
                found.append(_compare(path, content, checksum))
    return found


def repair(jobs: Iterable[Job], state: Path = Path(".snakemake")) -> list[str]:
    """Make Snakemake repeat the jobs that are not up to date, and no others; lines for the user.

    state : Snakemake's folder
    """
    lines: list[str] = []
    kept = []
    for job in jobs:
        for name in job.damaged:
            os.replace(name, f"{name}{DAMAGED}")
            lines.append(f"checksum mismatch: {name}; moved to {Path(name).name}{DAMAGED} and rebuilt")
        if not job.is_readable:
            lines.append(f"checksum mismatch: {job.record}; removed, its job runs again")
        if job.is_readable and job.is_complete and not job.damaged:
            kept.append(job)
        else:
            job.record.unlink()
    for job in kept:
        changed = {name: value for name, value in (job.changed or {}).items() if Path(name).is_file()}
        snakemake_metadata.forget(state, job.made, changed)
        for name in changed:
            if Path(name).stat().st_mtime_ns <= _oldest_time(job):
                os.utime(name)
    _restore_key_times(kept)
    _restore_result_times(job for job in kept if not job.changed)
    return lines


def announce(jobs: Iterable[Job]) -> list[str]:
    """The same for a dry run, which changes no file: it plans the jobs that a run would repeat."""
    jobs = list(jobs)
    up_to_date = {job.record.as_posix() for job in jobs if job.is_up_to_date()}
    key_files.expect(up_to_date, {job.record.as_posix() for job in jobs} - up_to_date)
    damaged = [*(name for job in jobs for name in job.damaged), *(job.record for job in jobs if not job.is_readable)]
    return [f"checksum mismatch: {name}; a run rebuilds it" for name in damaged]


def remove_leftovers(folder: Path, others: Iterable[Path] = ()) -> None:
    """Remove temporary files of dead jobs from a folder of results, and correct file times in the future.

    others : files that jobs read from elsewhere

    Only while no other run is at work. Snakemake fails a job whose input is newer than what the job has just made.
    """
    now = time.time()
    for path in (*folder.rglob("*"), *others):
        with contextlib.suppress(PermissionError, FileNotFoundError):  # of another user, or removed meanwhile
            changed = path.stat().st_mtime if path.is_file() else now
            if _TEMPORARY.fullmatch(path.name) and changed < now - _TEMPORARY_SECONDS:
                path.unlink()
            elif changed > now:
                os.utime(path, (now - 1.0, now - 1.0))


def _compare(path: Path, content: Mapping[str, Any], checksum: Any) -> Job:
    made, read = content["made"], content["read"]
    there = [name for name in made if Path(name).is_file()]
    present = {name: checksum(name) for name in read if key_files.content_of(name).is_file() and _is_ours(name)}
    return Job(
        path,
        made=tuple(made),
        damaged=tuple(name for name in there if checksum(name) != made[name]),
        is_complete=len(there) == len(made),
        read=read,
        changed={name: value for name, value in present.items() if value != read[name]},
    )


def _is_about_its_scene(path: Path, content: Mapping[str, Any]) -> bool:
    """Whether a record names results of its own scene only; a copied or a foreign one may name any file."""
    if not all(isinstance(content.get(part), dict) for part in ("read", "made")):
        return False
    folder = str(Path(os.path.realpath(path)).parents[1])
    return all(os.path.commonpath([os.path.realpath(name), folder]) == folder for name in content["made"])


def _is_ours(name: str) -> bool:
    """Whether a file belongs to this folder or to its results, which may be a link."""
    real = os.path.realpath(name)
    return any(os.path.commonpath([real, folder]) == folder for folder in map(os.path.realpath, (".", "results")))


def _oldest_time(job: Job) -> int:
    return min(Path(name).stat().st_mtime_ns for name in job.made)


def _restore_key_times(jobs: Iterable[Job]) -> None:
    """Make a key file whose content has returned no newer than the results that were made from it."""
    oldest: dict[str, int] = {}
    changed: set[str] = set()
    for job in jobs:
        changed.update(job.changed or ())
        for name in job.read:
            if Path(name).parent.name == "keys" and Path(name).is_file():
                oldest[name] = min(oldest.get(name, _oldest_time(job)), _oldest_time(job))
    for name in oldest.keys() - changed:
        if Path(name).stat().st_mtime_ns > oldest[name]:
            os.utime(name, ns=(oldest[name], oldest[name]))


def _restore_result_times(jobs: Iterable[Job]) -> None:
    """Make results no older than the unchanged inputs that they were made from, from the first job to the last.

    Without its own records Snakemake compares times, and results that scenes share have one time in all of them.
    """
    by_file = {name: job for job in jobs for name in (*job.made, job.record.as_posix())}
    by_record = {job.record: job for job in by_file.values()}
    graph = {job.record: {by_file[name].record for name in job.read if name in by_file} for job in by_record.values()}
    for job in map(by_record.__getitem__, TopologicalSorter(graph).static_order()):
        newest = max((Path(name).stat().st_mtime_ns for name in job.read if Path(name).is_file()), default=0)
        for path in (*map(Path, job.made), job.record):
            if path.stat().st_mtime_ns < newest:
                os.utime(path, ns=(newest, newest))
