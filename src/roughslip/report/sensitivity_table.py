"""How far verdicts stand, in a line each on the report's page; what serves for all of a scene is told once."""

from __future__ import annotations

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
NEXT = 1e-2  # relative: ends as near as that are told by one number


def legend(claims: Iterable[Mapping[str, Any]], scene: str) -> str:
    """What is true of every verdict of a scene that hangs on anything, and how the lines are to be read."""
    common = _common(claims)
    told = f"No verdict depends on {', '.join(map(_name, common))}. " if common else ""
    return (
        f"{told}Notes end in the ranges over which the verdict stands, all else being as it is: beyond a starred end "
        "no change was found within a factor of ten, or nothing is known; from a number in brackets on it is known to "
        f"be another. The remaining inputs need a run, or contact solves: edit {scene}.yaml and run "
        f"snakemake -j2 {scene}"
    )


def standing_line(claim: Mapping[str, Any], claims: Iterable[Mapping[str, Any]]) -> str:
    """How far the verdict on one of the claims of a scene stands; empty for one that was not tested."""
    stands = claim.get("stands")
    if stands is None:
        return ""
    if stands["always"]:
        return f"Stands in any case: {stands['always']}"
    common = _common(claims)
    parts = [
        *map(_range, stands["ranges"]),
        _list("any ", [_name(entry) for entry in stands["any_value"] if entry not in common]),
        _list("needs a run: ", [_name(entry) for entry in stands["new_runs"]]),
        _list("needs contact solves: ", dict.fromkeys(_section(entry) for entry in stands["new_solves"])),
    ]
    return f"Stands for {'; '.join(part for part in parts if part)}"


def _common(claims: Iterable[Mapping[str, Any]]) -> list[str]:
    """What may have any value for every verdict that hangs on something."""
    told = [claim.get("stands") for claim in claims]
    every = [stands["any_value"] for stands in told if stands and not stands["always"]]
    return [entry for entry in every[0] if all(entry in one for one in every)] if every else []


def _list(head: str, entries: Iterable[str]) -> str:
    told = ", ".join(entries)
    return head + told if told else ""


def _section(entry: str) -> str:
    section = entry.partition(".")[0]
    return NAMES.get(section, section)


def _name(entry: str) -> str:
    """A key of the scene by its last word, without its unit; what is said beside it stays."""
    return " ".join(_word(word) for word in entry.split(" "))


def _word(word: str) -> str:
    section, _, last = word.partition(".")
    if not section.isalpha() or not last:
        return word
    return NAMES.get(word, last.removesuffix(_unit(last)[0]).replace("_", " "))


def _unit(key: str) -> tuple[str, str]:
    """The end of a key that tells its unit, and the unit."""
    return next(((end, f" {unit}") for end, unit in UNITS.items() if key.endswith(end)), ("", ""))


def _range(found: Mapping[str, Any]) -> str:
    low, high = (_end(found[end], found[f"{end}_changes"]) for end in ("low", "high"))
    beside = f" ({found['by']})" if found["by"].startswith("with ") else ""
    return f"{_name(found['input'])} {low} to {high}{_unit(found['input'])[1]}{beside}"


def _end(stands: float, changes: float | None) -> str:
    if changes is None:
        return f"{stands:.4g}{'*' if stands else ''}"
    near = 1 if isinstance(stands, int) else NEXT * abs(stands)
    return f"{stands:.4g}" if abs(changes - stands) <= near else f"{stands:.4g} ({changes:.4g})"
