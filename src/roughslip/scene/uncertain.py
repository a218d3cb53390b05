"""Numbers of a scene with a standard uncertainty: `mass_kg: {value: 10, standard_uncertainty: 1}`.

The loader takes them apart. Stages read the value in its place, and those that ask for uncertainties read them as the
key `standard_uncertainties`. So a result that does not depend on them keeps its name.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any

from roughslip.scene.mistakes import KeyPath, Values, shown
from roughslip.scene.schema import inner

VALUE, UNCERTAINTY = "value", "standard_uncertainty"
FORM = f"{{{VALUE}: 10, {UNCERTAINTY}: 1}}"


def taken_apart(scene: Values, schema: Values) -> tuple[list[list[Any]], list[tuple[KeyPath, str]]]:
    """Put values in the place of groups, where the schema says that a number may be uncertain.

    Returns the standard uncertainties, [dotted key, number] each, and mistakes, by path.
    """
    uncertainties: list[list[Any]] = []
    mistakes: list[tuple[KeyPath, str]] = []

    def inside(value: Any, part: Values, path: KeyPath) -> Any:
        if isinstance(value, dict) and part.get("uncertain"):
            wrong = list(_mistakes(value, path))
            mistakes.extend(wrong)
            if not wrong and _is_number(value.get(UNCERTAINTY)):
                uncertainties.append([".".join(map(str, path)), float(value[UNCERTAINTY])])
            return value.get(VALUE)
        if isinstance(value, dict):
            return {key: inside(item, inner(part, key), (*path, key)) for key, item in value.items()}
        if isinstance(value, list):
            return [inside(item, inner(part, place), (*path, place)) for place, item in enumerate(value)]
        return value

    scene |= inside(scene, schema, ())
    for key, number in uncertainties:
        smooth = scene.get("load") is not None and (scene.get("roughness") or {}).get("covariance") != "exponential"
        if key.startswith("roughness.") and not smooth:
            text = f"{shown(number)} is not allowed; the law of scatter takes load and a covariance with a slope"
            mistakes.append(((*key.split("."), UNCERTAINTY), text))
    return sorted(uncertainties), mistakes


def source_of(key: str, schema: Values) -> str:
    """The source of uncertainty of a number by its dotted key, as its field says."""
    part = schema
    for name in key.split("."):
        part = inner(part, int(name) if name.isdigit() else name)
    return str(part["uncertain"])


def _mistakes(group: Values, path: KeyPath) -> Iterator[tuple[KeyPath, str]]:
    """What is wrong with a standard uncertainty; the section judges the value."""
    for key in group.keys() - {VALUE, UNCERTAINTY}:
        yield (*path, key), f"unknown key; write a number, or {FORM}"
    value: Any = group.get(VALUE)
    given: Any = group.get(UNCERTAINTY)
    if not _is_number(value) or value < 0.0:
        return  # its section refuses it
    if UNCERTAINTY not in group:
        yield (*path, UNCERTAINTY), f"missing; give it, or the number {shown(value)} alone"
    elif value == 0.0:
        yield (*path, UNCERTAINTY), f"{shown(given)} is not allowed; none for a value of {shown(value)}, which is exact"
    elif len(path) > 1 and path[-1] == 0:  # of a row of a table
        yield (*path, UNCERTAINTY), f"{shown(given)} is not allowed; none for a speed, only for its coefficient"
    elif not (_is_number(given) and 0.0 < given <= value):
        allowed = f"a number > 0 and <= the value {shown(value)}, in its unit"
        yield (*path, UNCERTAINTY), f"{shown(given)} is not allowed; {allowed}"


def _is_number(value: Any) -> bool:
    is_real = isinstance(value, int | float) and not isinstance(value, bool)
    return is_real and abs(value) <= sys.float_info.max
