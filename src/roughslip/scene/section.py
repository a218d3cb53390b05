"""Sections of a scene: each field says its meaning, unit, range, default, and whether it can be uncertain, once.

A section is a class on `Section` with fields such as `width_m: float = key("m", gt=0)`, and a text below each. Its JSON
schema, the check of scene files and the words of their mistakes follow from the fields. A new key is a field.
"""

from collections.abc import Collection, Mapping
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

T = TypeVar("T")
FILE_AND_CLASS = r"[^:\s][^:]*\.py:[A-Za-z_]\w*"  # of a user's own law or covariance


class Section(BaseModel):
    """Base class of the sections: closed and frozen."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


def key(unit: str = "", *, default: Any = ..., uncertain: str = "", **limits: Any) -> Any:
    """A field, of a number with its unit. The text below the field says what it means.

    uncertain : source to which a standard uncertainty of the number belongs; without one it can have none
    limits : those of pydantic's Field
    """
    extra: dict[str, Any] = {name: value for name, value in (("unit", unit), ("uncertain", uncertain)) if value}
    return Field(default, json_schema_extra=extra or None, **limits)


def word(words: Collection[str], *, default: Any = ..., or_file: bool = False) -> Any:
    """A field for one of several words that are found at run time, or for a class in a file of the user."""
    pattern = "|".join([*words, FILE_AND_CLASS] if or_file else words)
    extra: dict[str, Any] = {"enum": list(words), **({"or_file": True} if or_file else {})}
    return Field(default, pattern=f"^({pattern})$", json_schema_extra=extra)


def many(*, default: Any = ..., unique: bool = False, **lengths: Any) -> Any:
    """A field for a tuple, which a scene file gives as a list. lengths : min_length, max_length"""
    return Field(default, strict=False, json_schema_extra={"uniqueItems": True} if unique else None, **lengths)


def _each_once(values: tuple[T, ...]) -> tuple[T, ...]:
    if any(value in values[:place] for place, value in enumerate(values)):
        raise ValueError("each once")
    return values


def _on_one_line(text: str) -> str:
    if not text.isprintable():
        raise ValueError("on one line")
    return text


EachOnce = AfterValidator(_each_once)
Line = Annotated[str, Field(min_length=1), AfterValidator(_on_one_line)]


def kind_of(field: FieldInfo) -> type[Section] | None:
    """The section that a field holds, if it holds one."""
    options = getattr(field.annotation, "__args__", (field.annotation,))
    return next((one for one in options if isinstance(one, type) and issubclass(one, Section)), None)


def completed(kind: type[Section], values: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a section as nested dicts, with the defaults of absent optional keys; None where there is none."""
    whole = dict(values)
    for name, field in kind.model_fields.items():
        inner = kind_of(field)
        if inner is not None and isinstance(values.get(name), Mapping):
            whole[name] = completed(inner, values[name])
        elif name not in values and not field.is_required():
            whole[name] = field.get_default()
    return whole
