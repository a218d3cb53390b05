"""Which stages of a scene take the results of another scene instead of running.

A stage and all stages before it have equal slices and jobs in two scenes: then one computes and the other links the
files. Links are hard, so each scene holds its results whole, and the disk holds them once.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable
from functools import cache
from typing import NamedTuple

from roughslip.scene import plan
from roughslip.scene.declarations import declarations
from roughslip.stages.runtime.record import checksum
from workflow.keys import key_files
from workflow.recovery.integrity import Job, jobs_of
from workflow.study.scenes import Scenes


class Taken(NamedTuple):
    """What a scene takes from others.

    records : of the jobs that made the files
    made : the files and records that the scene gets, each after those that it was made from
    awaited : the files and records of jobs of this run; the others are on disk
    """

    records: list[str]
    made: list[str]
    awaited: list[str]


def taken(scenes: Scenes, jobs: Iterable[Job]) -> dict[str, Taken]:
    """What each scene that is asked for takes from others, where it takes anything.

    jobs : of the scenes asked for, compared with the disk

    A stage takes its results where its own are missing or out of date. The other scene has them on disk, or it is
    asked for in the same run and comes first.
    """
    known = {job.record.as_posix(): job for job in jobs}
    chain_key = chain_keys(scenes)

    @cache
    def is_made(owner: str, stage: str, asker: str) -> bool:
        """Whether the results of the owner are what the asker's stage would make; their chain keys must be equal."""
        key, records = f"results/{{}}/keys/{stage}.json", scenes.records(owner, stage)
        wanted = checksum(key_files.content_of(key.format(asker)))
        found = [job for record in records for job in ([known[record]] if record in known else jobs_of([record]))]
        return (
            len(found) == len(records)
            and all(job.is_up_to_date() and job.read.get(key.format(owner)) == wanted for job in found)
            and all(is_made(owner, one, asker) for one in plan.makers(stage, scenes.stages(owner)))
        )

    found: dict[str, Taken] = {}
    first: dict[str, str] = {}  # by chain key the scene of this run that computes the stage
    for name in scenes.asked:
        own = Taken([], [], [])
        for stage in filter(is_shared, plan.in_order(scenes.stages(name))):
            if is_made(name, stage, name):
                continue
            key = chain_key(name, stage)
            equal = [
                other for other in scenes.valid if stage in scenes.stages(other) and chain_key(other, stage) == key
            ]
            on_disk = [other for other in equal if other != name and is_made(other, stage, name)]
            other = on_disk[0] if on_disk else first.setdefault(key, name)
            if other != name:
                own.records.extend(scenes.records(other, stage))
                own.made.extend(scenes.files(name, stage))
                own.awaited.extend([] if on_disk else scenes.files(other, stage))
        if own.made:
            found[name] = own
    return found


def is_shared(stage: str) -> bool:
    """Whether scenes share the results of a stage: all but figures and what describes a scene."""
    return not (declarations()[stage].target or declarations()[stage].caption)


def chain_keys(scenes: Scenes) -> Callable[[str, str], str]:
    """A function of scene and stage: a hash of its part of the scene, of its jobs, and of the stages before it.

    The code is the same for all scenes of a run and has no part in it.
    """

    @cache
    def chain_key(name: str, stage: str) -> str:
        before = [chain_key(name, one) for one in plan.makers(stage, scenes.stages(name))]
        part = plan.slice_for(scenes[name], stage)
        return hashlib.sha256(json.dumps([part, scenes.jobs(name, stage), before], sort_keys=True).encode()).hexdigest()

    return chain_key
