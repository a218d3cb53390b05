"""The JSON schema of scene files, generated from the types: for editors, and for the check of every value.

`python -m roughslip.scene.schema` writes config/scene.schema.json.
"""

from __future__ import annotations

import difflib
import json
import operator
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from roughslip.scene import uncertain
from roughslip.scene.declarations import targets
from roughslip.scene.fields import REQUIRED, WORD, Section, default_of, fields_of
from roughslip.scene.mistakes import KeyPath, Values, shown
from roughslip.scene.types import Scene

FILE = Path("config/scene.schema.json")
NAME = "a small letter, then at most 39 small letters, digits, _ or -"  # the WORD that names a scene
# Numbers as a scene file writes them
INTEGER = re.compile(r"[-+]?(0|[1-9][0-9]{0,30})")
FLOAT = re.compile(r"[-+]?([0-9]+\.[0-9]*|\.[0-9]+)([eE][-+][0-9]+)?")
_BOUNDS = {
    "minimum": (">=", operator.ge),
    "exclusiveMinimum": (">", operator.gt),
    "maximum": ("<=", operator.le),
    "exclusiveMaximum": ("<", operator.lt),
}


@cache
def scene_schema() -> dict[str, Any]:
    """The schema of a scene after its overlays are merged, with `extends` of a file. Do not change it."""
    schema = _part(Scene, {"description": "Scene of roughslip; the unit of a number ends its name"})
    del schema["properties"]["standard_uncertainties"]  # which the loader finds
    listed = schema["properties"]["targets"]  # the stages declare them
    listed["items"] = {"description": listed["items"]["description"], "type": "string", "enum": list(targets())}
    extends = {
        "description": "Name of the scene that this file overlays; mappings merge, numbers, text and lists replace",
        "type": "string",
        "pattern": WORD,
    }
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Scene of roughslip"}
    return {**head, **schema, "properties": {"extends": extends, **schema["properties"]}}


def text() -> str:
    """The schema as its file holds it. A file may extend another, so no key of the scene is required in it."""
    schema = {key: value for key, value in scene_schema().items() if key != "required"}
    optional = uncertain.with_forms(_optional(schema))
    record = optional["properties"]["friction"]["properties"]["record"]
    paths = {"anyOf": [record["properties"]["file"]["items"], record["properties"]["file"]]}
    record["properties"]["file"] = paths  # the loader lists them
    optional["properties"]["friction"]["properties"]["record"] = {"anyOf": [*paths["anyOf"], record]}
    optional["$defs"] = {"uncertain": uncertain.GROUP}
    return json.dumps(optional, indent=2, ensure_ascii=False) + "\n"


def _part(kind: type[Section], described: dict[str, Any]) -> dict[str, Any]:
    """The schema of a section: closed, so that a key that is not declared is a mistake."""
    properties, required = {}, []
    for name, field in fields_of(kind).items():
        part = dict(field.metadata["schema"])
        if field.metadata["kind"] is not None:
            part = _part(field.metadata["kind"], part)
        elif default_of(field) is not None:
            part["default"] = default_of(field)
        if field.metadata["default"] is REQUIRED:
            required.append(name)
        properties[name] = part
    closed = {"type": "object", "additionalProperties": False}
    return {**described, **closed, **({"required": required} if required else {}), "properties": properties}


def _optional(schema: dict[str, Any]) -> dict[str, Any]:
    """The schema without required keys: a file may leave any of them to the scene that it extends."""
    optional = {key: value for key, value in schema.items() if key != "required"}
    if "properties" in schema:
        optional["properties"] = {name: _optional(part) for name, part in schema["properties"].items()}
    return optional


def refusals(value: Any, part: Values, path: KeyPath = ()) -> Iterator[tuple[KeyPath, str, bool]]:
    """What a part of the schema refuses in a value and in all inside it.

    Yields the path, the text of its line, and whether there is a value, which is refused.
    """
    if not _fits(value, part):
        yield path, _refusal(value, part), True
    elif isinstance(value, dict):
        for key in (key for key in part.get("required", ()) if key not in value):
            yield (*path, key), f"missing; {describe_allowed(part['properties'][key])}", False
        for key, inner in value.items():
            if key in part["properties"]:
                yield from refusals(inner, part["properties"][key], (*path, key))
            elif inner is None and str(key).isdigit():  # {damping_ratio: 0,1} has the keys damping_ratio and 1
                yield (
                    (*path, key),
                    f"unknown key; is it the decimal comma of a number? Write a point, as in 0.{key}",
                    False,
                )
            else:
                yield (*path, key), f"unknown key; {_nearest_key(key, part)}", False
    if isinstance(value, list) and "items" in part:
        for number, item in enumerate(value):
            yield from refusals(item, part["items"], (*path, number))


