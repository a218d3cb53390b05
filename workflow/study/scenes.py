"""What the rules ask of the scenes: which exist, without mistakes, which stages they need, and their batches."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from roughslip.errors import InputError, RoughslipError
from roughslip.limits import SHARES
from roughslip.scene import plan
from roughslip.scene.declarations import declarations
from roughslip.scene.fields import AUTO
from roughslip.scene.loader import all_names, load
from roughslip.scene.mistakes import display, line, shown
from roughslip.scene.plausibility import inherited
from roughslip.scene.sweep import scene_file
from roughslip.scene.types import get
from workflow.keys.monte_carlo_batches import SAMPLES
from workflow.study import memory
from workflow.study.surface_check import check_scan, scene_warnings, surface_mistake

# A scene is a target of its own name, as these are already.
BENCHMARKS = ("surface", "contact", "chaos", "oscillator", "chain")
OF_SEVERAL = ("scene_report", "publish", "one_file", "joint_file", "clean_unused", "store")
EVIDENCE = ("evidence_drawn", *(f"{kind}_{part}" for kind in SAMPLES for part in ("solves", "reference")))
RULES = frozenset({*declarations(), *EVIDENCE, *OF_SEVERAL})
COMPARED = ("paper", "resolved", "elastoplastic")  # where nothing else is asked to be compared
DEFAULT_TARGETS = frozenset({"all", "reference", "verify", "results/report.html"})


class Scenes:
    """All scene files of the project, checked; those that this run asks for must be without mistake.

    root : the project's folder
    words : the command line; the scenes that it names are asked for, or else the default scenes
    memory_mb : that a job may take on a node of a cluster; not given, jobs run on this machine and share what it has
    default : scenes that are made without a target
    checked_scans : folder of marks for scans that were read; not given, scans are not read
    Raises InputError with every mistake of every scene asked for, and where one takes more memory than there is. A
    scene that is not asked for may have mistakes.
    """

    def __init__(
        self,
        root: Path,
        words: list[str],
        memory_mb: int | None = None,
        default: Sequence[str] = (),
        checked_scans: Path | None = None,
    ) -> None:
        self.root = root
        self.memory_mb = memory.machine_mb() if memory_mb is None else memory_mb
        self._beside_mb = 0 if memory_mb is None else memory.NODE_MB
        folder = root / "config" / "scenes"
        self.default = list(default)
        self.variants = all_names(folder)
        self.names = sorted(name for one, names in self.variants.items() for name in (one, *names))
        asked = {_scene_of(word) for word in words}.intersection(self.names)
        if not asked or DEFAULT_TARGETS.intersection(words):
            asked.update(self.default)
        asked.update([variant for name in asked for variant in self.variants.get(name, ())])
        self.valid: dict[str, dict[str, Any]] = {}
        self._checked_scans = checked_scans
        mistakes: list[str] = []
        for name in self.names:
            try:
                self.valid[name] = checked(name, folder)
            except InputError as error:
                if name in asked:
                    mistakes += error.lines
        for name, variants in self.variants.items():  # a scene is made with all its variants, or not at all
            if not self.valid.keys() >= set(variants):
                self.valid.pop(name, None)
        mistakes += [line for name in sorted(asked & self.valid.keys()) for line in self._too_large(name)]
        for name in sorted(asked & self.valid.keys()):
            mistakes += self._surface_mistakes(name)
        mistakes += [f"{folder}: cannot be written to" for name in sorted(asked) for folder in not_writable(name)]
        if mistakes:
            raise InputError(list(dict.fromkeys(mistakes)))
        self.asked = sorted(asked)

    def compared(self, asked: str | None) -> dict[str, list[str]]:
        """Scenes that are drawn in one picture, with the figures that each adds: COMPARED, or as asked, `one,other`.

        Raises InputError for one that has no such figure.
        """
        names = [name for name in COMPARED if name in self.valid] if asked is None else str(asked).split(",")
        every = declarations()["comparison"].many["results"].split()
        drawn = {
            name: found
            for name, scene in self.valid.items()
            if (found := [figure for figure in every if figure in plan.figures(scene)])
        }
        wrong = [shown(name) for name in names if name not in drawn]
        if wrong or len(set(names)) < len(names):
            text = f"is not allowed; scenes with {' or '.join(every)}, each once, of: {', '.join(drawn)}"
            raise InputError([f"--config compare: {', '.join(wrong) or shown(asked)} {text}"])
        return {name: drawn[name] for name in names}

    def __getitem__(self, name: str) -> dict[str, Any]:
        return self.valid[name]

    @cache  # noqa: B019 (one instance lives as long as the run)
    def stages(self, name: str) -> frozenset[str]:
        """Stages that the targets of the scene need."""
        return frozenset(plan.stages_needed(self.valid[name]))

    def memory(self, name: str, stage: str) -> int:
        """Megabytes of the largest job of a stage of a scene."""
        jobs = self.jobs(name, stage)
        count = max((job["last"] - job["first"] for job in jobs if job), default=0)
        count *= memory.samples_of_a_share(self.valid[name], stage)
        return memory.needed_mb(self.valid[name], stage, count) + self._beside_mb

    def at_attempt(self, memory_mb: int, attempt: int) -> int:
        """Megabytes of a job: more at each attempt, but not more than there is, as not every job died of its memory."""
        return max(memory_mb, min(attempt * memory_mb, self.memory_mb))

    def _too_large(self, name: str) -> list[str]:
        """A line for the stage that takes the most, where that is more than there is."""
        scene = self.valid[name]
        needed, stage = max((memory.needed_mb(scene, stage, 1), stage) for stage in self.stages(name))
        needed += self._beside_mb
        if needed <= self.memory_mb:
            return []
        file = display(scene_file(name, self.root / "config" / "scenes"))
        return [
            f"{file}: stage {stage} would take some {needed} MB of memory, and {self.memory_mb} MB are there; take "
            "fewer nodes, modes, samples or draws, or say how much there is where the jobs run: --config memory_mb=..."
        ]

    def batches(self, name: str, stage: str, design: str = "") -> list[tuple[int, int]]:
        """Ranges [first, last) of the sample numbers of the jobs of a stage, for one of its designs.

        Batches are smaller than the scene asks for where they would not fit into memory; no result depends on it.
        """
        declared = declarations()[stage].batches
        assert declared is not None
        if memory.is_allotted(self.valid[name], declared):
            return [(share, share + declared.shares) for share in range(0, SHARES, declared.shares)]
        count, jobs = (get(self.valid[name], key) for key in (declared.totals[design], "jobs"))
        if count == AUTO:  # then another stage finds the number of samples
            return []
        step = memory.largest_batch(self.valid[name], stage, -(-count // jobs), self.memory_mb - self._beside_mb)
        return [(first, min(first + step, count)) for first in range(0, count, step)]

    def jobs(self, name: str, stage: str) -> list[dict[str, Any]]:
        """The jobs of a stage in the scene, each as the values of the placeholders in the name of its result."""
        if stage not in self.stages(name):
            return []
        declared = declarations()[stage]
        if declared.batches is None:
            return [{}]
        return [
            {"design": design, "first": first, "last": last}
            for design in declared.batches.totals
            for first, last in self.batches(name, stage, design)
        ]

    def scan_file(self, name: str) -> str:
        """The user's scan that the scene reads."""
        return _scan_file(self.root, get(self.valid[name], "roughness.scan.file"))

    def _surface_mistakes(self, name: str) -> list[str]:
        """A line if the scan of the scene cannot be read, if no surface has its numbers, or if none takes its load."""
        file = scene_file(name, self.root / "config" / "scenes")
        try:
            section, text = surface_mistake(self.valid[name])
            if text:
                return [line(file, (section,), text)]
        except RoughslipError as error:
            return [line(file, ("roughness",), str(error))]
        return self._scan_check(name)[0]

    @cache  # noqa: B019
    def _scan_check(self, name: str) -> tuple[list[str], list[str]]:
        """Mistakes and warnings of the scan of the scene; none where no user's scan is read."""
        scene, file = self.valid[name], scene_file(name, self.root / "config" / "scenes")
        if self._checked_scans is None or "scan" not in self.stages(name) or not get(scene, "roughness.scan.file"):
            return [], []
        return check_scan(file, Path(self.scan_file(name)), scene, self._checked_scans)

    @cache  # noqa: B019
    def warnings(self, name: str) -> list[str]:
        """What is implausible in the scene, before anything is solved."""
        takes_curve = self.stages(name) & {"answer", "deterministic", "stick_slip_map"}
        own = inherited(name, self.root / "config" / "scenes") if takes_curve else []
        return [*own, *scene_warnings(self.valid[name]), *self._scan_check(name)[1]]


