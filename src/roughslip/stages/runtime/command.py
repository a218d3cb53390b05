"""The command of a stage: its key file, its files by name, its record of cost, and one line for each error."""

import argparse
import gc
import json
import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from roughslip.compilation.source_hash import FRAME, closure_hash
from roughslip.errors import RoughslipError, StoreError
from roughslip.scene.declarations import RANGE, Stage
from roughslip.scene.types import Scene, scene_of
from roughslip.stages import IS_JOB
from roughslip.stages.runtime.usage import Usage, checksum
from roughslip.store import Key, read_key

SOURCE = Path(__file__).resolve().parents[3]


@dataclass(frozen=True)
class Job:
    """One run of a stage.

    key : the slice of the scene that the stage reads, and the hash of its code
    arguments : files by option, and the placeholders in the name of the result
    usage : the record of cost, written next to the result
    reads : scene keys that the stage declares; None for all
    files : for a stage that looks at whole scenes, by scene its results by the names under which they are published
    """

    key: Key
    arguments: argparse.Namespace
    usage: Usage
    reads: tuple[str, ...] | None = None
    files: Mapping[str, Mapping[str, Path]] = field(default_factory=dict)

    @cached_property
    def scene(self) -> Scene:
        """The part of the scene that the stage reads."""
        return scene_of(self.key.configuration, self.reads)


def execute(stage: Stage, work: Callable[[Job], None]) -> None:
    """Run a stage as a command; exit 1 with the message, not a traceback, where the package refuses or gives up.

    Its key file says which files it reads, and its results go next to the key file. Code and scans are compared with
    the key before the work and after it. The record of cost comes last: a job without one has not ended. A job ends at
    once when its files are written: to take the libraries apart would take a fifth of a second.
    """
    gc.freeze()
    gc.enable()
    parser = argparse.ArgumentParser(prog=f"python -m {stage.command}")
    parser.add_argument("--key", type=Path, required=True, help="key file of the stage")
    for name in stage.placeholders:
        parser.add_argument(f"--{name}", type=int if name in RANGE else str, required=True)
    arguments = parser.parse_args()
    try:
        key = read_key(arguments.key)
        entry = json.loads(arguments.key.read_text(encoding="utf-8"))
        files = paths(stage, arguments.key, entry, vars(arguments))
        check_sources(stage, entry)
        with Usage(files.pop("usage"), stage.name) as usage:
            made = [files[name] for name in stage.results]
            published = {
                scene: {name: Path(path) for name, path in names.items()}
                for scene, names in entry.get("files", {}).items()
            }
            work(Job(key, argparse.Namespace(**vars(arguments), **files), usage, stage.keys, published))
            check_sources(stage, entry)
            usage.files(made)
    except RoughslipError as error:
        print(f"{stage.name}: error: {error}", file=sys.stderr)
        sys.exit(1)
    if IS_JOB:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(0)


def paths(stage: Stage, key: Path, entry: Mapping[str, Any], placeholders: Mapping[str, Any]) -> dict[str, Any]:
    """Files of a job by option: those it reads, those it writes, and its record of cost as "usage".

    An option for one file is a path or None, one for several is a list. Raises StoreError for one that is not there.
    """
    inputs = {name: [Path(path) for path in entry.get("inputs", {}).get(name, [])] for name in stage.options}
    for path in (path for option in inputs.values() for path in option):
        if not path.exists():
            raise StoreError(f"{path}: missing; run snakemake again")
    read: dict[str, Any] = {
        name: given if name in stage.many else given[0] if given else None for name, given in inputs.items()
    }
    for name in (*stage.inputs, *stage.many):
        if not read[name]:
            raise StoreError(f"{key}: names no file for {name!r}; run snakemake again")
    values = {name: placeholders[name] for name in stage.placeholders}
    results = {name: key.parent / file.format(**values) for name, file in stage.results.items() if file}
    record = key.parent / "usage" / f"{stage.job_name(**values)}.json"
    return {
        **read,
        "usage": record,
        **results,
        **{name: Path(path) for name, path in entry.get("outputs", {}).items()},
    }


def check_sources(stage: Stage, entry: Mapping[str, Any]) -> None:
    """Raise StoreError where code or scans are no longer those that the key names, as after an edit during a run."""
    sources: Mapping[str, Any] = entry.get("sources", {})
    edited = [name for name, known in sources.get("files", {}).items() if _differs(SOURCE / name, known)]
    if edited and closure_hash(stage.modules, SOURCE, FRAME) != sources["closure"]:
        raise StoreError(f"{edited[0]} was edited during the run: nothing is written; run snakemake again")
    given = entry["inputs"][stage.name] if "scans" in entry else ()
    for name, known in (*zip(given, entry.get("scans", ()), strict=True), *entry.get("own", {}).items()):
        if _differs(Path(name), known):
            raise StoreError(f"{name} was changed during the run: nothing is written; run snakemake again")


def _differs(path: Path, known: str) -> bool:
    return not path.is_file() or checksum(path) != known
