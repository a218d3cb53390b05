"""Scene files: strict YAML, overlays and a closed schema; every mistake becomes one line, and all of them come at once.

A line reads `file: key: what was given and what is allowed`. Only the Snakefile and the tests import this module.
"""

from __future__ import annotations

import difflib
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

from jsonschema import Draft202012Validator, validators

from roughslip.errors import InputError
from roughslip.scene import accuracy, discretisation, oscillator, rules, sweep
from roughslip.scene.fields import WORD
from roughslip.scene.load import derived
from roughslip.scene.mistakes import Values, shown
from roughslip.scene.plan import default_targets
from roughslip.scene.schema import scene_schema
from roughslip.scene.strict_yaml import FLOAT, INTEGER, KeyPath, display, line, read
from roughslip.scene.types import nested

RESERVED = frozenset({"reference", "benchmarks", "evidence", "report", "all", "clean", "logs", "usage"})
LONGEST = 200  # characters of a description
_NAME = re.compile(WORD)
_NAME_ALLOWED = "a small letter, then at most 39 small letters, digits, _ or -"


def load(name_or_path: str | Path, scenes_folder: Path) -> Values:
    """The scene of a name, or of a file anywhere, with its overlays merged and every rule checked.

    name_or_path : a scene of scenes_folder by its name, or a scene file: a Path, or text with a / or ending in .yaml;
        a variant has a name but no file
    scenes_folder : folder of the names, also of those after `extends`

    Returns the scene as nested dicts, without `extends` and `sweep`, and with what follows from its load; a key that
    takes a `number` holds a float. `types.scene_of` makes an object of it. Raises InputError with a line per mistake.
    """
    schema = scene_schema()
    asked = _locate(name_or_path, scenes_folder)
    top = sweep.scene_file(asked.stem, asked.parent)
    chain, merged, lines = _read_chain(top, scenes_folder)
    try:
        variants = sweep.variants(top)
        if top.stem != asked.stem and asked.stem not in variants:
            lines.append(f"{display(asked)}: no such file; {top.stem} has {len(variants)} variants")
        merged.overlay(top, _of_the_variant(asked.stem, variants, merged.values))
    except InputError as error:
        lines += error.lines

    def topmost(paths: list[KeyPath]) -> Path:
        """Of the overlaid files that gave these values, the one that the user most likely edits."""
        return min((merged.file_of(path) for path in paths), key=chain.index)

    if merged.file_of(("targets",)) != chain[0] and isinstance(merged.values["targets"], list):
        merged.values["targets"] = default_targets(merged.values)
    faulty = set()
    for path, text, is_refused in _schema_mistakes(merged.values, schema):
        if is_refused:
            faulty.add(".".join(map(str, path)))
        lines.append(line(topmost([path]), path, text))
    whole, left_open = discretisation.discretised(merged.values)
    faulty |= {mistake.keys[0] for mistake in left_open}
    for keys, text in (*left_open, *rules.mistakes(_without(faulty, whole), faulty)):
        paths: list[KeyPath] = [tuple(key.split(".")) for key in keys]
        lines.append(line(topmost(paths), paths[0], text))
    if lines:
        raise InputError(list(dict.fromkeys(lines)))
    whole = oscillator.with_frequency(whole)
    return derived(accuracy.with_sample_counts(cast(Values, _with_floats(whole, schema))))


OWN_CURVE = ("law", "friction_table", "stribeck_decay_s_per_m")


def inherited(name: str, scenes_folder: Path) -> list[str]:
    """Warnings on what a valid scene inherits and hardly means: a friction curve and a spring of another machine.

    A key counts as the scene's own where the file that gives it stands above the file that gives the other one.
    """
    chain, merged, _ = _read_chain(sweep.scene_file(name, scenes_folder), scenes_folder)
    level = {file: chain.index(file) for file in chain}

    def height(*keys: str) -> int:
        """The topmost file that gives one of these keys, counted from the top; beyond the last where none does."""
        paths = [path for key in keys if _has(merged.values, path := tuple(key.split(".")))]
        return min((level[merged.file_of(path)] for path in paths), default=len(chain))

    warnings = []
    curve = height(*(f"oscillator.{key}" for key in OWN_CURVE))
    own = [key for key in ("load", "material.young_modulus_pa") if height(key) < curve]
    if own and curve < len(chain):
        warnings.append(
            f"oscillator.law: the friction curve is that of scene {chain[curve].stem}, and {' and '.join(own)} is of "
            "this scene. The curve decides whether stick-slip occurs: give law, its numbers and static_friction"
        )
    if height("oscillator.mass_kg") < height("oscillator.natural_frequency_rad_per_s") < len(chain):
        mass, omega = (merged.values["oscillator"][key] for key in ("mass_kg", "natural_frequency_rad_per_s"))
        warnings.append(
            f"oscillator.mass_kg: with the natural frequency of scene "
            f"{chain[height('oscillator.natural_frequency_rad_per_s')].stem}, {omega:g} rad/s, the spring follows as "
            f"{mass * omega**2:.3g} N/m: give stiffness_n_per_m"
        )
    return warnings


