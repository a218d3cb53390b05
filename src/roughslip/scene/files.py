"""Scene files: strict YAML, without anchors, tags, repeated keys and numbers that YAML reads oddly; and overlays."""

import os
import re
from collections.abc import Iterator
from copy import deepcopy
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from roughslip.errors import InputError
from roughslip.scene import friction, oscillator, roughness
from roughslip.scene.mistakes import KeyPath, Values, display, given, guess, line, shown
from roughslip.scene.schema import AFTER_COMMA, COMMAS, FLOAT, INTEGER, NAME, WORD

SHIPPED = Path(__file__).resolve().parents[3] / "config" / "scenes"  # in a clone; a wheel has none
RESERVED = frozenset({"reference", "benchmarks", "evidence", "report", "all", "clean", "logs", "usage"})
# Keys that a key of an overlay replaces, where the overlay does not give those too.
REPLACED = {**friction.REPLACES, **roughness.REPLACES, **oscillator.REPLACES}
Wrong = tuple[KeyPath, str]
_CONSTANTS = {"": None, "~": None, "null": None, "true": True, "false": False}


def scene_names(scenes_folder: Path) -> list[str]:
    """Names of all scenes of a folder, sorted."""
    return sorted(file.stem for file in scenes_folder.glob("*.yaml"))


def locate(name: str, scenes_folder: Path) -> Path:
    """The file of a scene by its name, which must be fit for the folder of its results."""
    if not re.fullmatch(WORD, name) or name in RESERVED:
        reason = "it is reserved" if name in RESERVED else NAME
        text = f"{shown(name)} is not allowed as the name of a scene; {reason}"
        raise InputError(f"{display(scenes_folder)}: {text}")
    file, known = scenes_folder / f"{name}.yaml", scene_names(scenes_folder)
    if name not in known:
        raise InputError(f"{display(file)}: no such file; {guess(name, known)}scenes: {', '.join(known)}")
    return file


def read(file: Path) -> tuple[Values, list[Wrong]]:
    """The mapping that a YAML file in UTF-8 holds, and what YAML allows in it and scenes do not: path and text.

    Raises InputError, in one line, where it cannot be read.
    """
    where = display(file)
    try:
        values, wrong = deepcopy(_parsed(file.read_text(encoding="utf-8")))
    except OSError as error:
        raise InputError(f"{where}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{where}: not UTF-8 text; byte {error.start} is {error.object[error.start]:#04x}") from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        at = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        since = f", {error.context}" if error.problem and error.context else ""
        raise InputError(f"{where}: {at}not valid YAML: {error.problem or error.context}{since}") from None
    except (yaml.YAMLError, RecursionError, ValueError, OverflowError) as error:  # the last two for wild \U escapes
        raise InputError(f"{where}: not valid YAML: {' '.join(str(error).split())}") from None
    if not isinstance(values, dict):
        raise InputError(f"{where}: {shown(values)} is not allowed; a scene file holds keys and values")
    return values, wrong


