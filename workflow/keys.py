"""Names of results: results/store/<stage>/<key>/<file>, where the key is a hash of all that the result is made of.

So a result that exists is up to date. Two scenes share a result because it has one name, and after an edit is taken
back the result is still there. key.json in its folder says what was hashed. Code is hashed as the import closure
of the stage's module, with the locked packages and departures from the lock.
"""

from __future__ import annotations

import difflib
import hashlib
import json
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from packaging.requirements import InvalidRequirement, Requirement
from packaging.utils import canonicalize_name

from roughslip.atomic_write import write_if_changed
from roughslip.compilation import source_hash
from roughslip.compilation.source_hash import FRAME, closure_hash
from roughslip.errors import InputError
from roughslip.scene import plan
from roughslip.scene.declarations import declarations
from roughslip.scene.mistakes import shown
from roughslip.scene.schema import own_code
from roughslip.scene.types import get, slice_for
from roughslip.stages.runtime.usage import checksum
from workflow.study.scenes import USER_FILES, Scenes

STORE = "results/store"
KEY = "[0-9a-f]{16}"
_NOT_HASHED = ("inputs", "awaited", "files", "outputs", "scene")
JOINT = ""  # in place of a scene: what belongs to several
_SHOWN = 3  # packages in a line for the user
_INFO = ".dist-info"
_PYTHON = ".".join(map(str, sys.version_info[:2]))


