"""Scene files as text: strict YAML, without anchors, tags, repeated keys and numbers that YAML reads oddly."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from roughslip.errors import InputError
from roughslip.scene.mistakes import display, shown
from roughslip.scene.schema import FLOAT, INTEGER

LARGEST_FILE = 100_000  # bytes
_CONSTANTS = {"": None, "~": None, "null": None, "true": True, "false": False}


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
