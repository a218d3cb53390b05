"""Results as they are shown at a prompt: numbers as they are, arrays by their shapes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypeVar

Result = TypeVar("Result")
FEW = 4  # entries of a sequence that are shown


def short_repr(kind: type[Result]) -> type[Result]:
    """Decorate a dataclass so that its `repr` shows the shapes of arrays, in place of their numbers."""

    def shown(self: Any) -> str:
        parts = (f"{field.name}={_shown(getattr(self, field.name))}" for field in fields(self))
        return f"{kind.__name__}({', '.join(parts)})"

    kind.__repr__ = shown  # type: ignore[assignment, method-assign]
    return kind


def _shown(value: Any) -> str:
    if getattr(value, "shape", ()):
        return f"array{value.shape}"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{name!r}: {_shown(part)}" for name, part in value.items()) + "}"
    if isinstance(value, (tuple, list)) and len(value) > FEW:
        return f"{type(value).__name__} of {len(value)} {type(value[0]).__name__}"
    return repr(value)
