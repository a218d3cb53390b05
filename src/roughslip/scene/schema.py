"""The JSON schema of scene files, generated from the types: for editors, and for the check of every file.

`python -m roughslip.scene.schema` writes config/scene.schema.json.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

from roughslip.scene.declarations import targets
from roughslip.scene.fields import REQUIRED, WORD, Section, default_of, fields_of
from roughslip.scene.types import Scene

FILE = Path("config/scene.schema.json")


@cache
def scene_schema() -> dict[str, Any]:
    """The schema of a scene after its overlays are merged, with `extends` and `sweep` of a file. Do not change it."""
    schema = _part(Scene, {"description": "Scene of roughslip; the unit of a number ends its name"})
    listed = schema["properties"]["targets"]  # the stages declare them
    listed["items"] = {"description": listed["items"]["description"], "type": "string", "enum": list(targets())}
    extends = {
        "description": "Name of the scene that this file overlays; mappings merge, numbers, text and lists replace",
        "type": "string",
        "pattern": WORD,
    }
    sweep = {
        "description": "Lists of values by dotted key: each combination is a variant, with results of its own",
        "type": "object",
        "additionalProperties": {"type": "array", "minItems": 1, "uniqueItems": True},
    }
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Scene of roughslip"}
    return {**head, **schema, "properties": {"extends": extends, "sweep": sweep, **schema["properties"]}}


def text() -> str:
    """The schema as its file holds it. A file may extend another, so no key of the scene is required in it."""
    schema = {key: value for key, value in scene_schema().items() if key != "required"}
    optional = _optional(schema)
    both = optional["properties"]["accuracy"]
    optional["properties"]["accuracy"] = {"anyOf": [both["properties"]["friction_mean"], both]}  # the loader takes both
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


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
