"""The friction curve of a scene in a sentence."""

from collections.abc import Mapping
from typing import Any

from roughslip.report.words import amount, digits


def friction_curve(scene: Mapping[str, Any], origins: Mapping[str, str], name: str = "") -> str:
    """The friction curve of a scene of that name in a sentence. origins : the scene of each value, by dotted key"""
    oscillator, record = scene["oscillator"], (scene.get("friction") or {}).get("record")
    if record:
        several = len(record["file"]) > 1
        return f"The curve is that of the record{'s' if several else ''} {', '.join(record['file'])}."
    law, static, table = (oscillator.get(name) for name in ("law", "static_friction", "friction_table"))
    key = {"table": "friction_table", "stribeck": "stribeck_decay_s_per_m", "coulomb": "static_friction"}.get(
        law, "law"
    )
    of = f"scene {base}" if (base := origins.get(f"oscillator.{key}", name)) != name else "the scene"
    if law == "table":
        static, (speed, last) = table[0][1] if static is None else static, table[-1]
        ends = f"{digits(static)} at rest, {digits(last)} at {amount(speed, 'm s-1')}"
        return f"The curve is the friction_table of {of}: {ends}."
    return f"The curve is the law {law} of {of}{'' if static is None else f': {digits(static)} at rest'}."
