"""What the rules take from the rows of the graph: inputs, outputs, commands, logs and memory of jobs.

Input functions say what a job waits for, given what is in the store and where people open it.
"""

import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from snakemake.io import report

from roughslip.study import is_whole
from roughslip.study.graph import STAGES
from workflow.keys import STORE, Entry, Names
from workflow.study.publish import LISTED, is_current, is_published

NODE_MB = 400  # of the two Snakemakes that start a job on a node of a cluster
MORE = 4  # times the memory at each further attempt: the largest meshes take some six times what a stage declares


@dataclass(frozen=True)
class Inputs:
    """Input functions of the rules.

    newest : a file that is newer than results. A job that has to run although a result may be there gets it as one
        more input, because Snakemake compares times
    shows_all : whether a job that has ended has inputs too, for graphs of the study
    clears : whether what such a job left is removed, as file times may be in disorder. False in a dry run, and where
        another run is at work in the folder
    """

    names: Names
    newest: str
    shows_all: bool
    clears: bool

    def of_stage(self, stage: str) -> Callable[[Any], list[str]]:
        """What a job of a stage waits for: nothing once it has ended, because its results are what their name says.

        A job whose record is missing, or whose files were lost or cut short, has not ended.
        """
        row = STAGES[stage]

        def awaited(wildcards: Any) -> list[str]:
            entry, values = self.entry(stage, wildcards), {name: wildcards[name] for name in row.placeholders}
            record = Path(entry.folder, "usage", f"{row.job_name(**values)}.json")
            files = [Path(entry.folder, file.format(**values)) for file in row.results.values() if file]
            return self._waits(entry.awaited, is_whole(record), record, *files)

        return awaited

    def entry(self, stage: str, wildcards: Any) -> Entry:
        """The entry of a job of a stage."""
        return self.names.at(f"{STORE}/{stage}/{wildcards.key}")

    def of_scene(self, wildcards: Any) -> list[str]:
        """What the published files of a scene wait for: nothing where all jobs have ended and all files are there.

        A file that was lost or saved over is published again.
        """
        folder, records = Path("results", wildcards.scene), self.names.awaited(wildcards.scene)
        ended = not _not_ended(records) and is_published(folder, self.names.published(wildcards.scene))
        return self._waits(records, ended, folder / LISTED)

    def of_file(self, path: str, source: str, records: Sequence[str]) -> list[str]:
        """The same of one published file. records : of the jobs that make it"""
        return self._waits(records, not _not_ended(records) and is_current(path, source), Path(path))

    def of_scene_file(self, wildcards: Any) -> list[str]:
        """The same of one file of a scene."""
        path = f"results/{wildcards.scene}/{wildcards.file}"
        return self.of_file(path, *self.names.file(wildcards.scene, wildcards.file))

    def of_joint_page(self, folder: str) -> list[str]:
        """The same of the page on several scenes. folder : its folder in the store"""
        return self.of_file("results/report.html", f"{folder}/report.html", [f"{folder}/usage/joint_page.json"])

    def _waits(self, records: Sequence[str], has_ended: bool, *files: Path) -> list[str]:
        """The records that a job waits for. files : what it makes, which is removed where it has not ended"""
        if self.shows_all:
            return list(records)
        if has_ended:
            return []
        for file in files if self.clears else ():
            file.unlink(missing_ok=True)
        return [*_not_ended(records), self.newest]


def _not_ended(records: Sequence[str]) -> list[str]:
    """Those of jobs that have not ended. The others are no inputs: their times may lie in the future."""
    return [record for record in records if not is_whole(Path(record))]


def command(stage: str) -> str:
    """The shell command of a stage, without its log. Its key file says which files it reads and writes.

    With `exec` the stage is a child of Snakemake itself and ends with it.
    """
    options = " ".join(f"--{name} {{wildcards.{name}}}" for name in STAGES[stage].placeholders)
    key = f"{STORE}/{stage}/{{wildcards.key}}/key.json"
    return f'exec "$ROUGHSLIP_PYTHON" -m roughslip.study --key {key} {options}'.rstrip()


def outputs(stage: str, category: Any) -> dict[str, Any]:
    """Files that a stage writes, by name, and its record of cost. A page also goes to Snakemake's report.

    category : function of the wildcards, for the report

    Figures differ from scene to scene, and stand in the record alone.
    """
    row, folder = STAGES[stage], f"{STORE}/{stage}/{{key}}"
    files: dict[str, Any] = {name: f"{folder}/{file}" for name, file in row.results.items() if file}
    if stage == "page":
        files["output"] = report(files["output"], category=category)
    return files | {"usage": f"{folder}/usage/{row.job_name()}.json"}


def log(stage: str) -> str:
    """The log of a job."""
    return f"{STORE}/{stage}/{{key}}/logs/{STAGES[stage].job_name()}.log"


def asked_mb(stage: str, attempt: int, of_a_node: int | None) -> int:
    """Megabytes that a job asks for. of_a_node : what a node of a cluster gives to a job; None on this machine"""
    needed = STAGES[stage].memory_mb + (NODE_MB if of_a_node else 0)
    return min(needed * MORE ** (attempt - 1), of_a_node or sys.maxsize)


def machine_mb() -> int:
    """Megabytes of this machine, or of its control group where that is less."""
    limits = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    for file in map(Path, ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")):
        if file.is_file() and (text := file.read_text(encoding="ascii").strip()).isdigit():
            limits.append(int(text))
    return min(limits) // 1_000_000
