"""The parts of a stage's rule that derive from its declaration: its command, inputs, outputs, log and memory.

Input functions say what a job waits for, given what is in the store and where people open it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from snakemake.io import report

from roughslip.scene.declarations import declarations
from roughslip.stages.runtime.usage import is_whole
from workflow.keys import STORE, Entry, Names
from workflow.study.publish import LISTED, is_current, is_published

CAPTION = "../report/caption.rst"  # from a file of rules
NODE_MB = 400  # of the two Snakemakes that start a job on a node of a cluster
MORE = 4  # times the memory at each further attempt: the largest meshes take some six times what a stage declares
Waits = Callable[[Any], list[str]]


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

    def of_stage(self, stage: str) -> Waits:
        """What a job of a stage waits for: nothing once it has ended, because its results are what their name says.

        A job whose record is missing, or whose files were lost or cut short, has not ended.
        """
        declared = declarations()[stage]

        def awaited(wildcards: Any) -> list[str]:
            entry, values = self.entry(stage, wildcards), {name: wildcards[name] for name in declared.placeholders}
            if self.shows_all:
                return entry.awaited
            record = Path(entry.folder, "usage", f"{declared.job_name(**values)}.json")
            if is_whole(record):
                return []
            self._clear(record, *(Path(entry.folder, file.format(**values)) for file in declared.results.values()))
            return [*_not_ended(entry.awaited), self.newest]

        return awaited

    def entry(self, stage: str, wildcards: Any) -> Entry:
        """The entry of a job of a stage."""
        return self.names.at(f"{STORE}/{stage}/{wildcards.key}")

    def of_scene(self, wildcards: Any) -> list[str]:
        """What the published files of a scene wait for: nothing where all jobs have ended and all files are there.

        A file that was lost or saved over is published again.
        """
        records = self.names.awaited(wildcards.scene)
        if self.shows_all:
            return records
        folder = Path("results", wildcards.scene)
        awaited = _not_ended(records)
        if not awaited and is_published(folder, self.names.published(wildcards.scene)):
            return []
        self._clear(folder / LISTED)
        return [*awaited, self.newest]

    def of_file(self, path: str, source: str) -> dict[str, str]:
        """The file of the store that stands at a path, and what is newer than all if another one is there."""
        if is_current(path, source):
            return {"source": source}
        self._clear(Path(path))
        return {"source": source, "newest": self.newest}

    def of_scene_file(self, wildcards: Any) -> dict[str, str]:
        """The same of one file of a scene."""
        source = self.names.file(wildcards.scene, wildcards.file)
        return self.of_file(f"results/{wildcards.scene}/{wildcards.file}", source)

    def _clear(self, *files: Path) -> None:
        for file in files if self.clears else ():
            file.unlink(missing_ok=True)


def _not_ended(records: list[str]) -> list[str]:
    """Those of jobs that have not ended. The others are no inputs: their times may lie in the future."""
    return [record for record in records if not is_whole(Path(record))]


def command(stage: str) -> str:
    """The shell command of a stage, without its log. Its key file says which files it reads and writes.

    With `exec` the stage is a child of Snakemake itself and ends with it. Paths are in the environment: in the command
    they would differ when the tree is moved or .venv is made again.
    """
    declared = declarations()[stage]
    options = " ".join(f"--{name} {{wildcards.{name}}}" for name in declared.placeholders)
    key = f"{STORE}/{stage}/{{wildcards.key}}/key.json"
    return f'exec "$ROUGHSLIP_PYTHON" -m {declared.command} --key {key} {options}'.rstrip()


def outputs(stage: str, category: Any) -> dict[str, Any]:
    """Files that a stage writes, by option, and its record of cost. A picture also goes to Snakemake's report.

    category : function of the wildcards, for the report
    """
    declared = declarations()[stage]
    folder = f"{STORE}/{stage}/{{key}}"
    files: dict[str, Any] = {name: f"{folder}/{file}" for name, file in declared.results.items()}
    if declared.caption:
        files["png"] = report(files["png"], caption=CAPTION, category=category)
    return files | {"usage": f"{folder}/usage/{declared.job_name()}.json"}


def log(stage: str) -> str:
    """The log of a job."""
    return f"{STORE}/{stage}/{{key}}/logs/{declarations()[stage].job_name()}.log"


def asked_mb(stage: str, attempt: int, of_a_node: int | None) -> int:
    """Megabytes that a job asks for. of_a_node : what a node of a cluster gives to a job; None on this machine"""
    needed = declarations()[stage].memory_mb + (NODE_MB if of_a_node else 0)
    return min(needed * MORE ** (attempt - 1), of_a_node or sys.maxsize)


def machine_mb() -> int:
    """Megabytes of this machine, or of the container or control group that holds this process where that is less."""
    limits = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    for file in map(Path, ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")):
        if file.is_file() and (text := file.read_text(encoding="ascii").strip()).isdigit():
            limits.append(int(text))
    return min(limits) // 1_000_000