def _has(values: Any, path: tuple[str, ...]) -> bool:
    """Whether there is a value at a path."""
    for key in path:
        if not isinstance(values, dict) or key not in values:
            return False
        values = values[key]
    return True


def scene_names(scenes_folder: Path) -> list[str]:
    """Names of all scenes of a folder, sorted."""
    return sorted(file.stem for file in scenes_folder.glob("*.yaml"))


# Keys that a key replaces, all of them dotted.
_REPLACED = {
    f"{section}.{key}".lstrip("."): [f"{section}.{old}".lstrip(".") for old in keys]
    for section, replaced in rules.REPLACES.items()
    for key, keys in replaced.items()
}


class _Merged:
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


def _of_the_variant(name: str, variants: dict[str, Values], scene: Values) -> Values:
    """What a variant changes in the scene that it is one of: the values of `sweep`, and the description."""
    if name not in variants:
        return {}
    values = ", ".join(f"{key.rpartition('.')[2]} {shown(value)}" for key, value in variants[name].items())
    return {**nested(variants[name]), "description": f"{scene.get('description')}: {values}"[:LONGEST]}


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
    if not _NAME.fullmatch(name):
        raise InputError(f"{where}: {shown(name)} is not allowed as the name of a scene; {_NAME_ALLOWED}")
    if name in RESERVED:
        raise InputError(f"{where}: {shown(name)} is not allowed as the name of a scene; it is reserved")
    if is_path:
        return Path(given)
    file = scenes_folder / f"{name}.yaml"
    if not sweep.scene_file(name, scenes_folder).is_file():
        raise InputError(f"{display(file)}: no such file; {_nearest(name, scene_names(scenes_folder), 'scenes')}")
    return file


def _stay_inside(file: Path, scenes_folder: Path) -> None:
    """Refuses a link that leads out of the folder of the scenes: what is read should be what the project shows."""
    real = os.path.realpath(file)  # of a link to itself, too
    if file.is_symlink() and not Path(real).is_relative_to(os.path.realpath(scenes_folder)):
        raise InputError(f"{display(file)}: a link to {shown(real)}, out of its folder; copy the file")


def _read_chain(top: Path, scenes_folder: Path) -> tuple[list[Path], _Merged, list[str]]:
    """The files of a scene from the top of its overlays down, their values merged, and lines on unused accuracies."""
    known = scene_names(scenes_folder)
    chain = [top]
    documents: list[Values] = []
    lines: list[str] = []
    while len(documents) < len(chain):
        file = chain[-1]
        try:
            _stay_inside(file, scenes_folder)
            values = read(file)
        except InputError as error:
            raise InputError([*lines, *error.lines]) from None
        both = values.get("accuracy")
        if isinstance(both, int | float) and not isinstance(both, bool):
            values["accuracy"] = accuracy.of_all(both)
        lines += [line(file, tuple(keys[0].split(".")), text) for keys, text in accuracy.unused_accuracy(values)]
        values.pop("sweep", None)  # of the file, not of those that extend it
        documents.append(values)
        if "extends" not in values:
            break
        base = values.pop("extends")
        if base not in known:
            text = f"{shown(base)} is not allowed; {_nearest(str(base), known, 'scenes')}"
            raise InputError([*lines, line(file, ("extends",), text)])
        chain.append(scenes_folder / f"{base}.yaml")
        if os.path.realpath(chain[-1]) in map(os.path.realpath, chain[:-1]):
            text = f"{shown(base)} is not allowed; overlays run in a circle: {' -> '.join(link.stem for link in chain)}"
            raise InputError([*lines, line(file, ("extends",), text)])
    merged = _Merged(top)
    for file, values in zip(reversed(chain), reversed(documents), strict=True):
        merged.overlay(file, values)
    return chain, merged, lines