@dataclass(frozen=True)
class Entry:
    """What the results of a stage are made of.

    made_of : JSON values that are hashed: stage, slice of the scene, code, also of the user, scans, and the keys of the
        stages before
    inputs : files that its jobs read, by option of the stage
    awaited : records of cost of the jobs that make these
    files : of a stage that looks at whole scenes, by scene its results by the names under which they are published
    outputs : files that do not go next to the key file, by option
    scene : name of a scene that has it, or JOINT
    """

    made_of: dict[str, Any]
    inputs: dict[str, list[str]]
    awaited: list[str]
    files: dict[str, dict[str, str]] = field(default_factory=dict)
    outputs: dict[str, str] = field(default_factory=dict)
    scene: str = JOINT

    @cached_property
    def key(self) -> str:
        text = json.dumps(self.made_of, sort_keys=True, allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    @property
    def folder(self) -> str:
        return f"{STORE}/{self.made_of['stage']}/{self.key}"


class Names:
    """The names of all results of the scenes of a run.

    root : the project's folder
    writes : whether each key file is written as soon as its name is known; a dry run writes none
    """

    def __init__(self, scenes: Scenes, root: Path, writes: bool) -> None:
        self.scenes, self._writes = scenes, writes
        self._source, self._lock = root / "src", root / "requirements.lock"
        self._entries: dict[str, Entry] = {}  # by folder

    @cache  # noqa: B019 (one instance lives as long as the run)
    def entry(self, scene: str, stage: str) -> Entry:
        """What the results of a stage of a scene are made of."""
        inputs = self._inputs(scene, stage)
        files, made_of = {}, {"configuration": self._configuration(scene, stage)}
        before = self._before(scene, stage)
        if stage == "report":
            files = {scene: self.published(scene, without=("report",))}
        if stage in USER_FILES:
            made_of["scans"] = [checksum(Path(file)) for file in inputs[stage]]
        if own := sorted({code.rpartition(":")[0] for code in own_code(made_of["configuration"]).values()}):
            made_of["own"] = {file: checksum(Path(file)) for file in own}
        if declarations()[stage].batches is not None:
            made_of["jobs"] = self.scenes.jobs(scene, stage)
        made_of["before"] = {name: self.entry(scene, name).key for name in before}
        awaited = self._awaited(scene, before)
        if stage == "chaos_strip" and "contact" in before:  # those of its first batches alone
            awaited = [record for record in awaited if "/contact/" not in record]
            awaited += self.records(scene, "contact", below="strip.training_samples")
        return self._known(Entry(self._code(stage) | made_of, inputs, awaited, files, scene=scene))

    def joint_page(self, names: Iterable[str], kept: list[Path]) -> Entry:
        """The page on several scenes. kept : files of evidence"""
        part = {"captions": plan.captions(), "folder": "results", "evidence": [*map(_content, kept)]}
        inputs = {"evidence": [str(file.parent) for file in kept[:1]]}
        return self._of_several("report", names, part, inputs)

    def over_published(self, stage: str, scenes: list[str], **inputs: list[str]) -> Entry:
        """A stage that reads and writes published files of these scenes: `verify` and `reference`."""
        inputs["scenes"] = [f"results/{name}" for name in scenes]
        outputs = {option: f"results/{file or stage}" for option, file in declarations()[stage].results.items()}
        return self._known(Entry(self._code(stage) | {"configuration": {}}, inputs, [], outputs=outputs))

    def results(self, scene: str, *stages: str, below: str = "") -> list[str]:
        """The results of these stages, as far as the scene runs them.

        below : scene key of a number of samples, for the batches that begin below it alone
        """
        return [
            f"{self.entry(scene, stage).folder}/{declarations()[stage].result.format(**job)}"
            for stage in stages
            if stage in declarations()
            for job in self._jobs(scene, stage, below)
        ]

    def records(self, scene: str, stage: str, below: str = "") -> list[str]:
        """The records of cost of the jobs of a stage; below : as `results`."""
        name = declarations()[stage].job_name
        return [
            f"{self.entry(scene, stage).folder}/usage/{name(**job)}.json" for job in self._jobs(scene, stage, below)
        ]

    def published(self, scene: str, without: tuple[str, ...] = ()) -> dict[str, str]:
        """The file of the store by the name of each file of a scene, without its folder.

        without : stages that are left out
        """
        files: dict[str, str] = {}
        for stage in sorted(self.scenes.stages(scene).difference(without)):
            declared, folder = declarations()[stage], self.entry(scene, stage).folder
            for job in self._jobs(scene, stage):
                names = [file.format(**job) for file in declared.results.values()]
                names.append(f"usage/{declared.job_name(**job)}.json")
                files |= {name: f"{folder}/{name}" for name in names}
            files[f"keys/{stage}.json"] = f"{folder}/key.json"
        return files

    def file(self, scene: str, name: str) -> str:
        """The file of the store by its name in the folder of a scene. Raises InputError where the scene has none."""
        files = self.published(scene)
        if name not in files:
            near = difflib.get_close_matches(name, files, 1)
            raise InputError(
                f"results/{scene}/{name}: no target of the scene makes it{f'; {near[0]}?' if near else ''}"
            )
        return files[name]

    def awaited(self, scene: str) -> list[str]:
        """The records of cost of every job of a scene."""
        return self._awaited(scene, self.scenes.stages(scene))

    def at(self, folder: str) -> Entry:
        """The entry of a folder of the store: of this run, or from its key file.

        Raises InputError where no scene of the run has it and no key file is there.
        """
        if folder not in self._entries:
            file = Path(folder) / "key.json"
            try:
                whole = json.loads(file.read_text(encoding="utf-8"))
                others = {name: whole.pop(name) for name in _NOT_HASHED}
                whole.pop("sources")
                self._entries[folder] = Entry(whole, **others)
            except (OSError, ValueError, KeyError) as error:
                raise InputError(f"{file}: no key file ({error}); name the scene as the target") from error
        return self._entries[folder]

    def publication(self, scene: str) -> Entry:
        """The list of what stands in the folder of a scene."""
        return self._known(Entry({"stage": "published", "published": self.published(scene)}, {}, [], scene=scene))

    def _awaited(self, scene: str, stages: Iterable[str]) -> list[str]:
        return [record for stage in sorted(stages) for record in self.records(scene, stage)]

    def _jobs(self, scene: str, stage: str, below: str = "") -> list[dict[str, Any]]:
        jobs = self.scenes.jobs(scene, stage)
        return [job for job in jobs if not below or job["first"] < get(self.scenes[scene], below)]

    def _inputs(self, scene: str, stage: str) -> dict[str, list[str]]:
        declared = declarations()[stage]
        if stage == "costs":
            return {"records": self._awaited(scene, self._before(scene, stage))}
        options = {**declared.inputs, **declared.optional, **declared.many, **declared.collects}
        special: dict[str, list[str]] = {}
        if stage in USER_FILES:
            special[stage] = self.scenes.user_files(scene, stage)
        if stage == "chaos_strip":  # training strips are those of the first batches
            special["contact"] = self.results(scene, "contact", below="strip.training_samples")
        others = {option: made_by.split() for option, made_by in options.items() if option not in special}
        return special | {option: self.results(scene, *stages) for option, stages in others.items()}

    def _before(self, scene: str, stage: str) -> list[str]:
        """The stages of a scene whose results a stage takes."""
        stages = self.scenes.stages(scene)
        if stage in plan.AFTER_COSTS:  # the sum takes all, and the page the sum too
            return sorted(stages - {"report"} if stage == "report" else stages.difference(plan.AFTER_COSTS))
        return plan.makers(stage, stages)

    def _configuration(self, scene: str, stage: str) -> dict[str, Any]:
        part = slice_for(self.scenes[scene], stage)
        if stage == "costs":
            part |= {"not_needed": plan.skip_reasons(self.scenes[scene]), "warnings": self.scenes.warnings(scene)}
        if stage == "report":
            part |= {"captions": plan.captions(), "folder": f"results/{scene}"}
        return part

    def _of_several(
        self,
        stage: str,
        names: Iterable[str],
        part: dict[str, Any],
        inputs: dict[str, list[str]] | None = None,
        awaited: Iterable[str] = (),
        scene: str = JOINT,
    ) -> Entry:
        """A stage that looks at the whole results of several scenes. part : what it works with, without these"""
        names = tuple(names)
        files = {name: self.published(name, without=("report",)) for name in names}
        before = {
            name: {other: self.entry(name, other).key for other in self._before(name, "report")} for name in names
        }
        records = [record for name in names for record in self._awaited(name, before[name])]
        made_of = self._code(stage) | {"configuration": part, "before": before}
        return self._known(Entry(made_of, inputs or {}, [*records, *awaited], files, scene=scene))

    def _code(self, stage: str) -> dict[str, str]:
        code = code_hash(declarations()[stage].modules, self._source, self._lock)
        return {"stage": stage, "code": code, "python": _PYTHON}

    @cache  # noqa: B019
    def _sources(self, stage: str) -> dict[str, Any]:
        """Hash of what the code of a stage does, and checksums of its files, for jobs to see whether it was edited."""
        modules = declarations()[stage].modules
        files = source_hash.closure(modules, self._source, source_hash.FRAME)
        known = {file.relative_to(self._source).as_posix(): _content(file) for file in files}
        return {"closure": source_hash.closure_hash(modules, self._source, source_hash.FRAME), "files": known}

    def _known(self, entry: Entry) -> Entry:
        """The first entry of that name. Raises InputError where its key file cannot be written."""
        if entry.folder in self._entries:
            return self._entries[entry.folder]
        self._entries[entry.folder] = entry
        if self._writes:
            stage, others = entry.made_of["stage"], {name: getattr(entry, name) for name in _NOT_HASHED}
            sources = self._sources(stage) if stage in declarations() else {}
            content = {**entry.made_of, **others, "sources": sources}
            text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)
            try:
                write_if_changed(Path(entry.folder, "key.json"), f"{text}\n")
            except OSError as error:
                raise InputError(f"{entry.folder}: cannot be written to ({error.strerror})") from None
        return entry


