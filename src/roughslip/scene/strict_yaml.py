"""Strict YAML for scene files, and the lines that describe its mistakes."""

from __future__ import annotations

import re
from copy import deepcopy
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from roughslip.errors import InputError
from roughslip.scene.mistakes import shown

KeyPath = tuple[str | int, ...]

INTEGER = re.compile(r"[-+]?(0|[1-9][0-9]{0,30})")
FLOAT = re.compile(r"[-+]?([0-9]+\.[0-9]*|\.[0-9]+)([eE][-+][0-9]+)?")
_CONSTANTS = {"": None, "~": None, "null": None, "true": True, "false": False}
_LARGEST_FILE = 100_000  # bytes


def read(file: Path) -> dict[str, Any]:
    """The mapping that a YAML file in UTF-8 holds. Raises InputError, in one line, where it cannot be read."""
    where = display(file)
    try:
        if not file.is_file():
            raise InputError(f"{where}: no such file")
        with file.open("rb") as stream:
            content = stream.read(_LARGEST_FILE + 1)
    except OSError as error:
        raise InputError(f"{where}: cannot be read: {error.strerror}") from None
    if len(content) > _LARGEST_FILE:
        raise InputError(f"{where}: larger than {_LARGEST_FILE} bytes, which no scene needs")
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
    """What a document holds; None where it is empty.

    Kept, as scenes extend the same few files, and PyYAML takes some 20 ms for each.
    """
    node = _Loader(text).get_single_node()
    return None if node is None else _value(node)


class _Loader(yaml.SafeLoader):
    """YAML in which each value is written out: an alias can make a small file endless, and a tag another object."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        event = self.peek_event()
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None or event.tag is not None:
            problem = "write the value out, without anchor, alias or tag"
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=event.start_mark)
        return super().compose_node(parent, index)


def _value(node: yaml.Node) -> Any:
    """The node as dicts, lists, text, numbers, True, False and None.

    PyYAML lets a repeated key win without a word. Raises MarkedYAMLError for it, and for a key that is no plain word.
    """
    if isinstance(node, yaml.ScalarNode):
        return _scalar(node)
    if not isinstance(node, yaml.MappingNode):
        return [_value(item) for item in node.value]
    values: dict[str, Any] = {}
    for key, value in node.value:
        if not isinstance(key, yaml.ScalarNode):
            raise yaml.MarkedYAMLError(problem="a key is a plain word", problem_mark=key.start_mark)
        if key.value in values:
            raise yaml.MarkedYAMLError(
                problem=f"{shown(key.value)} is given before; give it once", problem_mark=key.start_mark
            )
        values[key.value] = _value(value)
    return values


def _scalar(node: yaml.ScalarNode) -> Any:
    """PyYAML reads 010 as 8 and 1:30 as 90. What does not look like a plain decimal number (1e9, .inf) stays text."""
    text = node.value
    if node.style is not None:  # quoted, or a block of text
        return text
    if text in _CONSTANTS:
        return _CONSTANTS[text]
    if INTEGER.fullmatch(text):
        return int(text)
    return float(text) if FLOAT.fullmatch(text) else text


def line(file: Path, path: KeyPath, text: str) -> str:
    """`config/scenes/mine.yaml: strip.cell_m: text`"""
    words = [f"[{part}]" if isinstance(part, int) else f".{_word(part)}" for part in path]
    return ": ".join([display(file), *(["".join(words)[1:]] if words else []), text])


def display(file: Path) -> str:
    """The path as a user sees it: from the working folder, where the file lies in it."""
    return str(file.relative_to(Path.cwd()) if file.is_relative_to(Path.cwd()) else file)


def _word(key: str) -> str:
    return key if re.fullmatch(r"[\w-]{1,60}", key) else shown(key)
