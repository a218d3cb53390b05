"""Input functions of the rules: what a job waits for, given what is in the store and where people open it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from roughslip.scene.declarations import declarations
from roughslip.stages.runtime.record import is_whole
from workflow.keys.names import STORE, Entry, Names
from workflow.study.publish import LISTED, is_current, is_published

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
