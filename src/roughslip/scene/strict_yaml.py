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
_DEEPEST = 12  # mappings and lists within each other


class Misread:
    """Stands for a value that could not be read and has its line already; the schema has nothing to add."""

    def __repr__(self) -> str:
        return "..."


def read(file: Path) -> tuple[dict[str, Any], list[tuple[KeyPath, str]]]:
    """The mapping that a YAML file in UTF-8 holds, and what in it was misread: the key and the text of each line.

    Raises InputError where there is nothing to go on with.
    """
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
        parsed = _parsed(content.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise InputError(f"{where}: not UTF-8 text; byte {error.start} is {content[error.start]:#04x}") from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        at = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        begun = error.context_mark
        since = f", {error.context} that begins in line {begun.line + 1}" if error.problem and begun else ""
        raise InputError(f"{where}: {at}not valid YAML: {error.problem or error.context}{since}") from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # PyYAML raises the last two for wild \U escapes
        raise InputError(f"{where}: not valid YAML: {' '.join(str(error).split())}") from None
    if parsed is None:
        raise InputError(f"{where}: empty; a scene file holds keys and values")
    values, misread = deepcopy(parsed)
    if not isinstance(values, dict):
        raise InputError(f"{where}: {shown(values)} is not allowed; a scene file holds keys and values")
    return values, misread


@lru_cache(maxsize=64)
def _parsed(text: str) -> tuple[Any, list[tuple[KeyPath, str]]] | None:
    """What a document holds, and what in it was misread; None where it is empty.

    Kept, as scenes extend the same few files, and PyYAML takes some 20 ms for each.
    """
    loader = _StrictLoader(text)
    node = loader.get_single_node()
    return None if node is None else (loader.values(node), loader.misread)


class _StrictLoader(yaml.SafeLoader):
    """YAML without anchors, aliases, tags, repeated keys, octal or sexagesimal numbers, and of bounded depth.

    PyYAML lets a repeated key win without a word and reads 010 as 8 and 1:30 as 90; an alias can make a small file
    endless. What does not look like a plain decimal number (1e9, .inf) stays text, and the schema refuses it.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.misread: list[tuple[KeyPath, str]] = []
        self._refused: dict[int, str] = {}  # id of a node: the anchor, alias or tag that it was written with
        self._depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """The next node; an alias becomes an empty one, an anchor or a tag is dropped, and all three are noted."""
        event = self.peek_event()
        node: yaml.Node | None
        if isinstance(event, yaml.AliasEvent):
            self.get_event()
            node = yaml.ScalarNode("", "", event.start_mark, event.end_mark)  # type: ignore[arg-type]
            self._refused[id(node)] = f"*{event.anchor}"
            return node
        written = f"&{event.anchor}" if event.anchor is not None else event.tag
        event.anchor = event.tag = None
        self._depth += 1
        if self._depth > _DEEPEST:
            raise yaml.MarkedYAMLError(problem=f"nested deeper than {_DEEPEST}", problem_mark=event.start_mark)
        node = super().compose_node(parent, index)
        self._depth -= 1
        if written is not None:
            self._refused[id(node)] = written
        return node

    def values(self, node: yaml.Node, path: KeyPath = ()) -> Any:
        """The node as dicts, lists, text, numbers, True, False and None; what is misread is noted under its path."""
        if (written := self._refused.get(id(node))) is not None:
            self.misread.append((path, f"{written} is not allowed; write the value out (no anchor, alias or tag)"))
            return Misread()
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, path)
        if isinstance(node, yaml.ScalarNode):
            return _scalar(node)
        return [self.values(item, (*path, number)) for number, item in enumerate(node.value)]

    def _mapping(self, node: yaml.MappingNode, path: KeyPath) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for key_node, value_node in node.value:
            line = f"line {key_node.start_mark.line + 1}"
            if not isinstance(key_node, yaml.ScalarNode) or id(key_node) in self._refused:
                self.misread.append((path, f"the key in {line} is not allowed; a key is a plain word"))
                continue
            key = key_node.value
            value = self.values(value_node, (*path, key))
            if key in values:
                self.misread.append(((*path, key), f"{shown(value)} in {line} repeats the key; give it once"))
            else:
                values[key] = value
        return values


def _scalar(node: yaml.ScalarNode) -> Any:
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
