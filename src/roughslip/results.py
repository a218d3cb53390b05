"""Results of the library: what each number is stands next to it, for readers, for prompts and for Datasets."""

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar, dataclass_transform

Result = TypeVar("Result")
FEW = 4  # entries of a sequence that are shown


def described(title: str, unit: str = "1", dims: str = "", **options: Any) -> Any:
    """A field of a result.

    title : what it is; unit : "1" for a pure number; dims : names of the dimensions of an array, separated by spaces
    options : those of `dataclasses.field`, such as a default
    """
    return dataclasses.field(metadata={"title": title, "unit": unit, "dims": tuple(dims.split())}, **options)


@dataclass_transform(frozen_default=True, field_specifiers=(described, dataclasses.field))
def result(kind: type[Result]) -> type[Result]:
    """Decorate a class of results: a frozen dataclass that shows shapes of arrays, and whose help lists its fields."""
    made = dataclasses.dataclass(frozen=True, repr=False)(kind)
    lines = [_line(field) for field in dataclasses.fields(made) if field.metadata]  # type: ignore[arg-type]
    made.__doc__ = "\n".join([f"{(kind.__doc__ or '').rstrip()}\n", *lines, ""])
    made.__repr__ = _shown_whole  # type: ignore[assignment, method-assign]
    return made


def _line(field: dataclasses.Field[Any]) -> str:
    """A field as docstrings have it: name, shape, unit, what it is."""
    dims, unit = field.metadata["dims"], field.metadata["unit"]
    shape = f"({', '.join(dims)}{',' if len(dims) == 1 else ''}) " if dims else ""
    return f"    {field.name} : {shape}{'' if unit == '1' else f'[{unit}] '}{field.metadata['title']}"


def _shown_whole(whole: Any) -> str:
    parts = (f"{field.name}={_shown(getattr(whole, field.name))}" for field in dataclasses.fields(whole))
    return f"{type(whole).__name__}({', '.join(parts)})"


def _shown(number: Any) -> str:
    if getattr(number, "shape", ()):
        return f"array{number.shape}"
    if isinstance(number, Mapping):
        return "{" + ", ".join(f"{name!r}: {_shown(part)}" for name, part in number.items()) + "}"
    if isinstance(number, (tuple, list)) and len(number) > FEW:
        return f"{type(number).__name__} of {len(number)} {type(number[0]).__name__}"
    return repr(number)
