"""The mass on the belt: which keys of its friction go with one another."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from roughslip.scene.roughness import Mistake
from roughslip.scene.strict_yaml import shown

LAW, TABLE, STATIC = "oscillator.law", "oscillator.friction_table", "oscillator.static_friction"
FOLLOWS, TIME = "oscillator.friction_follows", "oscillator.correlation_time_s"
DRIVE, FORCE = "oscillator.excitation_frequency_rad_per_s", "oscillator.excitation_force_n"
BY_PERIOD = "ensemble.count_by_period"
STRIBECK, COULOMB, TABULATED = "stribeck", "coulomb", "table"

# In an overlay: by section, what a key takes the place of, where the overlay does not give that too.
REPLACES: dict[str, dict[str, tuple[str, ...]]] = {
    "oscillator": {"law": ("friction_table",), "friction_follows": ("correlation_time_s",)}
}


def mistakes(scene: dict[str, Any]) -> Iterator[Mistake]:
    """What does not go together in oscillator and friction; what the schema refuses is left to it."""
    section = scene["oscillator"]
    law, table = section.get("law", STRIBECK), section.get("friction_table")
    if law == TABULATED and table is None:
        yield Mistake((TABLE, LAW), f"missing; {LAW} = {TABULATED} needs it")
    elif law != TABULATED and table is not None:
        yield Mistake((TABLE, LAW), f"not allowed beside {LAW} = {law}; only {TABULATED} takes it")
    elif isinstance(table, dict):
        yield from _table_mistakes(table, section.get("static_friction"))
    follows, time = section.get("friction_follows", "slip"), section.get("correlation_time_s")
    if follows == "time" and time is None:
        yield Mistake((TIME, FOLLOWS), f"missing; {FOLLOWS} = time needs it")
    elif follows != "time" and time is not None:
        yield Mistake((TIME, FOLLOWS), f"{shown(time)} is not allowed beside {FOLLOWS} = {follows}; only time takes it")
    force, frequency = section.get("excitation_force_n"), section.get("excitation_frequency_rad_per_s")
    if _number(force) and force > 0 and frequency == 0:
        text = f"{shown(frequency)} is not allowed; a number > 0 [rad/s] where {FORCE} is not 0"
        yield Mistake((DRIVE, FORCE), text)
    ensemble = scene.get("ensemble")
    if _number(force) and force > 0 and isinstance(ensemble, dict) and ensemble.get("count_by_period") is True:
        yield Mistake(
            (BY_PERIOD, FORCE), f"true is not allowed where {FORCE} is not 0; no cycle repeats the last there"
        )
    static = section.get("static_friction")
    for key, mean in _means(scene):
        if law != TABULATED and _number(static) and _number(mean) and static < mean:
            reason = "or stick holds less than slip" if law == COULOMB else "or eq. (13) turns negative at high speed"
            yield Mistake((STATIC, key), f"{shown(static)} is not allowed; at least {key} = {mean}, {reason}")


def _table_mistakes(table: dict[str, Any], static: Any) -> Iterator[Mistake]:
    speeds: Any = table.get("speeds_m_per_s")
    values: Any = table.get("values")
    if not all(isinstance(row, list) and row and all(map(_number, row)) for row in (speeds, values)):
        return
    if len(speeds) != len(values):
        text = f"{len(values)} values are not allowed; one for each of the {len(speeds)} speeds"
        yield Mistake((f"{TABLE}.values", f"{TABLE}.speeds_m_per_s"), text)
    if speeds[0] != 0 or sorted(set(speeds)) != speeds:
        text = f"{shown(speeds)} is not allowed; strictly increasing speeds from 0 on"
        yield Mistake((f"{TABLE}.speeds_m_per_s",), text)
    if _number(static) and static < values[0]:
        text = f"{shown(static)} is not allowed; at least the first of {TABLE}.values = {values[0]}"
        yield Mistake((STATIC, f"{TABLE}.values"), f"{text}, or stick holds less than slip")


def _means(scene: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """The mean friction coefficient by its key, in the forms that the scene gives."""
    friction = scene.get("friction")
    if isinstance(friction, dict):
        yield "friction.mean_at_median", friction.get("mean_at_median")
        if isinstance(friction.get("statistics"), dict):
            yield "friction.statistics.mean", friction["statistics"].get("mean")


def _number(value: Any) -> bool:
    return type(value) in (int, float)
