"""Scene files: overlays, a check of each section and rules across keys; all mistakes come at once, a line each.

A line reads `file: key: what was given and what is allowed`. No stage imports this module.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from roughslip.errors import InputError
from roughslip.scene import contact, friction, oscillator, roughness, uncertain
from roughslip.scene.mistakes import KeyPath, Mistake, Values, display, given, guess, line, missing, refused, shown
from roughslip.scene.schema import NAME, WORD, refusals, scene_schema
from roughslip.scene.types import File, get
from roughslip.scene.yaml_text import read
from roughslip.study import plan

SHIPPED = Path(__file__).resolve().parents[3] / "config" / "scenes"  # in a clone; a wheel has none
RESERVED = frozenset({"reference", "benchmarks", "evidence", "report", "all", "clean", "logs", "usage"})

# What the modules of the sections say of several keys: rules, mistakes of forms that exclude each other, and keys that
# a key of an overlay replaces, where the overlay does not give those too.
_SECTIONS = (contact, friction, roughness, oscillator)
_RULES = tuple(rule for part in _SECTIONS for rule in part.RULES)
_REPLACED = {key: replaced for part in _SECTIONS for key, replaced in part.REPLACES.items()}


def load(name_or_path: str | Path, scenes_folder: Path) -> Values:
    """The scene of a name, or of a file anywhere, with its overlays merged and every rule checked.

    name_or_path : a scene of scenes_folder by its name, or a scene file: a Path, or text with a / or ending in .yaml
    scenes_folder : folder of the names; a name after `extends` may also be that of a shipped scene

    Returns the scene as nested dicts, without `extends`, and with what follows from its load; a key that takes a
    real number holds a float. `types.scene_of` makes an object of it. Raises InputError with a line per mistake.
    """
    chain, merged = read_chain(_locate(name_or_path, scenes_folder), scenes_folder)
    values = merged.values
    uncertainties, wrong = uncertain.taken_apart(values, scene_schema())
    if merged.file_of(("targets",)) != chain[0] and isinstance(values.get("targets"), list):
        values["targets"] = plan.default_targets(values, bool(uncertainties))
    if values.get("load") is not None and isinstance(values.get("targets"), list):
        values["targets"] = friction.targets_under_load(values["targets"])
    found = [(path, text, False) for path, text in wrong] + _refusals(values)
    faulty = {".".join(map(str, path)) for path, _, is_value in found if is_value}
    lines = [line(merged.file_of(path), path, text) for path, text, _ in found]
    for keys, text in _mistakes(_without(faulty, values), faulty):
        paths: list[KeyPath] = [tuple(key.split(".")) for key in keys]
        topmost = min(map(merged.file_of, paths), key=chain.index)  # the one that the user most likely edits
        lines.append(line(topmost, paths[0], text))
    if lines:
        raise InputError(list(dict.fromkeys(lines)))
    whole = File.model_validate(values).model_dump(mode="json", exclude_unset=True)
    whole = friction.with_load(whole)
    return whole | ({"standard_uncertainties": uncertainties} if uncertainties else {})


def _refusals(values: Values) -> list[tuple[KeyPath, str, bool]]:
    """What the sections refuse: the path, the text of its line, and whether there is a value."""
    errors: list[Any] = [{"type": "null", "loc": path} for path in _nulls(values)]
    try:
        File.model_validate(values)
    except ValidationError as error:
        errors += error.errors(include_url=False, include_context=False)
    return list(refusals(errors, values))


def _nulls(values: Any, path: KeyPath = ()) -> Iterator[KeyPath]:
    """Where a mapping holds no value."""
    for key, value in values.items() if isinstance(values, dict) else ():
        if value is None:
            yield (*path, key)
        yield from _nulls(value, (*path, key))


def _mistakes(scene: Values, faulty: set[str]) -> Iterator[Mistake]:
    """What the targets lack, forms that exclude each other, and every rule across keys that the scene breaks.

    scene : the merged scene, with None for every value that was refused
    faulty : dotted keys that were refused; rules that read them, or anything in or around them, are left out
    """

    def sound(key: str) -> bool:
        return not any(f"{bad}.".startswith(f"{key}.") or f"{key}.".startswith(f"{bad}.") for bad in faulty)

    absent = plan.lacking(scene) if sound("targets") else {}
    for key, targets in ((key, targets) for key, targets in absent.items() if sound(key)):
        if key != friction.MEAN or given(scene, friction.RECORD) is not None:  # else the rules of friction report it
            yield missing(f"needed for {', '.join(targets)}", key, "targets")
    for part in (friction, roughness, oscillator):
        yield from (mistake for mistake in part.mistakes(scene) if all(map(sound, mistake.keys)))
    unread = plan.sections_not_read(scene) if scene.get("targets") and sound("targets") else set()
    for keys, holds, allowed in _RULES:
        if not (unread.isdisjoint(key.partition(".")[0] for key in keys) and all(map(sound, keys))):
            continue
        values = [get(scene, key) for key in keys]
        if None not in values and not holds(*values):
            words = (shown(value) if isinstance(value, list) else value for value in values)
            yield refused(values[0], allowed.format(*words), *keys)


def _without(faulty: set[str], value: Any, path: str = "") -> Any:
    """The scene with None for every value that was refused, and for lists with a refused item."""
    if path in faulty or (isinstance(value, list) and any(bad.startswith(f"{path}.") for bad in faulty)):
        return None
    if isinstance(value, dict):
        return {key: _without(faulty, item, f"{path}.{key}" if path else key) for key, item in value.items()}
    return value


def scene_names(scenes_folder: Path) -> list[str]:
    """Names of all scenes of a folder, sorted."""
    return sorted(file.stem for file in scenes_folder.glob("*.yaml"))


class Merged:
    """The values of overlaid files, and for each key the file that gave it last."""

    def __init__(self, top: Path) -> None:
        self.values: Values = {}
        self._files: dict[KeyPath, Path] = {(): top}

    def file_of(self, path: KeyPath) -> Path:
        """The file that gave the value at this path or, where there is none, what is around it."""
        return next(self._files[path[:n]] for n in range(len(path), -1, -1) if path[:n] in self._files)

    def overlay(self, file: Path, given: Values) -> None:
        """Mappings merge; numbers, text and lists replace; a key drops those that it takes the place of."""
        own = set(_keys(given))
        for replaced in {old for key in own for old in _REPLACED.get(key, ())} - own:
            section, _, name = replaced.rpartition(".")
            inside = self.values if not section else _inside(self.values, section)
            inside.pop(name, None)
        self._merge(self.values, given, file, ())

    def _merge(self, base: Values, given: Values, file: Path, path: KeyPath) -> None:
        for key, value in given.items():
            here = (*path, key)
            self._files[here] = file
            if isinstance(value, dict):
                if not isinstance(base.get(key), dict):
                    base[key] = {}
                self._merge(base[key], value, file, here)
            else:
                base[key] = value


def _keys(values: Values) -> Iterator[str]:
    """Dotted keys of the sections and of what they hold."""
    for name, value in values.items():
        yield name
        yield from (f"{name}.{key}" for key in _keys(value)) if isinstance(value, dict) else ()


def _inside(values: Values, section: str) -> Values:
    """The section of that name; empty where there is none."""
    inner = given(values, section)
    return inner if isinstance(inner, dict) else {}


def _locate(name_or_path: str | Path, scenes_folder: Path) -> Path:
    """The file of a scene by name or path; the name must be fit for the folder of its results."""
    given = str(name_or_path)
    is_path = isinstance(name_or_path, Path) or given.endswith(".yaml") or "/" in given
    name = Path(given).stem if is_path else given
    where = display(Path(given) if is_path else scenes_folder)
    if not re.fullmatch(WORD, name) or name in RESERVED:
        reason = "it is reserved" if name in RESERVED else NAME
        raise InputError(f"{where}: {shown(name)} is not allowed as the name of a scene; {reason}")
    if is_path:
        return Path(given)
    file, known = scenes_folder / f"{name}.yaml", scene_names(scenes_folder)
    if name not in known:
        raise InputError(f"{display(file)}: no such file; {guess(name, known)}scenes: {', '.join(known)}")
    return file


def _stay_inside(file: Path) -> None:
    """Refuses a link that leads out of the folder of the scenes: what is read should be what the project shows."""
    real = os.path.realpath(file)  # of a link to itself, too
    if file.is_symlink() and not Path(real).is_relative_to(os.path.realpath(file.parent)):
        raise InputError(f"{display(file)}: a link to {shown(real)}, out of its folder; copy the file")


def read_chain(top: Path, scenes_folder: Path) -> tuple[list[Path], Merged]:
    """The files of a scene from the top of its overlays down, and their values merged."""
    known = {file.stem: file for folder in (SHIPPED, scenes_folder) for file in sorted(folder.glob("*.yaml"))}
    chain = [top]
    documents: list[Values] = []
    while len(documents) < len(chain):
        file = chain[-1]
        _stay_inside(file)
        values = read(file)
        values |= friction.with_listed_records(values)
        documents.append(values)
        if "extends" not in values:
            break
        base = values.pop("extends")
        if base not in known:
            names = sorted(known)
            text = f"{shown(base)} is not allowed; {guess(str(base), names)}scenes: {', '.join(names)}"
            raise InputError(line(file, ("extends",), text))
        chain.append(known[base])
        if os.path.realpath(chain[-1]) in map(os.path.realpath, chain[:-1]):
            text = f"{shown(base)} is not allowed; overlays run in a circle: {' -> '.join(link.stem for link in chain)}"
            raise InputError(line(file, ("extends",), text))
    merged = Merged(top)
    for file, values in zip(reversed(chain), reversed(documents), strict=True):
        merged.overlay(file, values)
    return chain, merged
