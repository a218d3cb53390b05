"""Warnings on a scene that is allowed but implausible, from its values alone and before anything is solved."""

from __future__ import annotations

from typing import Any


def warnings(scene: dict[str, Any]) -> list[str]:
    """A line for each thing that the scene hardly means: what, its number, the key, and what to do."""
    return []