def _without(faulty: set[str], value: Any, path: str = "") -> Any:
    """The scene with None for every value that the schema refused, and for lists with a refused item."""
    if path in faulty or (isinstance(value, list) and any(bad.startswith(f"{path}.") for bad in faulty)):
        return None
    if isinstance(value, dict):
        return {key: _without(faulty, item, f"{path}.{key}" if path else key) for key, item in value.items()}
    return value


def _is_integer(_: object, value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_number(_: object, value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max  # false for inf and NaN


def _is_text(_: object, value: object) -> bool:
    return isinstance(value, str) and value.isprintable()  # on one line, and fit for any file


_Validator = validators.extend(
    Draft202012Validator,
    type_checker=Draft202012Validator.TYPE_CHECKER.redefine_many(
        {"integer": _is_integer, "number": _is_number, "string": _is_text}
    ),
)


def _schema_mistakes(values: Values, schema: Values) -> Iterator[tuple[KeyPath, str, bool]]:
    """The path, the text of its line, and whether there is a value, which is refused."""
    for error in _Validator(schema).iter_errors(values):
        path, given = tuple(error.absolute_path), error.instance
        part = cast(Values, error.schema)
        if error.validator == "required":
            for key in part["required"]:
                if key not in given:
                    yield (*path, key), f"missing; {describe_allowed(part['properties'][key])}", False
        elif error.validator == "additionalProperties":
            for key in given:
                if key not in part["properties"]:
                    text = _nearest_key(key, part, schema)
                    if (
                        given[key] is None and str(key).isdigit()
                    ):  # {damping_ratio: 0,1} has the keys damping_ratio and 1
                        text = f"is it the decimal comma of a number? Write a point, as in 0.{key}"
                    yield (*path, key), f"unknown key; {text}", False
        elif isinstance(given, str) and (kind := _kind(part)) in ("integer", "number") and _is_numeric(given, part):
            yield path, f"{shown(given)} is text, not a number; {_as_number(given, {**part, 'type': kind})}", True
        else:
            guess = _guess(given, part["enum"]) if isinstance(given, str) and "enum" in part else ""
            yield path, f"{shown(given)} is not allowed; {guess}{describe_allowed(part)}", True


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
            return f"text on one line, 1 to {longest} characters" if longest else _NAME_ALLOWED
        case "object":
            return "a group of the keys " + ", ".join(schema["properties"])
        case "array":
            least, most = schema["minItems"], schema.get("maxItems")
            number = f"at least {least}" if not most else f"{least}" if least == most else f"{least} to {most}"
            once = ", each once" if schema.get("uniqueItems") else ""
            return f"a list of {number}{once}, of {describe_allowed(schema['items'])}"
    signs = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
    bounds = " and ".join(f"{sign} {schema[key]:.12g}" for key, sign in signs.items() if key in schema)
    unit = re.search(r" \[[^\]-]+\]$", schema["description"])
    return f"a {'whole ' * (schema['type'] == 'integer')}number {bounds}{unit.group() if unit else ''}"


def _kind(part: Values) -> str:
    """The type that a part of the schema allows, the first where a word may stand in its place."""
    return str(part["type"][0] if isinstance(part["type"], list) else part["type"])


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


def _nearest_key(key: str, part: Values, schema: Values) -> str:
    """The allowed keys, the nearest first; a key that belongs to another section is named with its section."""
    allowed = list(part["properties"])
    elsewhere = [
        f"{section}.{key}" for section, inner in schema["properties"].items() if key in inner.get("properties", {})
    ]
    if elsewhere and not difflib.get_close_matches(key, allowed):
        return f"did you mean {' or '.join(elsewhere)}? allowed: {', '.join(allowed)}"
    return _nearest(key, allowed, "allowed")


def _nearest(given: str, known: list[str], heading: str) -> str:
    return f"{_guess(given, known)}{heading}: {', '.join(known)}"


def _guess(given: str, known: list[str]) -> str:
    """A question for the known word that is nearest, or nothing where none is near."""
    given = given[:100].replace("\N{MICRO SIGN}", "u").replace("\N{GREEK SMALL LETTER MU}", "u")  # else µm is near m
    near = difflib.get_close_matches(given, known, n=1)
    return f"did you mean {near[0]}? " if near else ""


def _with_floats(value: Any, schema: Values) -> Any:
    """A number is a float however it was written, so that 5 and 5.0 are the same scene."""
    kind = schema["type"]
    match kind[0] if isinstance(kind, list) and not isinstance(value, str) else kind:
        case "object":
            return {key: _with_floats(item, schema["properties"][key]) for key, item in value.items()}
        case "array":
            return [_with_floats(item, schema["items"]) for item in value]
        case "number":
            return float(value)
    return value
