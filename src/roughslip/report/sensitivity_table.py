"""Sensitivity of verdicts to assumptions: a bar a parameter and a line for the rest; what all share is written once."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

UNITS = {"_rad_per_s": "rad/s", "_m_per_s": "m/s", "_kg": "kg", "_pa": "Pa", "_n": "N", "_m": "m"}
NAMES = {
    "material.young_modulus_pa": "Young's modulus",
    "material.poisson_ratio": "Poisson's ratio",
    "strip.samples": "strips",
    "ensemble.realisations": "runs",
    "ensemble.damping_ratios": "list of damping ratios",
    "roughness": "shape of the roughness",
    "square": "mesh, modes and samples of the square",
    "strip": "mesh and penetrations of the strip",
}
DECADE = 10.0  # a bar reaches from a tenth of the value in the scene to ten times it
NEXT = 1e-2  # relative: two ends as close as that are printed as one number


def legend(claims: Iterable[Mapping[str, Any]], scene: str) -> str:
    """Inputs that no verdict of a scene depends on, and how to read the lines."""
    common = _common_inputs(claims)
    independent = f"No verdict depends on {', '.join(map(_name, common))}. " if common else ""
    return (
        f"{independent}Bars show the range over which a verdict stays the same, with all other inputs unchanged, from "
        "a tenth of the value in the scene to ten times it; a line marks that value. A star marks an end without a "
        "change in this range, or beyond which nothing is known. A number in brackets marks where the verdict is known "
        "to differ. The remaining inputs need a run, or contact solves: edit "
        f"{scene}.yaml and run snakemake -j2 {scene}"
    )


def sensitivity_bars(claim: Mapping[str, Any]) -> list[dict[str, Any]]:
    """A row a parameter with a range over which the verdict stays: its text, and both ends of a bar [% of it]."""
    return [
        {"text": _range(found), **{end: _place(found[end], found["value"]) for end in ("low", "high")}}
        for found in (claim.get("stands") or {}).get("ranges", ())
    ]


def _place(end: float, value: float) -> float:
    """Where a number lies on a logarithmic bar around the value of the scene [% of its length]."""
    if end * value <= 0.0:
        return 0.0
    return min(max(50.0 * (1.0 + math.log(end / value, DECADE)), 0.0), 100.0)


def sensitivity_line(claim: Mapping[str, Any], claims: Iterable[Mapping[str, Any]]) -> str:
    """Inputs that may have any value, and those that need a run or solves; empty for a claim that was not tested."""
    stands = claim.get("stands")
    if stands is None:
        return ""
    if stands["always"]:
        return f"Holds in any case: {stands['always']}"
    common = _common_inputs(claims)
    parts = [
        _list("Holds for any ", [_name(entry) for entry in stands["any_value"] if entry not in common]),
        _list("Needs a run: ", [_name(entry) for entry in stands["new_runs"]]),
        _list("Needs contact solves: ", dict.fromkeys(_section(entry) for entry in stands["new_solves"])),
    ]
    return ". ".join(part for part in parts if part)


def _common_inputs(claims: Iterable[Mapping[str, Any]]) -> list[str]:
    """Inputs that may have any value for every verdict that depends on something."""
    found = [claim.get("stands") for claim in claims]
    every = [stands["any_value"] for stands in found if stands and not stands["always"]]
    return [entry for entry in every[0] if all(entry in one for one in every)] if every else []


def _list(head: str, entries: Iterable[str]) -> str:
    text = ", ".join(entries)
    return head + text if text else ""


def _section(entry: str) -> str:
    section = entry.partition(".")[0]
    return NAMES.get(section, section)


def _name(entry: str) -> str:
    """A key of the scene by its last word, without its unit; further words are kept."""
    return " ".join(_word(word) for word in entry.split(" "))


def _word(word: str) -> str:
    section, _, last = word.partition(".")
    if not section.isalpha() or not last:
        return word
    return NAMES.get(word, last.removesuffix(_end_of_unit(last)).replace("_", " "))


def _end_of_unit(key: str) -> str:
    """The end of a key that names its unit; empty without one."""
    return next((end for end in UNITS if key.endswith(end)), "")


def unit_of(key: str) -> str:
    """The unit of a key of the scene, "1" without one."""
    return UNITS.get(_end_of_unit(key), "1")


def _range(found: Mapping[str, Any]) -> str:
    low, high = (_end(found[end], found[f"{end}_changes"]) for end in ("low", "high"))
    condition = f" ({found['by']})" if found["by"].startswith("with ") else ""
    unit = unit_of(found["input"])
    return f"{_name(found['input'])} {low} to {high}{'' if unit == '1' else f' {unit}'}{condition}"


def _end(stands: float, changes: float | None) -> str:
    if changes is None:
        return f"{stands:.4g}{'*' if stands else ''}"
    near = 1 if isinstance(stands, int) else NEXT * abs(stands)
    return f"{stands:.4g}" if abs(changes - stands) <= near else f"{stands:.4g} ({changes:.4g})"
