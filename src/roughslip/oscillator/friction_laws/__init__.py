"""Friction laws, a module each: the name of a law in a scene is the name of its module.

The names come from the folder alone, so that reading a scene imports no law. `oscillator.laws` holds the
classes.
"""

from __future__ import annotations

from pathlib import Path

__all__ = FRICTION_LAWS = tuple(
    sorted(file.stem for file in Path(__file__).parent.glob("*.py") if file.stem != "__init__")
)