@cache
def _content(file: Path) -> str:
    return checksum(file)


def code_hash(module_name: str, source_root: str | Path, lock: str | Path) -> str:
    """SHA-256 of what the closure of a module does, of the locked packages, and of packages that differ from the lock.

    Comments, docstrings and layout do not change it, nor do modules of FRAME. A file that moves changes it.
    """
    digest = hashlib.sha256(closure_hash(module_name, Path(source_root), without=FRAME).encode())
    locked = Path(lock).read_text(encoding="utf-8")
    digest.update("\n".join([*_pins(locked), *departures(locked)]).encode())
    return digest.hexdigest()


@cache
def _pins(lock: str) -> tuple[str, ...]:
    """The lines of a lock file without its comments."""
    lines = (line.strip() for line in lock.splitlines())
    return tuple(line for line in lines if line and not line.startswith("#"))


@cache
def departures(lock: str) -> tuple[str, ...]:
    """Return `numpy 2.4.6 in place of 2.5.0` for each package that differs from its pin in the text of a lock file.

    Pins for other systems or Python versions do not count.

    Raises InputError for a line that pins nothing.
    """
    there, differing = _installed(), []
    for line in lock.splitlines():
        if "==" in line and not line.startswith(("#", " ")):
            pinned = _requirement(line.rstrip(" \\"))
            version = there.get(canonicalize_name(pinned.name))
            if (pinned.marker is None or pinned.marker.evaluate()) and (
                version is None or version not in pinned.specifier
            ):
                wanted = str(pinned.specifier).lstrip("=")
                differing.append(f"{pinned.name} {version or 'missing'} in place of {wanted}")
    return tuple(differing)


def report(lock: str) -> list[str]:
    """Return a line about these packages for the user, or none."""
    differing = departures(lock)
    if not differing:
        return []
    more = f" and {len(differing) - _SHOWN} more" if len(differing) > _SHOWN else ""
    return [
        f"requirements.lock: installed are {', '.join(differing[:_SHOWN])}{more}; jobs of other versions run again; "
        "`make setup` installs the locked packages"
    ]


def _requirement(line: str) -> Requirement:
    try:
        return Requirement(line)
    except InvalidRequirement:
        raise InputError(
            f"requirements.lock: {shown(line)} pins no package; restore the file, for example with git"
        ) from None


def _installed() -> dict[str, str]:
    """Versions of installed packages by name, from the names of their folders: reading each takes ten times as long."""
    versions: dict[str, str] = {}
    for folder in map(Path, sys.path):
        for info in folder.glob(f"*{_INFO}"):
            name, _, version = info.name.removesuffix(_INFO).partition("-")
            versions.setdefault(canonicalize_name(name), version)
    return versions
