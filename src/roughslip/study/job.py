"""Run a job of the study: read its key file, do the work of its stage, and record what it took.

The key file says which stage it is, what it reads of the scene, and the files that it takes. Results go next to it. The
record of a job comes last: a job without one has not ended.
"""

import argparse
import gc
import json
import os
import resource
import sys
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

from roughslip import store
from roughslip.atomic_write import replacing
from roughslip.compilation.source_hash import FRAME, closure_hash
from roughslip.errors import RoughslipError, StoreError
from roughslip.scene.part import Scene, part
from roughslip.study import checksum, describe
from roughslip.study.graph import STAGES, Stage, drawing

SOURCE = Path(__file__).resolve().parents[2]
KILOBYTES = 1 if sys.platform == "darwin" else 1024  # in a unit of ru_maxrss
_BEGAN, _LINES_APART = time.time(), 5.0  # seconds between two lines of progress


@dataclass
class Job:
    """What the work of a stage is given next to the scene, and what it says of itself.

    key : the slice of the scene that the stage reads, and the hash of its code
    inputs : the files of the stages that it takes, and of the user, by name
    outputs : the files that it makes, by name; `output` is the result
    numbers, design : of its samples, for a stage that is split into batches
    scenes : of a stage that looks at whole scenes, by scene its results by the names under which they are published
    did : counts of what was done
    warnings : what limits the result, a line each: in the log, in costs.json, on the page, at the end of a run
    """

    stage: str
    scene: Scene
    key: store.Key
    inputs: Mapping[str, list[Path]]
    outputs: Mapping[str, Path]
    numbers: range = range(0)
    design: str = ""
    scenes: Mapping[str, Mapping[str, Path]] = field(default_factory=dict)
    did: Counter[str] = field(default_factory=Counter)
    warnings: list[str] = field(default_factory=list)
    _said: float = 0.0  # when a line was last said

    def paths(self, name: str) -> list[Path]:
        """All files of that name; none where the scene has none."""
        return self.inputs.get(name, [])

    def optional(self, name: str) -> Path | None:
        """The file of that name, if the scene has one."""
        return next(iter(self.paths(name)), None)

    def path(self, name: str) -> Path:
        """The file of that name. Raises StoreError where there is none."""
        if not self.paths(name):
            raise StoreError(f"{self.stage}: names no file for {name!r}; run snakemake again")
        return self.paths(name)[0]

    @property
    def output(self) -> Path:
        """The result."""
        return self.outputs["output"]

    def count(self, **did: float) -> None:
        """Add to what the job did: `job.count(solves=3)`."""
        self.did.update({name: int(number) for name, number in did.items()})

    def warn(self, *texts: str) -> None:
        """Say what limits the result, each line: what, its number, what follows or what to do."""
        for text in texts:
            if text not in self.warnings:
                self.warnings.append(text)
                self.say(f"warning: {text}")

    def say(self, text: str) -> None:
        """Write a line to stderr, which is the job's log."""
        print(f"{self.stage}: {text}", file=sys.stderr, flush=True)

    def progress(self, done: int, total: int) -> None:
        """Say every few seconds, and at the end, what is done."""
        now = time.monotonic()
        if now - self._said >= _LINES_APART or done == total:
            self.say(f"{done} of {total} after {time.time() - _BEGAN:.0f} s")
            self._said = now

    def record(self) -> dict[str, Any]:
        """What it took up to now and what it did, with size and checksum of each file that it made."""
        usage = resource.getrusage(resource.RUSAGE_SELF)
        return {
            "stage": self.stage,
            "jobs": 1,
            "cpu_seconds": round(usage.ru_utime + usage.ru_stime, 3),
            "wall_seconds": round(time.time() - _BEGAN, 3),
            "peak_memory_mib": round(usage.ru_maxrss * KILOBYTES / 2**20, 1),
            "did": dict(sorted(self.did.items())),
            "warnings": self.warnings,
        }


def job_of(stage: Stage, file: Path, entry: Mapping[str, Any], values: Mapping[str, Any]) -> Job:
    """The job of a key file. values : of the placeholders in the name of its result

    Raises StoreError where the key file is damaged or a file that the job takes is not there.
    """
    key = store.read_key(file)
    inputs = {name: [Path(path) for path in paths] for name, paths in entry["inputs"].items()}
    for path in (path for paths in inputs.values() for path in paths):
        if not path.exists():
            raise StoreError(f"{path}: missing; run snakemake again")
    outputs = {name: file.parent / result.format(**values) for name, result in stage.results.items() if result}
    outputs |= {name: Path(path) for name, path in entry["outputs"].items()}
    scenes = {scene: {name: Path(path) for name, path in files.items()} for scene, files in entry["files"].items()}
    numbers = range(values.get("first", 0), values.get("last", 0))
    return Job(stage.name, part(key.configuration), key, inputs, outputs, numbers, values.get("design", ""), scenes)


def check_sources(stage: Stage, entry: Mapping[str, Any]) -> None:
    """Raise StoreError where code or scans are no longer those that the key names, as after an edit during a run."""
    sources = entry["sources"]
    edited = [name for name, known in sources.get("files", {}).items() if _differs(SOURCE / name, known)]
    if edited and closure_hash(stage.modules, SOURCE, FRAME) != sources["closure"]:
        raise StoreError(f"{edited[0]} was edited during the run: nothing is written; run snakemake again")
    for name, known in entry.get("user_files", {}).items():
        if _differs(Path(name), known):
            raise StoreError(f"{name} was changed during the run: nothing is written; run snakemake again")


def _differs(path: Path, known: str) -> bool:
    return not path.is_file() or checksum(path) != known


def run(file: Path, values: Mapping[str, Any]) -> None:
    """Do the work of a key file, and write its record."""
    entry = json.loads(file.read_text(encoding="utf-8"))
    stage = STAGES[entry["stage"]]
    if stage.name == "figures":
        stage = drawing(entry["configuration"]["figures"])
    check_sources(stage, entry)
    job = job_of(stage, file, entry, values)
    import_module(stage.modules.split()[0]).work(job.scene, job)
    check_sources(stage, entry)
    record = file.parent / "usage" / f"{stage.job_name(**values)}.json"
    made = describe(record, job.outputs.values())
    with replacing(record) as temporary:
        temporary.write_text(json.dumps(job.record() | {"made": made}, indent=2) + "\n", encoding="utf-8")


def main() -> None:
    """The command of every rule. Where the package refuses or gives up, exit 1 with its message.

    A job ends at once: to take the libraries apart would take a fifth of a second.
    """
    gc.freeze()
    gc.enable()
    parser = argparse.ArgumentParser(prog="python -m roughslip.study")
    parser.add_argument("--key", type=Path, required=True, help="key file of the stage")
    parser.add_argument("--first", type=int, default=argparse.SUPPRESS, help="number of the first sample of the batch")
    parser.add_argument("--last", type=int, default=argparse.SUPPRESS, help="number after the last one")
    parser.add_argument("--design", default=argparse.SUPPRESS, help="design that the samples belong to")
    given = vars(parser.parse_args())
    file = given.pop("key")
    try:
        run(file, given)
    except RoughslipError as error:
        print(f"{file.parent.parent.name}: error: {error.in_scene}", file=sys.stderr)
        sys.exit(1)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)
