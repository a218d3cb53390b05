"""Names of results: results/store/<stage>/<key>/<file>, where the key is a hash of all that the result is made of.

So a result that exists is up to date. Two scenes share a result because it has one name, and after an edit is taken
back the result is still there. key.json in its folder says what was hashed. Code is hashed as the import closure
of the stage's modules, with the locked packages and the versions that are installed.
"""

import difflib
import hashlib
import json
import sys
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from functools import cache, cached_property
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from roughslip.atomic_write import write_if_changed
from roughslip.compilation.source_hash import FRAME, closure, closure_hash
from roughslip.errors import InputError
from roughslip.scene.schema import own_code
from roughslip.study import checksum, plan
from roughslip.study.graph import STAGES, Stage, drawing
from workflow.study.scenes import Scenes

STORE = "results/store"
KEY = "[0-9a-f]{16}"
PACKAGES = ("numpy", "scipy", "numba", "ducc0", "netCDF4", "matplotlib", "SurfaceTopography")
_PYTHON = ".".join(map(str, sys.version_info[:2]))
_content = cache(checksum)


@dataclass(frozen=True)
class Entry:
    """What the results of a stage are made of.

    made_of : JSON values that are hashed: stage, slice of the scene, code, files of the user, keys of the stages before
    inputs : files that its jobs read, by name
    awaited : records of cost of the jobs that make these
    files : of a stage that looks at whole scenes, by scene its results by the names under which they are published
    outputs : files that do not go next to the key file, by name
    scene : name of a scene that has it; "" for what belongs to several
    """

    made_of: dict[str, Any]
    inputs: dict[str, list[str]] = field(default_factory=dict)
    awaited: list[str] = field(default_factory=list)
    files: dict[str, dict[str, str]] = field(default_factory=dict)
    outputs: dict[str, str] = field(default_factory=dict)
    scene: str = ""

    @cached_property
    def folder(self) -> str:
        text = json.dumps(self.made_of, sort_keys=True, allow_nan=False)
        return f"{STORE}/{self.made_of['stage']}/{hashlib.sha256(text.encode()).hexdigest()[:16]}"

    @property
    def key(self) -> str:
        return self.folder.rpartition("/")[2]


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
        row, whole, stages = self._row(scene, stage), self.scenes[scene], self.scenes.stages(scene)
        before = sorted(stages - {stage}) if stage == "page" else plan.makers(row, stages)  # the page takes all
        configuration, awaited, files = plan.slice_of(whole, row, scene), self._records(scene, before), {}
        user = {name: self.scenes.user_files(scene, key) for name, key in row.user_files.items()}
        words = {**row.takes, **row.collects}
        inputs = user | {name: self.results(scene, words[name]) for name in words if name not in user}
        if stage == "figures":
            configuration["figures"] = plan.figures(whole)
        elif stage == "page":
            configuration |= {"captions": plan.captions(), "folder": f"results/{scene}"}
            configuration["warnings"] = self.scenes.warnings(scene)
            files, inputs = {scene: self.published(scene, without="page")}, inputs | {"records": awaited}
        made_of = {"configuration": configuration, "before": {name: self.entry(scene, name).key for name in before}}
        files_of_user = [file for some in user.values() for file in some]
        files_of_user += {code.rpartition(":")[0] for code in own_code(configuration).values()}
        if files_of_user:
            made_of["user_files"] = {file: checksum(Path(file)) for file in sorted(files_of_user)}
        if row.batches:
            made_of["jobs"] = self.scenes.jobs(scene, stage)
        return self._known(row, Entry(self._code(row) | made_of, inputs, awaited, files, scene=scene))

    def joint_page(self, scenes: Iterable[str]) -> Entry:
        """The page on several scenes."""
        row, names = STAGES["joint_page"], list(scenes)
        part = {"captions": plan.captions(), "folder": "results"}
        made_of = {"configuration": part, "before": {name: self.entry(name, "page").key for name in names}}
        awaited = [record for name in names for record in self.awaited(name)]
        files = {name: self.published(name) for name in names}
        return self._known(row, Entry(self._code(row) | made_of, {}, awaited, files))

    def comparison(self, scenes: list[str], kept: Path) -> Entry:
        """That of the published files of these scenes with those that git keeps."""
        row, inputs = STAGES["verify"], {"scenes": [f"results/{name}" for name in scenes], "reference": [str(kept)]}
        outputs = {"output": f"results/{row.makes}"}
        return self._known(row, Entry(self._code(row) | {"configuration": {}}, inputs, outputs=outputs))

    def results(self, scene: str, words: str) -> list[str]:
        """The results of the stages that these words of a row name, as far as the scene runs them."""
        stages = [word.rstrip("?") for word in words.split()]
        return [
            f"{self.entry(scene, stage).folder}/{STAGES[stage].makes.format(**job)}"
            for stage in stages
            for job in self.scenes.jobs(scene, stage)
        ]

    def published(self, scene: str, without: str = "") -> dict[str, str]:
        """The file of the store by the name of each file of a scene, without its folder. without : a stage"""
        files: dict[str, str] = {}
        for stage in sorted(self.scenes.stages(scene) - {without}):
            row, folder = self._row(scene, stage), self.entry(scene, stage).folder
            for job in self.scenes.jobs(scene, stage):
                names = [file.format(**job) for file in row.results.values() if file]
                names.append(f"usage/{row.job_name(**job)}.json")
                files |= {name: f"{folder}/{name}" for name in names}
            files[f"keys/{stage}.json"] = f"{folder}/key.json"
        return files

    def file(self, scene: str, name: str) -> tuple[str, list[str]]:
        """The file of the store by its name in the folder of a scene, and the records of the jobs that make it.

        Raises InputError where the scene has none.
        """
        files = self.published(scene)
        if name not in files:
            near = difflib.get_close_matches(name, files, 1)
            raise InputError(
                f"results/{scene}/{name}: no target of the scene makes it{f'; {near[0]}?' if near else ''}"
            )
        stage = Path(files[name]).parts[2]
        return files[name], [] if name.startswith("keys/") else self._records(scene, [stage])

    def awaited(self, scene: str) -> list[str]:
        """The records of cost of every job of a scene."""
        return self._records(scene, self.scenes.stages(scene))

    def at(self, folder: str) -> Entry:
        """The entry of a folder of the store: of this run, or from its key file.

        Raises InputError where no scene of the run has it and no key file is there.
        """
        if folder not in self._entries:
            file = Path(folder) / "key.json"
            try:
                whole = json.loads(file.read_text(encoding="utf-8"))
                whole.pop("sources")
                others = {name: whole.pop(name) for name in ("inputs", "awaited", "files", "outputs", "scene")}
                self._entries[folder] = Entry(whole, **others)
            except (OSError, ValueError, KeyError) as error:
                raise InputError(f"{file}: no key file ({error}); name the scene as the target") from error
        return self._entries[folder]

    def publication(self, scene: str) -> Entry:
        """The list of what stands in the folder of a scene."""
        return self._known(None, Entry({"stage": "published", "published": self.published(scene)}, scene=scene))

    def _row(self, scene: str, stage: str) -> Stage:
        return drawing(plan.figures(self.scenes[scene])) if stage == "figures" else STAGES[stage]

    def _records(self, scene: str, stages: Iterable[str]) -> list[str]:
        """The records of cost of the jobs of some stages."""
        return [
            f"{self.entry(scene, stage).folder}/usage/{STAGES[stage].job_name(**job)}.json"
            for stage in sorted(stages)
            for job in self.scenes.jobs(scene, stage)
        ]

    def _code(self, row: Stage) -> dict[str, str]:
        return {"stage": row.name, "code": code_hash(row.modules, self._source, self._lock), "python": _PYTHON}

    def _known(self, row: Stage | None, entry: Entry) -> Entry:
        """The first entry of that name. Raises InputError where its key file cannot be written."""
        if entry.folder in self._entries:
            return self._entries[entry.folder]
        self._entries[entry.folder] = entry
        if self._writes:
            others = asdict(entry)
            content = {**others.pop("made_of"), **others, "sources": self._sources(row.modules) if row else {}}
            text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)
            try:
                write_if_changed(Path(entry.folder, "key.json"), f"{text}\n")
            except OSError as error:
                raise InputError(f"{entry.folder}: cannot be written to ({error.strerror})") from None
        return entry

    @cache  # noqa: B019
    def _sources(self, modules: str) -> dict[str, Any]:
        """Hash of what code does, and checksums of its files, for jobs to see whether it was edited."""
        known = {
            file.relative_to(self._source).as_posix(): _content(file) for file in closure(modules, self._source, FRAME)
        }
        return {"closure": closure_hash(modules, self._source, FRAME), "files": known}


def code_hash(modules: str, source_root: Path, lock: Path) -> str:
    """SHA-256 of what the closure of modules does, and of the locked and installed packages."""
    code = closure_hash(modules, source_root, without=FRAME)
    return hashlib.sha256(
        "\n".join([code, *_pins(lock.read_text(encoding="utf-8")), *installed()]).encode()
    ).hexdigest()


@cache
def _pins(lock: str) -> list[str]:
    """The lines of a lock file without its comments."""
    lines = (line.strip() for line in lock.splitlines())
    return [line for line in lines if line and not line.startswith("#")]


@cache
def installed() -> list[str]:
    """Versions of the packages that compute; an upgrade that the lock does not know changes results too."""
    found = []
    for package in PACKAGES:
        with suppress(PackageNotFoundError):
            found.append(f"{package}=={version(package)}")
    return found
