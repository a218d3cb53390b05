"""Numbers of a scene that are given, or asked for by the word `auto` and then found.

A rule of the scene or a stage finds them from an accuracy. `Auto[int]` is the type of such a number in a scene.
"""

from __future__ import annotations

from typing import Literal, TypeAlias, TypeVar

AUTO: Literal["auto"] = "auto"

T = TypeVar("T")
Auto: TypeAlias = T | Literal["auto"]


def unless_auto(value: Auto[T]) -> T | None:
    """The number, or None where it is asked for."""
    return None if value == AUTO else value  # type: ignore[return-value]
