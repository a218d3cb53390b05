"""What the rules ask of the scenes: which exist, without mistakes, which stages they need, and their batches.

Options of a run are checked here: config/config.yaml, --configfile, --config, and the targets of the command line.
"""

import ast
import difflib
import os
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from roughslip.errors import InputError
from roughslip.scene.files import scene_names
from roughslip.scene.loader import load
from roughslip.scene.mistakes import Mistake, display, given, guess, shown, with_origins
from roughslip.scene.schema import own_code
from roughslip.scene.types import get
from roughslip.study import plan
from roughslip.study.graph import STAGES
from workflow.study.plausibility import SURFACE, check_scene, inherited, motion_warnings

Place = Callable[[str], str]  # of a file of the user, from the working folder
OfSurface = Callable[[dict[str, Any], Place], tuple[list[Mistake], list[str]]]
RADIUS = "friction.record.radius_m"
USER_FILES = sorted({key for stage in STAGES.values() for key in stage.user_files.values()})
KEYS = ("scenes", "scenes_folder", "memory_mb")
LEAST_MB = 1000  # of a node: about what a stage declares
FOLDERS = ("store", "reference", "benchmarks", "logs", "usage")  # of no scene
GOES_ON = {"--keep-going", "-k"}
QUIET = ("--quiet", "-q")  # `-q all` asks for no scene
_FLAGS = {"--dry-run", "--dryrun", "--force", "--forceall", "--keep-going", "--touch", "--nolock", "--printshellcmds"}


def scene_folders(root: Path, own: Any = None) -> list[Path]:
    """Folders of scenes: of the project, and `own`, an InputError where it has none."""
    shipped = root / "config" / "scenes"
    if own is None:
        return [shipped]
    if not (isinstance(own, str) and scene_names(Path(own))):
        raise InputError(f"config: scenes_folder: {shown(own)} has no scene in {Path.cwd()}; a folder of <name>.yaml")
    return [shipped, Path(own)]


def check_config(config: Mapping[str, Any], scenes: Sequence[str]) -> dict[str, Any]:
    """Return the options with `scenes` as a list, and None for `memory_mb` where it is not given.

    Scenes are a list, or names with commas between them; without them, those of `scenes_folder`. Raises InputError with
    a line for each mistake.
    """
    unknown = [key for key in config if key not in KEYS]
    lines = [f"config: {shown(key)}: unknown key; {_nearest(key, KEYS)}" for key in unknown]
    memory = config.get("memory_mb", LEAST_MB)
    if type(memory) is not int or memory < LEAST_MB:
        lines.append(f"config: memory_mb: {shown(memory)} is not allowed; a whole number from {LEAST_MB}")
    given = config.get("scenes", scene_names(Path(config["scenes_folder"])) if "scenes_folder" in config else None)
    names = given.split(",") if isinstance(given, str) else given
    if not isinstance(names, list) or not names:
        lines.append(f"config: scenes: {shown(given)} is not allowed; a list of scenes, of: {', '.join(scenes)}")
        names = []
    wrong = [name for name in names if name not in scenes]
    lines += [f"config: scenes: {shown(name)} is no scene; {_nearest(name, scenes)}" for name in wrong]
    if lines:
        raise InputError(lines)
    return {"memory_mb": None, **config, "scenes": list(dict.fromkeys(names))}


def _nearest(name: Any, allowed: Sequence[str]) -> str:
    return f"{guess(str(name), allowed)}allowed: {', '.join(allowed)}"


def check_targets(words: Sequence[str], scenes: Collection[str], rules: Collection[str]) -> None:
    """Raise InputError for a word of the command line that is close to the name of a scene and no other target.

    words : the command line
    rules : names of rules, which are targets too
    """
    lines, known = [], {*scenes, *rules, *FOLDERS}
    for before, word in zip(("", *words), words, strict=False):
        name = scene_of(word)
        is_value = before.startswith("--") and "=" not in before and before not in _FLAGS
        is_target = not (is_value or name in known or name.startswith("-") or "=" in word or Path(word).exists())
        if is_target and difflib.get_close_matches(name, scenes):
            near = _nearest(name, sorted(scenes))
            lines.append(f"{shown(word)} is no target: no scene {shown(name)}; {near}")
    if lines:
        raise InputError(lines)


def scene_of(word: str) -> str:
    """The scene that a target of the command line belongs to: its name, or the folder of a result."""
    parts = Path(word).parts
    return parts[1] if len(parts) > 2 and parts[0] == "results" else word


