"""The JSON schema of scene files, as pydantic derives it from the sections, and what it allows in words.

`python -m roughslip.scene.schema` writes config/scene.schema.json, for editors, and docs/reference/keys.md.
"""

import difflib
import json
import re
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple, cast

from pydantic.json_schema import GenerateJsonSchema

from roughslip.scene.mistakes import KeyPath, Values, dotted, given, guess, shown
from roughslip.scene.types import File

FILE, PAGE = Path("config/scene.schema.json"), Path("docs/reference/keys.md")
WORD = "^[a-z][a-z0-9_-]{0,39}$"  # the name of a scene
NAME = "a small letter, then at most 39 small letters, digits, _ or -"  # the same in words
# Numbers as a scene file writes them
AFTER_COMMA = re.compile(r"[0-9]+(?:[eE][-+]?[0-9]+)?")  # of a number with a decimal comma
COMMAS = re.compile(r"[-+]?[0-9]*,([0-9]+,)*")  # and what stands before it
INTEGER = re.compile(r"[-+]?(0|[1-9][0-9]{0,30})")
FLOAT = re.compile(r"[-+]?([0-9]+\.[0-9]*|\.[0-9]+)([eE][-+][0-9]+)?")
_BOUNDS = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
# What follows from other keys, by the beginning of a key that a scene has not.
FOLLOWS = {
    "natural_frequency": "it follows from oscillator.mass_kg and oscillator.stiffness_n_per_m = m (2 pi f)^2",
    "apparent_area": "it is load.force_n over load.nominal_pressure_pa",
    "damping_": "oscillator.damping_ratio is the damper over 2 sqrt(k m)",
    "mean_friction": "friction.mean has it",
}
_UNCERTAIN = {
    "description": "A number with its standard uncertainty, in one unit",
    "type": "object",
    "additionalProperties": False,
    "properties": {"value": {"type": "number"}, "standard_uncertainty": {"type": "number", "exclusiveMinimum": 0}},
}
_HEAD = """# Scene keys

Every key of a scene file, in the order of the types. A key without a default must be given where its section is given,
by the scene or by the one that it extends. Keys that are not needed everywhere say so. The unit ends the name.
`snakemake -n mine` lists what would run after a change of a key. `make schema` writes this page."""


class Refusal(NamedTuple):
    """path : of a value that is not allowed; text : of its line; key : dotted, of the value that is not known"""

    path: KeyPath
    text: str
    key: str = ""
    is_missing: bool = False