@lru_cache(maxsize=64)
def _parsed(text: str) -> tuple[Any, list[Wrong]]:
    """The only document of a text as dicts, lists, text, numbers, True, False and None; None where it is empty.

    Kept, as scenes extend the same few files. libyaml takes a tenth of the time of PyYAML, where it is there.
    """
    events: Iterator[Any] = yaml.parse(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    next(events)  # the start of the stream
    if isinstance(next(events), yaml.StreamEndEvent):
        return None, []
    wrong: list[Wrong] = []
    value = _value(next(events), events, (), wrong)
    next(events)  # the end of the document
    if not isinstance(further := next(events), yaml.StreamEndEvent):
        raise yaml.MarkedYAMLError(problem="another document", problem_mark=further.start_mark)
    return value, wrong


def _value(event: Any, events: Iterator[Any], path: KeyPath, wrong: list[Wrong]) -> Any:
    """The value that an event begins. Each is written out: an alias can make a small file endless.

    A decimal comma makes two keys of `{a: 1,39e-5}`: they are put together again as one text, which is refused as a
    number. A repeated key, which PyYAML lets win, is added to what is wrong; groups of the same name are put together.
    """
    if isinstance(event, yaml.AliasEvent) or event.anchor is not None or event.tag is not None:
        wrong.append((path, f"line {event.start_mark.line + 1}: write the value out, without anchor, alias or tag"))
    if isinstance(event, yaml.AliasEvent):
        return None
    if isinstance(event, yaml.ScalarEvent):
        return _scalar(event)
    if isinstance(event, yaml.SequenceStartEvent):
        items: list[Any] = []
        while not isinstance(item := next(events), yaml.SequenceEndEvent):
            items.append(_value(item, events, (*path, len(items)), wrong))
        return items
    values: dict[str, Any] = {}
    last = ""
    while not isinstance(key := next(events), yaml.MappingEndEvent):
        if not hasattr(key, "value"):  # a group, a list or an alias
            raise yaml.MarkedYAMLError(problem="a key is a plain word", problem_mark=key.start_mark)
        name, is_bare = key.value, not key.style and AFTER_COMMA.fullmatch(key.value)
        value = _value(next(events), events, (*path, name), wrong)
        if value is None and is_bare and COMMAS.match(f"{values.get(last)},".replace(".", "")):
            values[last] = f"{values[last]},{name}"
        elif name in values:
            wrong.append(((*path, name), f"line {key.start_mark.line + 1}: given before; give it once"))
            if isinstance(value, dict) and isinstance(values[name], dict):
                values[name] = {**value, **values[name]}
        else:
            values[name], last = value, name
    return values


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


class Merged:
    """The values of overlaid files, and for each key the file that gave it last."""

    def __init__(self, top: Path) -> None:
        self.values: Values = {}
        self.wrong: list[tuple[Path, KeyPath, str]] = []  # files, with paths and texts
        self.unread: list[str] = []  # lines on a base that is not known
        self._files: dict[KeyPath, Path] = {(): top}

    def file_of(self, path: KeyPath) -> Path:
        """The file that gave the value at this path or, where there is none, what is around it."""
        return next(self._files[path[:n]] for n in range(len(path), -1, -1) if path[:n] in self._files)

    def origins(self, values: Values) -> dict[str, str]:
        """By dotted key, the scene that gives each value."""
        keys = (key for key in _keys(values) if not isinstance(given(values, key), dict))
        return {key: self.file_of(tuple(key.split("."))).stem for key in keys}

    def overlay(self, file: Path, values: Values) -> None:
        """Mappings merge; numbers, text and lists replace; a key drops those that it takes the place of."""
        own = set(_keys(values))
        for replaced in {old for key in own for old in REPLACED.get(key, ())} - own:
            section, _, name = replaced.rpartition(".")
            inner = given(self.values, section) if section else self.values
            if isinstance(inner, dict):
                inner.pop(name, None)
        self._merge(self.values, values, file, ())

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


def read_chain(top: Path, scenes_folder: Path) -> tuple[list[Path], Merged]:
    """The files of a scene from the top of its overlays down, and their values merged, as far as they can be read."""
    known = {file.stem: file for folder in (SHIPPED, scenes_folder) for file in sorted(folder.glob("*.yaml"))}
    chain, documents, merged = [top], list[Values](), Merged(top)
    try:
        while len(documents) < len(chain):
            values, wrong = read(chain[-1])
            values |= friction.with_listed_records(values)
            documents.append(values)
            merged.wrong += [(chain[-1], *one) for one in wrong]
            if "extends" in values:
                chain.append(_base(values.pop("extends"), known, chain))
    except InputError as error:
        merged.unread += error.lines
    for file, values in reversed([*zip(chain, documents, strict=False)]):
        merged.overlay(file, values)
    return chain, merged


def _base(name: Any, known: dict[str, Path], chain: list[Path]) -> Path:
    """The file of the scene that the last one of a chain extends."""
    if str(name) not in known:
        text = f"{guess(str(name), sorted(known))}scenes: {', '.join(sorted(known))}"
    elif os.path.realpath(known[name]) in map(os.path.realpath, chain):
        text = f"overlays run in a circle: {' -> '.join(link.stem for link in [*chain, known[name]])}"
    else:
        return known[name]
    raise InputError(line(chain[-1], ("extends",), f"{shown(name)} is not allowed; {text}"))
