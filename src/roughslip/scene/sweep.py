"""The variants of a scene: one for each combination of the values that its `sweep` lists by dotted key."""

from __future__ import annotations

import difflib
from itertools import product
from math import prod
from pathlib import Path
from typing import Any

from roughslip.errors import InputError
from roughslip.scene.mistakes import KeyPath, Values, line, shown
from roughslip.scene.schema import scene_schema

MOST = 50  # variants of a scene
_NOT_SWEPT = ("description", "targets")
_ALLOWED = "a dotted key with a list of values, each once, as in oscillator.damping_ratio: [0.1, 0.2]"


def variants(file: Path, swept: Any) -> dict[str, Values]:
    """Names of the variants of a scene file, <scene>-1, <scene>-2, ..., each with its values by dotted key.

    swept : what its key `sweep` holds

    The last key changes fastest. Raises InputError with a line for each mistake of `sweep`.
    """
    lines = [line(file, path, text) for path, text in _mistakes(swept)]
    names = [f"{file.stem}-{n}" for n in range(1, 1 + prod(map(len, swept.values())))] if swept and not lines else []
    for name in names:
        if file.with_name(f"{name}.yaml").exists():
            lines.append(line(file, ("sweep",), f"{name}.yaml has the name of a variant; rename that file"))
    if lines:
        raise InputError(lines)
    chosen = product(*swept.values()) if names else ()
    return {name: dict(zip(swept, values, strict=True)) for name, values in zip(names, chosen, strict=True)}


def scene_file(name: str, scenes_folder: Path) -> Path:
    """The file of a scene; of a variant, that of the scene that it is one of."""
    own, swept = (scenes_folder / f"{stem}.yaml" for stem in (name, name.rpartition("-")[0]))
    return swept if not own.exists() and swept.is_file() else own


def _mistakes(swept: Any) -> list[tuple[KeyPath, str]]:
    if not isinstance(swept, dict):
        return [(("sweep",), f"{shown(swept)} is not allowed; {_ALLOWED}")]
    keys, mistakes = _keys(scene_schema()), []
    for key, values in swept.items():
        path: KeyPath = ("sweep", *key.split("."))
        if key not in keys:
            near = difflib.get_close_matches(key[:100], keys, 1)
            mistakes.append((path, f"unknown key; {f'did you mean {near[0]}? ' if near else ''}allowed: {_ALLOWED}"))
        elif not isinstance(values, list) or not values or any(value in values[:n] for n, value in enumerate(values)):
            mistakes.append((path, f"{shown(values)} is not allowed; {_ALLOWED}"))
    if not mistakes and (count := prod(map(len, swept.values()))) > MOST:
        mistakes.append((("sweep",), f"{count} variants are too many; at most {MOST}"))
    return mistakes


def _keys(schema: Values, prefix: str = "") -> list[str]:
    """All dotted keys that hold no section and may be swept."""
    keys = []
    for name, part in schema["properties"].items():
        if "properties" in part:
            keys += _keys(part, f"{prefix}{name}.")
        elif prefix or name not in ("extends", "sweep", *_NOT_SWEPT):
            keys.append(f"{prefix}{name}")
    return keys
