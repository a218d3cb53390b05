"""Scene files: strict YAML, overlays, a closed schema and rules across keys; all mistakes come at once, a line each.

A line reads `file: key: what was given and what is allowed`. No stage imports this module.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from copy import deepcopy
from functools import lru_cache
from pathlib import Path
from typing import Any, cast

import yaml

from roughslip.errors import InputError
from roughslip.scene import (
    contact,
    ensemble,
    expansion,
    friction,
    oscillator,
    plan,
    roughness,
    uncertain,
)
from roughslip.scene.fields import WORD
from roughslip.scene.mistakes import KeyPath, Mistake, Values, display, given, line, missing, refused, shown
from roughslip.scene.schema import FLOAT, INTEGER, NAME, nearest, refusals, scene_schema, with_floats
from roughslip.scene.types import get

SHIPPED = Path(__file__).resolve().parents[3] / "config" / "scenes"  # in a clone; a wheel has none
RESERVED = frozenset({"reference", "benchmarks", "evidence", "report", "all", "clean", "logs", "usage"})
LONGEST = 200  # characters of a description
LARGEST_FILE = 100_000  # bytes
_CONSTANTS = {"": None, "~": None, "null": None, "true": True, "false": False}

# What the modules of the sections say of several keys: rules, mistakes of forms that exclude each other, and keys that
# a key of an overlay replaces, where the overlay does not give those too.
_RULES = tuple(rule for part in (contact, expansion, roughness, oscillator, ensemble) for rule in part.RULES)
_FORMS = (friction, contact, ensemble, roughness, oscillator)
_REPLACED = {key: replaced for part in _FORMS for key, replaced in part.REPLACES.items()}


def load(name_or_path: str | Path, scenes_folder: Path) -> Values:
    """The scene of a name, or of a file anywhere, with its overlays merged and every rule checked.

    name_or_path : a scene of scenes_folder by its name, or a scene file: a Path, or text with a / or ending in .yaml
    scenes_folder : folder of the names; a name after `extends` may also be that of a shipped scene

    Returns the scene as nested dicts, without `extends`, and with what follows from its load; a key that
    takes a `number` holds a float. `types.scene_of` makes an object of it. Raises InputError with a line per mistake.
    """
    schema = scene_schema()
    chain, merged = read_chain(_locate(name_or_path, scenes_folder), scenes_folder)
    lines: list[str] = []

    def topmost(paths: list[KeyPath]) -> Path:
        """Of the overlaid files that gave these values, the one that the user most likely edits."""
        return min((merged.file_of(path) for path in paths), key=chain.index)

    uncertainties, wrong = uncertain.taken_apart(merged.values, schema)
    lines += [line(topmost([path]), path, text) for path, text in wrong]
    if merged.file_of(("targets",)) != chain[0] and isinstance(merged.values["targets"], list):
        merged.values["targets"] = plan.default_targets(merged.values, bool(uncertainties))
    if merged.values.get("load") is not None and isinstance(merged.values.get("targets"), list):
        merged.values["targets"] = friction.targets_under_load(merged.values["targets"])
    faulty = set()
    for path, text, is_refused in refusals(merged.values, schema):
        if is_refused:
            faulty.add(".".join(map(str, path)))
        lines.append(line(topmost([path]), path, text))
    for keys, text in _mistakes(_without(faulty, merged.values), faulty):
        paths: list[KeyPath] = [tuple(key.split(".")) for key in keys]
        lines.append(line(topmost(paths), paths[0], text))
    if lines:
        raise InputError(list(dict.fromkeys(lines)))
    whole = oscillator.with_frequency(merged.values)
    whole = friction.with_load(cast(Values, with_floats(whole, schema)))
    return whole | ({"standard_uncertainties": uncertainties} if uncertainties else {})


def _mistakes(scene: Values, faulty: set[str]) -> Iterator[Mistake]:
    """What the targets lack, forms that exclude each other, and every rule across keys that the scene breaks.

    scene : the merged scene, with None for every value that the schema refused
    faulty : dotted keys that the schema refused; rules that read them, or anything in or around them, are left out
    """

    def sound(key: str) -> bool:
        return not any(f"{bad}.".startswith(f"{key}.") or f"{key}.".startswith(f"{bad}.") for bad in faulty)

    absent = plan.lacking(scene) if sound("targets") else {}
    for key, targets in ((key, targets) for key, targets in absent.items() if sound(key)):
        reason = f"needed for {', '.join(targets)}"
        if key != "friction.mean_at_median":
            yield missing(reason, key, "targets")
        elif given(scene, friction.STATISTICS) is not None:  # else the rules of friction report it
            yield missing(f"{reason}, for which friction.statistics is no substitute", key, "targets")
    for part in _FORMS:
        yield from (mistake for mistake in part.mistakes(scene) if all(map(sound, mistake.keys)))
    unread = plan.sections_not_read(scene) if scene.get("targets") and sound("targets") else set()
    whole = oscillator.with_frequency(scene)
    for keys, holds, allowed in _RULES:
        if "load" in scene and contact.EXTRAPOLATE in keys:  # which is of strips
            continue
        if not (unread.isdisjoint(key.partition(".")[0] for key in keys) and all(map(sound, keys))):
            continue
        values = [get(whole, key) for key in keys]
        if None not in values and not holds(*values):
            words = (shown(value) if isinstance(value, list) else value for value in values)
            yield refused(values[0], allowed.format(*words), *keys)


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
            *section, name = replaced.split(".")
            _inside(self.values, section).pop(name, None)
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


def _inside(values: Values, section: list[str]) -> Values:
    """The section of that name; empty where there is none."""
    for name in section:
        inner = values.get(name)
        values = inner if isinstance(inner, dict) else {}
    return values


def _locate(name_or_path: str | Path, scenes_folder: Path) -> Path:
    """The file of a scene by name or path; the name must be fit for the folder of its results."""
    given = str(name_or_path)
    is_path = isinstance(name_or_path, Path) or given.endswith(".yaml") or "/" in given
    name = Path(given).stem if is_path else given
    where = display(Path(given) if is_path else scenes_folder)
    if not re.fullmatch(WORD, name):
        raise InputError(f"{where}: {shown(name)} is not allowed as the name of a scene; {NAME}")
    if name in RESERVED:
        raise InputError(f"{where}: {shown(name)} is not allowed as the name of a scene; it is reserved")
    if is_path:
        return Path(given)
    file = scenes_folder / f"{name}.yaml"
    if not file.is_file():
        raise InputError(f"{display(file)}: no such file; {nearest(name, scene_names(scenes_folder), 'scenes')}")
    return file


def _stay_inside(file: Path) -> None:
    """Refuses a link that leads out of the folder of the scenes: what is read should be what the project shows."""
    real = os.path.realpath(file)  # of a link to itself, too
    if file.is_symlink() and not Path(real).is_relative_to(os.path.realpath(file.parent)):
        raise InputError(f"{display(file)}: a link to {shown(real)}, out of its folder; copy the file")


def read_chain(top: Path, scenes_folder: Path) -> tuple[list[Path], Merged]:
    """Files of a scene from the top of its overlays down, and their values merged."""
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
            text = f"{shown(base)} is not allowed; {nearest(str(base), sorted(known), 'scenes')}"
            raise InputError([line(file, ("extends",), text)])
        chain.append(known[base])
        if os.path.realpath(chain[-1]) in map(os.path.realpath, chain[:-1]):
            text = f"{shown(base)} is not allowed; overlays run in a circle: {' -> '.join(link.stem for link in chain)}"
            raise InputError([line(file, ("extends",), text)])
    merged = Merged(top)
    for file, values in zip(reversed(chain), reversed(documents), strict=True):
        merged.overlay(file, values)
    return chain, merged


def _without(faulty: set[str], value: Any, path: str = "") -> Any:
    """The scene with None for every value that the schema refused, and for lists with a refused item."""
    if path in faulty or (isinstance(value, list) and any(bad.startswith(f"{path}.") for bad in faulty)):
        return None
    if isinstance(value, dict):
        return {key: _without(faulty, item, f"{path}.{key}" if path else key) for key, item in value.items()}
    return value


def read(file: Path) -> dict[str, Any]:
    """The mapping that a YAML file in UTF-8 holds. Raises InputError, in one line, where it cannot be read."""
    where = display(file)
    try:
        if not file.is_file():
            raise InputError(f"{where}: no such file")
        with file.open("rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
    except OSError as error:
        raise InputError(f"{where}: cannot be read: {error.strerror}") from None
    if len(content) > LARGEST_FILE:
        raise InputError(f"{where}: larger than {LARGEST_FILE} bytes, which no scene needs")
    try:
        values = deepcopy(_parsed(content.decode("utf-8")))
    except UnicodeDecodeError as error:
        raise InputError(f"{where}: not UTF-8 text; byte {error.start} is {content[error.start]:#04x}") from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        at = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        begun = error.context_mark
        since = f", {error.context} that begins in line {begun.line + 1}" if error.problem and begun else ""
        raise InputError(f"{where}: {at}not valid YAML: {error.problem or error.context}{since}") from None
    except RecursionError:
        raise InputError(f"{where}: not valid YAML: nested too deeply") from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # PyYAML raises the last two for wild \U escapes
        raise InputError(f"{where}: not valid YAML: {' '.join(str(error).split())}") from None
    if values is None:
        raise InputError(f"{where}: empty; a scene file holds keys and values")
    if not isinstance(values, dict):
        raise InputError(f"{where}: {shown(values)} is not allowed; a scene file holds keys and values")
    return values


@lru_cache(maxsize=64)
def _parsed(text: str) -> Any:
    """What a document holds; None where it is empty. Kept, as scenes extend the same few files.

    libyaml takes a tenth of the time of PyYAML, where it is there. A mistake is told in the words of PyYAML.
    """
    try:
        return _document(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except yaml.YAMLError:
        return _document(text, yaml.SafeLoader)


def _document(text: str, loader: type[yaml.SafeLoader]) -> Any:
    """The only document of a text as dicts, lists, text, numbers, True, False and None."""
    events: Iterator[Any] = yaml.parse(text, Loader=loader)
    next(events)  # the start of the stream
    start = next(events)
    if isinstance(start, yaml.StreamEndEvent):
        return None
    value = _value(next(events), events)
    next(events)  # the end of the document
    if not isinstance(further := next(events), yaml.StreamEndEvent):
        text = "expected a single document in the stream"
        raise yaml.MarkedYAMLError(text, start.start_mark, "but found another document", further.start_mark)
    return value


def _value(event: Any, events: Iterator[Any]) -> Any:
    """The value that an event begins. Each is written out: an alias can make a small file endless.

    PyYAML lets a repeated key win without a word. Raises MarkedYAMLError for it, and for a key that is no plain word.
    """
    if isinstance(event, yaml.AliasEvent) or event.anchor is not None or event.tag is not None:
        raise _mistake("write the value out, without anchor, alias or tag", event)
    if isinstance(event, yaml.ScalarEvent):
        return _scalar(event)
    if isinstance(event, yaml.SequenceStartEvent):
        items = []
        while not isinstance(item := next(events), yaml.SequenceEndEvent):
            items.append(_value(item, events))
        return items
    values: dict[str, Any] = {}
    while not isinstance(key := next(events), yaml.MappingEndEvent):
        if isinstance(key, yaml.CollectionStartEvent):
            raise _mistake("a key is a plain word", key)
        _value(key, events)  # refuses an alias
        if key.value in values:
            raise _mistake(f"{shown(key.value)} is given before; give it once", key)
        values[key.value] = _value(next(events), events)
    return values


def _mistake(problem: str, event: Any) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=event.start_mark)


def _scalar(event: yaml.ScalarEvent) -> Any:
    """PyYAML reads 010 as 8 and 1:30 as 90. What does not look like a plain decimal number (1e9, .inf) stays text."""
    text = event.value
    if event.style:  # quoted, or a block of text
        return text
    if text in _CONSTANTS:
        return _CONSTANTS[text]
    if INTEGER.fullmatch(text):
        return int(text)
    return float(text) if FLOAT.fullmatch(text) else text