# A scene is a target of its own name, as these are already.
OF_SEVERAL = ("page_of_scenes", "publish", "one_file", "clean_unused", "store", "scatter_law", "report", "scene_report")
RULES = frozenset({*STAGES, *OF_SEVERAL})
DEFAULT_TARGETS = frozenset({"all", "verify", "results/report.html"})


class Scenes:
    """The scene files of the project and of a caller. Those that a run asks for are checked; others may have mistakes.

    root : the project's folder
    words : the command line; the scenes that it names are asked for, or else the default scenes
    default : scenes that are made without a target
    marks : folder of marks for surfaces that were checked; not given, scans are not read
    own : a folder of scenes of the caller
    writes : whether results will be written

    `refused` holds the mistakes of those that are left out while others run, with --keep-going. Raises InputError with
    every mistake of every scene asked for.
    """

    def __init__(
        self,
        root: Path,
        words: list[str],
        default: Sequence[str] = (),
        marks: Path | None = None,
        own: str | None = None,
        writes: bool = True,
    ) -> None:
        self.root, self.default, self._marks = root, list(default), marks
        given = [(name, folder) for folder in scene_folders(root, own) for name in scene_names(folder)]
        self._folders = dict(given)
        self._twice = {name for name, folder in given if folder != self._folders[name]}
        self.names = sorted(self._folders)
        words = [word for before, word in zip(("", *words), words, strict=False) if before not in QUIET]
        asked = {scene_of(word) for word in words}.intersection(self.names)
        if asks_all := not asked or not DEFAULT_TARGETS.isdisjoint(words):
            asked.update(self.default)
        self.asked = sorted(asked)
        mistakes = {name: self._mistakes(name, writes) for name in self.asked}
        self.asked = [name for name, lines in mistakes.items() if not lines]
        self.refused = {name: lines for name, lines in mistakes.items() if lines}
        others_run = GOES_ON.intersection(words) and self.asked and not (asks_all and self.refused.keys() & {*default})
        if self.refused and not others_run:
            raise InputError(list(dict.fromkeys(line for lines in self.refused.values() for line in lines)))

    def _mistakes(self, name: str, writes: bool = False) -> list[str]:
        """What is wrong with a scene, and with the folders that it writes to."""
        lines = [f"{folder}: cannot be written to" for folder in (not_writable(name) if writes else ())]
        try:
            self[name]
        except InputError as error:
            return [*error.lines, *lines]
        return lines

    @cached_property
    def valid(self) -> list[str]:
        """All scenes without mistakes."""
        return [name for name in self.names if not self._mistakes(name)]

    @cache  # noqa: B019 (one instance lives as long as the run)
    def __getitem__(self, name: str) -> dict[str, Any]:
        """A scene. Raises InputError with every mistake that it has; of one asked for, of its surface too."""
        of_surface = self._of_surface if name in self.asked else None
        scene = checked(name, self._folders[name], self.root, of_surface)
        for one in sorted({name, *scene["origins"].values()} & self._twice):
            file = display(self._folders[one] / f"{one}.yaml")
            raise InputError(f"{file}: a shipped scene has this name; rename the file")
        return scene

    @cache  # noqa: B019
    def stages(self, name: str) -> frozenset[str]:
        """Stages that the targets of the scene need."""
        return frozenset(plan.stages_needed(self[name]))

    def jobs(self, name: str, stage: str) -> list[dict[str, Any]]:
        """The jobs of a stage in the scene, each as the values of the placeholders in the name of its result."""
        if stage not in self.stages(name):
            return []
        if not (batches := STAGES[stage].batches):
            return [{}]
        jobs, counts = [], {design: get(self[name], key) for design, key in batches.items()}
        for design, count in counts.items():
            step = -(-count // max(1, round(get(self[name], "jobs") * count / sum(counts.values()))))
            jobs += [
                {"design": design, "first": first, "last": min(first + step, count)} for first in range(0, count, step)
            ]
        return jobs

    def user_files(self, name: str, key: str) -> list[str]:
        """The files of the user, a scan or records, under a key of the scene."""
        given = _listed(get(self[name], key))
        return [_user_file(self._folders[name], self.root, file) for file in given]

    def _of_surface(self, scene: dict[str, Any], path: Place) -> tuple[list[Mistake], list[str]]:
        """Mistakes and warnings of the surface of a scene, and of the scan or the records that it reads."""
        needed = plan.stages_needed(scene) & {"scan", "record"} if self._marks else ()
        read = [key for stage in needed for key in STAGES[stage].user_files.values()]
        files = {key: [Path(path(file)) for file in _listed(given(scene, key))] for key in read}
        return check_scene(scene, files, self._marks)

    @cache  # noqa: B019
    def warnings(self, name: str) -> list[str]:
        """What is implausible in the scene, before anything is solved."""
        scene, moves = self[name], self.stages(name) & {"answer", "cycles", "stick_slip_map"}
        of_motion = [*inherited(name, scene), *motion_warnings(scene)] if moves else []
        found = of_motion + self._of_surface(scene, lambda file: _user_file(self._folders[name], self.root, file))[1]
        return [with_origins(text, scene["origins"], name) for text in found]


def checked(name: str, folder: Path, root: Path, of_surface: OfSurface | None = None) -> dict[str, Any]:
    """The scene of that name as a run takes it, from its folder: its files, too, have to be there, or in the project.

    of_surface : mistakes of the surface of a scene, and of the scan or the records that it reads, and warnings

    Raises InputError with every mistake of the scene.
    """
    if name in RULES:
        file = display(folder / f"{name}.yaml")
        raise InputError(f"{file}: {name!r} is not allowed as the name of a scene; a step of the workflow has it")

    def path(file: str) -> str:
        return _user_file(folder, root, file)

    def more(scene: dict[str, Any], is_sound: Callable[[str], bool]) -> Iterator[Mistake]:
        radius = given(scene, RADIUS) if is_sound(RADIUS) else 1.0
        yield from [mistake for mistake in _file_mistakes(scene, path, radius) if is_sound(mistake.keys[0])]
        if of_surface and all(map(is_sound, (*SURFACE, "oscillator.law", "friction.record"))) and scene.get("targets"):
            yield from of_surface(with_code(scene), path)[0]

    def with_code(scene: dict[str, Any]) -> dict[str, Any]:
        for key, code in own_code(scene).items():
            file, _, wanted = code.rpartition(":")
            section, _, last = key.partition(".")
            scene = {**scene, section: {**scene[section], last: f"{path(file)}:{wanted}"}}
        return scene

    return with_code(load(name, folder, more))


def _file_mistakes(scene: dict[str, Any], path: Place, radius_m: float | None) -> Iterator[Mistake]:
    """What is wrong with files of the user: one is not there, code without the name, the head of a record.

    radius_m : of the track of records
    """
    own = {key: code.rpartition(":") for key, code in own_code(scene).items()}
    files = [(key, file) for key in USER_FILES for file in _listed(given(scene, key))]
    for key, file in [*files, *((key, file) for key, (file, _, _) in own.items())]:
        if not Path(path(file)).is_file():
            yield Mistake((key,), f"{shown(file)} is not there; a path from the folder of the scenes or of the project")
        elif key in own and (text := _no_such_code(Path(path(file)), own[key][2])):
            yield Mistake((key,), text)
        elif key == "friction.record.file":
            from roughslip.record.reading import HEAD, columns_of  # with numpy

            try:
                columns_of(Path(path(file)), radius_m, HEAD)
            except InputError as error:
                yield from (Mistake((key,), text) for text in error.lines)


def _no_such_code(file: Path, wanted: str) -> str:
    """What is wrong with a file of the user that should have a class or function of that name; empty where it has."""
    try:
        body = ast.parse(file.read_text(encoding="utf-8")).body
    except (SyntaxError, UnicodeDecodeError) as error:
        return f"{display(file)} is no Python: {error}"
    names = [node.name for node in body if isinstance(node, ast.ClassDef | ast.FunctionDef)]
    has = f"has {', '.join(names)}" if names else "has no class or function"
    return "" if wanted in names else f"{display(file)} has no {wanted}; {guess(wanted, names)}it {has}"


def not_writable(name: str) -> list[Path]:
    """The folders that stand in the way of a scene's results, if there are any."""
    results = Path("results")
    below = {Path(stage.makes).parent.as_posix() for stage in STAGES.values()} | {"keys", "logs", "usage"}
    folders = (results, results / "store", results / name, *(results / name / inner for inner in sorted(below - {"."})))
    there = [path for path in folders if os.path.lexists(path)]
    return [path for path in there or [Path()] if not (path.is_dir() and os.access(path, os.W_OK))]


def _listed(given: Any) -> list[str]:
    """The files under a scene key: none, one or several."""
    return given if isinstance(given, list) else [] if given is None else [given]


def _user_file(folder: Path, root: Path, file: str) -> str:
    """The path of a scan or a record from the folder of the scene, else from that of the project."""
    near = folder / file
    return display(near if near.is_file() else root / file)
