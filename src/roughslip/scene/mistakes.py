"""Mistakes of scenes, the rules that find them, and values in the words of a scene file."""

import difflib
import re
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from roughslip.limits import MOST_NUMBERS

Values = dict[str, Any]  # a scene, or a part of one, as nested dicts
KeyPath = tuple[str | int, ...]


class Mistake(NamedTuple):
    """keys : the dotted keys involved, the one to name first; text : what is wrong with it and what is allowed"""

    keys: tuple[str, ...]
    text: str


class Exclusion(Mistake):
    """The mistake of a key that the others exclude by being given, with any value."""


class Rule(NamedTuple):
    """A condition on the values of several keys, for scenes that give all of them or have a default."""

    keys: tuple[str, ...]  # of the values that `holds` takes; the first is the one refused
    holds: Callable[..., bool]
    allowed: str  # a format of the same values


def fits(keys: tuple[str, ...], count: Callable[..., float], words: str, most: int = MOST_NUMBERS) -> Rule:
    """The rule of a table that fits into memory. count : its numbers, from the values of the keys; words : the same"""
    return Rule(keys, lambda *values: count(*values) <= most, f"{words} at most {most}, which fit into memory")


def is_increasing(values: Sequence[float]) -> bool:
    """Whether each number exceeds the one before it."""
    return all(low < high for low, high in pairwise(values))


def refused(value: Any, allowed: str, *keys: str) -> Mistake:
    """The mistake of a value, by what is allowed. keys : its own first, then those that limit it."""
    return Mistake(keys, f"{shown(value)} is not allowed; {allowed}")


def missing(reason: str, *keys: str) -> Mistake:
    """The mistake of an absent key. keys : its own first, then those that need it."""
    return Mistake(keys, f"missing; {reason}")


def not_together(scene: Values, key: str, other: str) -> Exclusion:
    """The mistake of a key that another one excludes."""
    return Exclusion((key, other), f"{shown(given(scene, key))} is not allowed together with {other}; give one")


def dotted(path: KeyPath) -> str:
    """`strip.cell_m` of its parts."""
    return ".".join(map(str, path))


def given(scene: Values, key: str) -> Any:
    """The value that a scene gives under a dotted key; None where it gives none, or where it was refused."""
    value: Any = scene
    for part in key.split("."):
        if not isinstance(value, dict) or part not in value:
            return None
        value = value[part]
    return value


def shown(value: Any) -> str:
    """A value as a user would write it, on one line and of bounded length."""
    match value:
        case None:
            text = "no value"
        case bool():
            text = str(value).lower()
        case dict():
            text = "a number with a standard uncertainty" if "standard_uncertainty" in value else "a group of keys"
        case list():
            text = "[" + ", ".join(shown(item) for item in value[:20]) + (", ...]" if len(value) > 20 else "]")
        case _:
            text = repr(value)
    return text if len(text) <= 80 else f"{text[:76]} ..."


def with_origins(text: str, origins: Mapping[str, str], name: str) -> str:
    """A warning with the scene of each value that it writes as `key = value`, where that is not the scene itself."""
    for key in (key for key, origin in origins.items() if origin != name and f"{key} =" in text):
        text = text.replace(f"{key} =", f"{key} of scene {origins[key]} =")
    return text


def guess(word: str, known: Sequence[str]) -> str:
    """A question for the known word that is nearest, or nothing where none is near."""
    word = word[:100].replace("\N{MICRO SIGN}", "u").replace("\N{GREEK SMALL LETTER MU}", "u")  # else µm is near m
    near = difflib.get_close_matches(word, known, n=1)
    return f"did you mean {near[0]}? " if near else ""


def line(file: Path, path: KeyPath, text: str) -> str:
    """`config/scenes/mine.yaml: strip.cell_m: text`"""
    words = [f"[{part}]" if isinstance(part, int) else f".{_word(part)}" for part in path]
    return ": ".join([display(file), *(["".join(words)[1:]] if words else []), text])


def display(file: Path) -> str:
    """The path as a user sees it: from the working folder, where the file lies in it."""
    return str(file.relative_to(Path.cwd()) if file.is_relative_to(Path.cwd()) else file)


def _word(key: str) -> str:
    return key if re.fullmatch(r"[\w-]{1,60}", key) else shown(key)
