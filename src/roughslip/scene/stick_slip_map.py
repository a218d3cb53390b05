"""The stick-slip map and the lifetimes beside it: which keys go with one another."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from roughslip.scene.roughness import Mistake
from roughslip.scene.strict_yaml import shown

TARGET = "figure_map"
FORCE = "oscillator.excitation_force_n"


def mistakes(scene: dict[str, Any]) -> Iterator[Mistake]:
    """What does not go together in map and survival; what the schema refuses is left to it."""
    for section, key in (
        ("map", "belt_velocities_m_per_s"),
        ("map", "damping_ratios"),
        ("survival", "scatter_factors"),
    ):
        values = _section(scene, section).get(key)
        if (
            isinstance(values, list)
            and all(type(one) in (int, float) for one in values)
            and sorted(set(values)) != values
        ):
            yield Mistake((f"{section}.{key}",), f"{shown(values)} is not allowed; strictly increasing")
    force = _section(scene, "oscillator").get("excitation_force_n", 0)
    targets = scene.get("targets")
    if isinstance(targets, list) and TARGET in targets and type(force) in (int, float) and force > 0:
        text = f"{shown(targets)} is not allowed; {TARGET} draws limits of the free oscillator, and {FORCE} is not 0"
        yield Mistake(("targets", FORCE), text)


def _section(scene: dict[str, Any], name: str) -> dict[str, Any]:
    section = scene.get(name)
    return section if isinstance(section, dict) else {}
