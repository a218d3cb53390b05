"""Section `map` of a scene: the ranges of parameters of figure_map."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from roughslip.scene.auto import Auto
from roughslip.scene.fields import Section, integer, many, number, section
from roughslip.scene.mistakes import Mistake, Values, refused, strictly_increasing

Range = Auto[tuple[float, ...]] | None

# Keys of ranges by the parameters of stages.from_scene.variation.
KEYS = {
    "damping": "damping_ratios",
    "belt_velocity": "belt_velocities_m_per_s",
    "mass": "masses_kg",
    "stiffness": "stiffnesses_n_per_m",
    "load": "normal_forces_n",
    "windows": "windows_in_parallel",
    "correlation_length": "correlation_lengths_m",
    "mean_friction": "mean_friction_coefficients",
}


def _range(what: str, unit: str = "-", **bounds: Any) -> Any:
    return many(
        f"First and last {what}; auto for a range around the scene's own",
        number(what.capitalize(), unit, **bounds),
        fewest=2,
        most=2,
        or_auto=True,
        default=None,
    )


@section
class StickSlipMap(Section):
    """Probability of stick-slip over two parameters, of figure_map; damping and belt velocity where none is given.

    Ranges are spaced evenly in their logarithm, or evenly from zero."""

    damping_ratios: Range = _range("damping ratio", at_least=0, at_most=10)
    belt_velocities_m_per_s: Range = _range("velocity of the belt", "m/s", above=0, at_most=1000)
    masses_kg: Range = _range("mass; spring and damper stay", "kg", above=0, at_most=1e6)
    stiffnesses_n_per_m: Range = _range("stiffness; mass and damper stay", "N/m", above=0, at_most=1e15)
    normal_forces_n: Range = _range("normal force", "N", above=0, at_most=1e9)
    windows_in_parallel: Range = _range("number of windows in parallel", at_least=1, at_most=1e6)
    correlation_lengths_m: Range = _range("correlation length of friction", "m", above=0, at_most=1)
    mean_friction_coefficients: Range = _range(
        "mean friction coefficient; its scatter is in proportion", above=0, at_most=10
    )
    points: int = integer("Points on either axis; few of them are run", at_least=5, at_most=200, default=33)
    computed_points: int = integer(
        "Points that are run, put where the probability changes; a spline gives the others",
        at_least=16,
        at_most=1000,
        default=56,
    )
    realisations: int = integer(
        "Realisations of the friction process, the same at every point", at_least=8, at_most=10000, default=20
    )
    duration_periods: float = number(
        "Duration of a run in natural periods, of which the second half counts", at_least=20, at_most=10000, default=40
    )


# In an overlay, the ranges of a section replace those inherited. Another oscillator or friction has its own ranges.
_OF_OTHERS = ("ensemble.damping_ratios", *(f"map.{key}" for key in KEYS.values()))
REPLACES: dict[str, dict[str, tuple[str, ...]]] = {
    "": {"oscillator": _OF_OTHERS, "friction": _OF_OTHERS},
    "map": {key: tuple(other for other in KEYS.values() if other != key) for key in KEYS.values()},
}


def mistakes(scene: Values) -> Iterator[Mistake]:
    """A map has two parameters, or none for the default."""
    found = scene.get("map")
    if not isinstance(found, dict):
        return
    given = [key for key in KEYS.values() if key in found]
    if len(given) not in (0, 2):
        ranges = f"{len(given)} ranges are given ({', '.join(given)})"
        yield Mistake(("map",), f"{ranges}; give 0 or 2 of {', '.join(KEYS.values())}")
    for key in given:
        if isinstance(found[key], list) and not strictly_increasing(found[key]):
            yield refused(found[key], "strictly increasing", f"map.{key}")