def checked(name: str, folder: Path) -> dict[str, Any]:
    """The scene of that name as a run takes it, from the folder of the scene files: its scan, too, has to be there.

    Raises InputError with every mistake of the scene.
    """
    if name in RULES:
        file = display(folder / f"{name}.yaml")
        raise InputError(f"{file}: {name!r} is not allowed as the name of a scene; a step of the workflow has it")
    scene = load(folder / f"{name}.yaml", folder)
    file = get(scene, "roughness.scan.file")
    if file is not None:
        found = Path(_scan_file(folder.parents[1], file))
        text = "is not there; a path from the folder of the scenes or of the project"
        if found.is_file():
            text = "lies outside the project; copy it, not a link, to the folder of the scenes"
        if not (found.is_file() and _is_inside(found, folder.parents[1])):
            where = ("roughness", "scan", "file")
            raise InputError(line(scene_file(name, folder), where, f"{shown(file)} {text}"))
    return scene


def not_writable(name: str) -> list[Path]:
    """The folders that stand in the way of a scene's results, if there are any."""
    results = Path("results")
    below = {Path(stage.result).parent.as_posix() for stage in declarations().values()} | {"keys", "logs", "usage"}
    folders = (results, results / "store", results / name, *(results / name / inner for inner in sorted(below - {"."})))
    there = [path for path in folders if os.path.lexists(path)]
    return [path for path in there or [Path()] if not (path.is_dir() and os.access(path, os.W_OK))]


def _scene_of(word: str) -> str:
    """The scene that a target of the command line belongs to: its name, or the folder of a result."""
    parts = Path(word).parts
    return parts[1] if len(parts) > 1 and parts[0] == "results" else word


def _is_inside(file: Path, root: Path) -> bool:
    """Whether a file, links followed, is one of the project or of the working folder."""
    return any(file.resolve().is_relative_to(folder.resolve()) for folder in (root, Path.cwd()))


def _scan_file(root: Path, file: str) -> str:
    """The path of a scan from the folder of the scene files, else from that of the project."""
    near = root / "config" / "scenes" / file
    return display(near if near.is_file() else root / file)