def _fits(value: Any, part: Values) -> bool:
    """Whether a value has a type and bounds that a part of the schema allows; what is inside it is not looked at."""
    kinds = part["type"] if isinstance(part["type"], list) else [part["type"]]
    match value:
        case bool():
            return "boolean" in kinds
        case int() | float():
            is_kind = "number" in kinds or ("integer" in kinds and isinstance(value, int))
            is_finite = abs(value) <= sys.float_info.max  # false for NaN, too
            bounds = ((holds, part[key]) for key, (_, holds) in _BOUNDS.items() if key in part)
            return is_kind and is_finite and all(holds(value, bound) for holds, bound in bounds)
        case str():
            is_word = value in part["enum"] if "enum" in part else re.search(part.get("pattern", ""), value)
            is_short = part.get("minLength", 0) <= len(value) <= part.get("maxLength", len(value))
            return (
                "string" in kinds and bool(is_word) and is_short and value.isprintable()
            )  # on one line, fit for files
        case list():
            is_long = part.get("minItems", 0) <= len(value) <= part.get("maxItems", len(value))
            once = not part.get("uniqueItems") or all(item not in value[:n] for n, item in enumerate(value))
            return "array" in kinds and is_long and once
    return isinstance(value, dict) and "object" in kinds


def _refusal(value: Any, part: Values) -> str:
    """The text of the line on a value that is not allowed."""
    kind = part["type"][0] if isinstance(part["type"], list) else part["type"]
    if isinstance(value, str) and kind in ("integer", "number") and _is_numeric(value, part):
        return f"{shown(value)} is text, not a number; {_as_number(value, {**part, 'type': kind})}"
    guess = _guess(value, part["enum"]) if isinstance(value, str) and "enum" in part else ""
    return f"{shown(value)} is not allowed; {guess}{describe_allowed(part)}"


def describe_allowed(schema: Values) -> str:
    """What a part of the schema allows, in words: `a number > 0 and <= 1 [m]`."""
    if isinstance(schema["type"], list):  # a number, or a word in its place
        return f"{describe_allowed({**schema, 'type': schema['type'][0]})}, or {schema['pattern'].strip('^$')}"
    if "enum" in schema:
        return "one of " + ", ".join(schema["enum"])
    match schema["type"]:
        case "boolean":
            return "true or false"
        case "string":
            longest = schema.get("maxLength")
            return f"text on one line, 1 to {longest} characters" if longest else NAME
        case "object":
            return "a group of the keys " + ", ".join(schema["properties"])
        case "array":
            minimum, maximum = schema["minItems"], schema.get("maxItems")
            number = (
                f"at least {minimum}"
                if not maximum
                else f"{minimum}"
                if minimum == maximum
                else f"{minimum} to {maximum}"
            )
            once = ", each once" if schema.get("uniqueItems") else ""
            return f"a list of {number}{once}, of {describe_allowed(schema['items'])}"
    bounds = " and ".join(f"{sign} {schema[key]:.12g}" for key, (sign, _) in _BOUNDS.items() if key in schema)
    unit = re.search(r" \[[^\]-]+\]$", schema["description"])
    return f"a {'whole ' * (schema['type'] == 'integer')}number {bounds}{unit.group() if unit else ''}"


def _is_numeric(text: str, part: Values) -> bool:
    """Whether a text is meant as a number: always, or with a digit where a word may stand in its place."""
    return not isinstance(part["type"], list) or any(character.isdigit() for character in text)


def _as_number(text: str, schema: Values) -> str:
    """How to write a number that arrived as text: YAML wants a point, and a sign in the exponent."""
    plain = text.strip().replace("_", "")
    if re.fullmatch(r"[-+]?\d*,\d+", plain):
        plain = plain.replace(",", ".")
    if scientific := re.fullmatch(r"([-+]?)(\d*)\.?(\d*)[eE]([-+]?)(\d+)", plain, re.ASCII):
        sign, whole, fraction, exponent_sign, exponent = scientific.groups()
        plain = f"{sign}{whole or 0}.{fraction or 0}e{exponent_sign or '+'}{exponent}"
    if schema["type"] == "integer" and FLOAT.fullmatch(plain) and float(plain).is_integer():
        plain = f"{float(plain):.0f}"
    known = INTEGER.fullmatch(plain) or FLOAT.fullmatch(plain)
    return f"write {plain}, {describe_allowed(schema)}" if known else describe_allowed(schema)


def _nearest_key(key: str, part: Values) -> str:
    """The allowed keys, the nearest first; a key that belongs to another section is named with its section."""
    allowed = list(part["properties"])
    sections = scene_schema()["properties"].items()
    elsewhere = [f"{section}.{key}" for section, inner in sections if key in inner.get("properties", {})]
    if elsewhere and not difflib.get_close_matches(key, allowed):
        return f"did you mean {' or '.join(elsewhere)}? allowed: {', '.join(allowed)}"
    return nearest(key, allowed, "allowed")


def nearest(given: str, known: list[str], heading: str) -> str:
    return f"{_guess(given, known)}{heading}: {', '.join(known)}"


def _guess(given: str, known: list[str]) -> str:
    """A question for the known word that is nearest, or nothing where none is near; the new name of an old one."""
    given = given[:100].replace("\N{MICRO SIGN}", "u").replace("\N{GREEK SMALL LETTER MU}", "u")  # else µm is near m
    near = difflib.get_close_matches(given, known, n=1)
    return f"did you mean {near[0]}? " if near else ""


def with_floats(value: Any, schema: Values) -> Any:
    """A number is a float however it was written, so that 5 and 5.0 are the same scene."""
    kind = schema["type"]
    match kind[0] if isinstance(kind, list) and not isinstance(value, str) else kind:
        case "object":
            return {key: with_floats(item, schema["properties"][key]) for key, item in value.items()}
        case "array":
            return [with_floats(item, schema["items"]) for item in value]
        case "number":
            return float(value)
    return value


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
