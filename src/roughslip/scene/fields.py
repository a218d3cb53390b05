"""Fields of the sections of a scene: each states description, unit, range and default once, next to its name.

A section is written as `class Strip(Section)` under `@section`, with fields such as
`samples: int = integer("Strips that are solved", minimum=8, maximum=100_000)`. From these fields `scene.schema`
generates the JSON schema, and scene files are checked against it. `build` makes the object that a stage reads as
`job.scene.strip.samples`. Sections are plain frozen dataclasses, because every stage imports them at its start.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar, get_args

REQUIRED = object()  # as the default of a field: a scene must give it where it gives the section
WORD = "^[a-z][a-z0-9_-]{0,39}$"  # the name of a scene
# Of each argument of `number` and `integer` the word of JSON schema.
_BOUNDS = {"minimum": "minimum", "above": "exclusiveMinimum", "maximum": "maximum", "below": "exclusiveMaximum"}

S = TypeVar("S", bound="Section")
section = dataclasses.dataclass(frozen=True, init=False, repr=False, eq=False)  # `build` makes the objects


class Section:
    """Base class of the sections. A section of a stage holds only the keys that the stage reads."""

    def __getattr__(self, name: str) -> Any:
        """Called for a missing attribute alone."""
        place = self.__dict__.get("_place", "")
        raise AttributeError(
            f"{place}{name} is not among the keys that this stage reads; add it to `reads` of its STAGE"
        )

    def __repr__(self) -> str:
        given = ", ".join(f"{name}={value!r}" for name, value in vars(self).items() if name != "_place")
        return f"{type(self).__name__}({given})"


def number(
    description: str,
    unit: str = "-",
    *,
    default: Any = REQUIRED,
    measured: bool = False,
    **bounds: float,
) -> Any:
    """A field for a real number. bounds : minimum, above, maximum, below.

    measured : whether it may carry a standard uncertainty (`scene.uncertain`)
    """
    part = {"description": f"{description} [{unit}]", "type": "number", **_limits(bounds)}
    return _field(part | ({"measured": True} if measured else {}), default)


def integer(description: str, unit: str = "-", *, default: Any = REQUIRED, **bounds: int) -> Any:
    """A field for a whole number. bounds : minimum, above, maximum, below."""
    part = {"description": f"{description} [{unit}]", "type": "integer", **_limits(bounds)}
    return _field(part, default)


def choice(description: str, kinds: Any, *, default: Any = REQUIRED) -> Any:
    """A field for one of several words. kinds : a Literal type or a tuple."""
    words = list(kinds if isinstance(kinds, tuple) else get_args(kinds))
    return _field({"description": description, "type": "string", "enum": words}, default)


def flag(description: str, *, default: Any = REQUIRED) -> Any:
    """A field for true or false."""
    return _field({"description": description, "type": "boolean"}, default)


def text(description: str, *, longest: int, default: Any = REQUIRED) -> Any:
    """A field for text on one line, of 1 to `longest` characters."""
    return _field({"description": description, "type": "string", "minLength": 1, "maxLength": longest}, default)


def many(
    description: str,
    item: Any,
    *,
    minimum: int = 1,
    maximum: int | None = None,
    unique: bool = False,
    default: Any = REQUIRED,
) -> Any:
    """A field for a list.

    item : the field of one of its elements; a section holds the list as a tuple
    minimum, maximum : bounds of its length
    unique : whether no element may come twice
    """
    part = {"description": description, "type": "array", "minItems": minimum, "items": item.metadata["schema"]}
    part |= {} if maximum is None else {"maxItems": maximum}
    return _field(part | ({"uniqueItems": True} if unique else {}), default)


def group(kind: type[Section]) -> Any:
    """A field for a section that may be absent; its docstring is the description."""
    return _field(
        {"description": str(kind.__doc__).replace("\n    ", " ").replace("\n", ""), "type": "object"}, None, kind
    )


def fields_of(kind: type[Section]) -> dict[str, dataclasses.Field[Any]]:
    """The fields of a section by name, in their order."""
    return kind.__dataclass_fields__  # type: ignore[attr-defined, no-any-return]


def default_of(field: dataclasses.Field[Any]) -> Any:
    """The default of a field; None where it has none."""
    default = field.metadata["default"]
    return None if default is REQUIRED else default


def build(kind: type[S], values: Mapping[str, Any], place: str = "", *, defaults: bool = True) -> S:
    """A section from the keys that `values` holds.

    place : dotted name of the section with a point at its end, for the message of a key that was not read
    defaults : whether absent optional keys get their defaults; a group of the scene itself is then a section of
        defaults, and a group within a section is None

    A key without a value is absent from the section too, and reading it raises AttributeError.
    """
    made = object.__new__(kind)
    made.__dict__["_place"] = place
    for name, field in fields_of(kind).items():
        if name not in values and not (defaults and field.metadata["default"] is not REQUIRED):
            continue
        value, inner = values.get(name, default_of(field)), field.metadata["kind"]
        if inner is not None and (value is not None or (defaults and not place)):
            value = build(inner, value or {}, f"{place}{name}.", defaults=defaults)
        made.__dict__[name] = tuple(value) if isinstance(value, list) else value
    return made


def completed(kind: type[Section], values: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a section as nested dicts, with the defaults of absent optional keys."""
    whole = dict(values)
    for name, field in fields_of(kind).items():
        if field.metadata["kind"] is not None and isinstance(values.get(name), Mapping):
            whole[name] = completed(field.metadata["kind"], values[name])
        elif name not in values and field.metadata["default"] is not REQUIRED:
            whole[name] = default_of(field)
    return whole


def _limits(bounds: Mapping[str, float]) -> dict[str, float]:
    return {_BOUNDS[name]: value for name, value in bounds.items()}


def _field(part: dict[str, Any], default: Any, kind: type[Section] | None = None) -> Any:
    """A dataclass field whose metadata hold its part of the schema, its default, and the section inside it if any.

    The default is a factory, so that the class has no attribute of its name: a key that was not read must be missing.
    """
    metadata = {"schema": part, "default": default, "kind": kind}
    if default is REQUIRED:
        return dataclasses.field(metadata=metadata)
    return dataclasses.field(default_factory=lambda: default, metadata=metadata)