class _Schema(GenerateJsonSchema):
    """Without titles, which repeat the names, and without null, which no key of a scene file may have."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def nullable_schema(self, schema: Any) -> Any:
        return self.generate_inner(schema["schema"])


@cache
def scene_schema() -> dict[str, Any]:
    """The schema of a scene after its overlays are merged, and of `extends`. Do not change it."""
    raw = File.model_json_schema(schema_generator=_Schema)
    schema = _inlined(raw, raw.pop("$defs"))
    extends = {
        "description": "Name of the scene that this file overlays; mappings merge, numbers, text and lists replace",
        "type": "string",
        "pattern": WORD,
    }
    return {**schema, "properties": {"extends": extends, **schema["properties"]}}


def _inlined(part: Any, sections: Values) -> Any:
    """A part of the schema with each section in its place, and without a default of null."""
    if isinstance(part, list):
        return [_inlined(item, sections) for item in part]
    if not isinstance(part, dict):
        return part
    if "$ref" in part:
        part = sections[part["$ref"].rpartition("/")[2]]
    whole = {key: _inlined(item, sections) for key, item in part.items() if (key, item) != ("default", None)}
    if isinstance(whole.get("description"), str):
        whole["description"] = " ".join(whole["description"].split())
    if "properties" in whole:
        whole.pop("title", None)
    return whole


def source_of(key: str) -> str:
    """The source of uncertainty of a number by its dotted key, as its field says."""
    part = scene_schema()
    for name in key.split("."):
        part = inner(part, int(name) if name.isdigit() else name)
    return str(part["uncertain"])


def keys(part: Values | None = None, prefix: str = "") -> Iterator[tuple[str, Values]]:
    """Every key of a scene by its dotted name, sections among them, with its part of the schema."""
    for name, one in (scene_schema() if part is None else part).get("properties", {}).items():
        yield prefix + name, one
        yield from keys(one, f"{prefix}{name}.")


def own_code(scene: Values) -> dict[str, str]:
    """What a scene takes from files of the user, `my_laws.py:Mine`, by the dotted key that names it."""
    found = {key: given(scene, key) for key, part in keys() if part.get("or_file")}
    return {key: value for key, value in found.items() if isinstance(value, str) and ":" in value}


def text() -> str:
    """The schema as its file holds it. A file may extend another, so no key of the scene is required in it."""
    schema = _for_editors(scene_schema())
    record = schema["properties"]["friction"]["properties"]["record"]
    file = record["properties"]["file"]
    paths = {"anyOf": [file["items"], file]}
    record["properties"]["file"] = paths  # the loader lists them
    schema["properties"]["friction"]["properties"]["record"] = {"anyOf": [*paths["anyOf"], record]}
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Scene of roughslip"}
    return json.dumps({**head, **schema, "$defs": {"uncertain": _UNCERTAIN}}, indent=2, ensure_ascii=False) + "\n"


def _for_editors(part: Any) -> Any:
    """A part of the schema without required keys, where numbers may be uncertain and words the name of a file."""
    if isinstance(part, list):
        return [_for_editors(item) for item in part]
    if not isinstance(part, dict):
        return part
    whole = {key: _for_editors(item) for key, item in part.items() if key != "required"}
    if whole.pop("or_file", False):
        del whole["enum"]
    return {"anyOf": [whole, {"$ref": "#/$defs/uncertain"}]} if whole.pop("uncertain", False) else whole


def inner(part: Values, key: str | int) -> Values:
    """The part of the schema under a key or a place in a list; empty where there is none."""
    if isinstance(key, int):
        fixed = part.get("prefixItems", [])
        return fixed[key] if key < len(fixed) else part.get("items", {}) or {}
    return part.get("properties", {}).get(key, {})


def refusals(errors: Sequence[Any], scene: Values) -> Iterator[Refusal]:
    """What errors of pydantic refuse in a scene.

    The key not known is that of a refused value, and for an unknown key the one that it is near to. A key without a
    value is an error of type "null". Of a list with a refused item only the item has a line.
    """
    paths = [one["loc"] for one in errors]
    for one in errors:
        path: KeyPath = one["loc"]
        if any(len(other) > len(path) and other[: len(path)] == path for other in paths):
            continue
        if one["type"] == "missing" and isinstance(path[-1], int):  # of a list of two
            path = path[:-1]
        around, part, value, key = scene_schema(), scene_schema(), cast(Any, scene), path[-1]
        for key in path:
            around, part = part, inner(part, key)
            value = value.get(str(key)) if isinstance(value, dict) else value[key]
        if one["type"] == "extra_forbidden":
            near = difflib.get_close_matches(str(key)[:100], around["properties"], 1)
            meant = dotted((*path[:-1], *near)) if near else ""
            yield Refusal(path, f"unknown key; {_nearest_key(str(key), around)}", meant)
        elif one["type"] == "missing" and path == one["loc"]:
            yield Refusal(path, f"missing; {describe_allowed(part)}", is_missing=True)
        elif part:  # known
            yield Refusal(path, _refusal(value, part), dotted(path))


def _refusal(value: Any, part: Values) -> str:
    """The text of the line on a value that is not allowed."""
    if isinstance(value, str) and part["type"] in ("integer", "number"):
        plain = value.strip()
        if re.fullmatch(COMMAS.pattern + AFTER_COMMA.pattern, plain):
            bare = plain.replace(",", "")
            thousands = f" or {bare}" if re.fullmatch(r"[-+]?[0-9]{1,3},[0-9]{3}", plain) else ""
            number = _as_number(plain if plain.count(",") == 1 else bare, part)
            return f"a comma in {plain}: {number.replace(',', f'{thousands},', 1)}"
        return f"{shown(value)} is text, not a number; {_as_number(value, part)}"
    if isinstance(value, list) and part["type"] == "array" and len(value) > part.get("maxItems", len(value)):
        pairs = zip(value[::2], value[1::2], strict=False) if len(value) == 2 * part["maxItems"] else pairwise(value)
        if whole := [f"{one}.{two}" for one, two in pairs if type(one) is int and re.fullmatch("[0-9]+", str(two))]:
            point = f"a decimal comma is a point, as in {' or '.join(whole)}"
            return f"{shown(value)} is not allowed; {describe_allowed(part)}: {point}"
    near = guess(value, part["enum"]) if isinstance(value, str) and "enum" in part else ""
    return f"{shown(value)} is not allowed; {near}{describe_allowed(part)}"


def describe_allowed(part: Values) -> str:
    """What a part of the schema allows, in words: `a number > 0 and <= 1 [m]`."""
    if "enum" in part:
        words = "one of " + ", ".join(part["enum"])
        return f"{words}, or one of your own, as my_file.py:Mine" if part.get("or_file") else words
    match part["type"]:
        case "boolean":
            return "true or false"
        case "string":
            longest = f", 1 to {part['maxLength']} characters" if "maxLength" in part else ""
            return NAME if "pattern" in part else f"text on one line{longest}"
        case "object":
            return "a group of the keys " + ", ".join(part["properties"])
        case "array":
            least, most = part["minItems"], part.get("maxItems")
            number = f"at least {least}" if not most else f"{least}" if least == most else f"{least} to {most}"
            once = ", each once" if part.get("uniqueItems") else ""
            items = dict.fromkeys(map(describe_allowed, part.get("prefixItems") or [inner(part, 0)]))
            return f"a list of {number}{once}, of {' and '.join(items)}"
    bounds = " and ".join(f"{sign} {part[key]:.12g}" for key, sign in _BOUNDS.items() if key in part)
    unit = f" [{part['unit']}]" if "unit" in part else ""
    return f"a {'whole ' * (part['type'] == 'integer')}number {bounds}{unit}"


def _as_number(text: str, part: Values) -> str:
    """How to write a number that arrived as text: YAML wants a point, and a sign in the exponent."""
    plain = text.strip().replace("_", "")
    plain = plain.replace(",", ".", 1)
    if scientific := re.fullmatch(r"([-+]?)(\d*)\.?(\d*)[eE]([-+]?)(\d+)", plain, re.ASCII):
        sign, whole, fraction, exponent_sign, exponent = scientific.groups()
        plain = f"{sign}{whole or 0}.{fraction or 0}e{exponent_sign or '+'}{exponent}"
    if part["type"] == "integer" and FLOAT.fullmatch(plain) and float(plain).is_integer():
        plain = f"{float(plain):.0f}"
    known = INTEGER.fullmatch(plain) or FLOAT.fullmatch(plain)
    return f"write {plain}, {describe_allowed(part)}" if known else describe_allowed(part)


def _nearest_key(key: str, part: Values) -> str:
    """The allowed keys, the nearest first; a key that belongs to another section is named with its section."""
    allowed = list(part["properties"])
    if follows := [text for word, text in FOLLOWS.items() if key.startswith(word) and key[:-1] not in allowed]:
        return follows[0]
    near = guess(key, allowed)
    sections = scene_schema()["properties"].items()
    elsewhere = [f"{section}.{key}" for section, one in sections if key in one.get("properties", {})]
    if elsewhere and not near:
        near = f"did you mean {' or '.join(elsewhere)}? "
    return f"{near}allowed: {', '.join(allowed)}"


def page() -> str:
    """The page of the manual on scene keys: a row a key, a table a section."""
    parts, text = dict(keys()), [_HEAD]
    for section in ("", *(key for key, part in parts.items() if "properties" in part)):
        title, meaning = "## Of the whole scene", "What a file says of itself, and how it is run."
        if section:
            title, meaning = f"{'#' * (section.count('.') + 2)} `{section}`", parts[section]["description"]
        own = (key for key, part in parts.items() if key.rpartition(".")[0] == section and "properties" not in part)
        table = ["| key | meaning | allowed | default |", "|---|---|---|---|", *(_row(key, parts[key]) for key in own)]
        text.append("\n".join((title, "", meaning, "", *table)))
    return "\n\n".join(text) + "\n"


def _row(key: str, part: Values) -> str:
    """Name, meaning, what is allowed and default of a key, as cells of a table."""
    meaning = part["description"].removesuffix(".").replace("|", r"\|")
    allowed = describe_allowed(part) + (", or `{value: ..., standard_uncertainty: ...}`" * ("uncertain" in part))
    default = f"`{part['default']}`" if "default" in part else ""
    return f"| `{key.rpartition('.')[2]}` | {meaning} | {allowed} | {default} |"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
    PAGE.write_text(page(), encoding="utf-8")
