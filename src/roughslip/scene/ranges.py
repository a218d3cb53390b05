"""Sections `map` and `design` of a scene: ranges of parameters, of figure_map and figure_design."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal

from roughslip.scene.expansion import AUTO
from roughslip.scene.fields import Section, group, integer, many, number, section
from roughslip.scene.mistakes import Mistake, Values, missing, refused, shown, strictly_increasing

Range = tuple[float, ...] | Literal["auto"] | None

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
        or_word=AUTO,
        default=None,
    )


@section
class Ranges(Section):
    """Ranges of parameters, spaced evenly in their logarithm, or evenly from zero."""

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


@section
class StickSlipMap(Ranges):
    """Probability of stick-slip over two parameters, of figure_map; damping and belt velocity where none is given."""

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


@section
class Weights(Section):
    """Cost of a change of each parameter by a factor of e; 1 where none is given."""

    damping: float = number("Of the damping ratio", above=0, at_most=1e6, default=1.0)
    belt_velocity: float = number("Of the velocity of the belt", above=0, at_most=1e6, default=1.0)
    mass: float = number("Of the mass", above=0, at_most=1e6, default=1.0)
    stiffness: float = number("Of the stiffness", above=0, at_most=1e6, default=1.0)
    load: float = number("Of the normal force", above=0, at_most=1e6, default=1.0)
    windows: float = number("Of the number of windows", above=0, at_most=1e6, default=1.0)
    correlation_length: float = number("Of the correlation length", above=0, at_most=1e6, default=1.0)
    mean_friction: float = number("Of the mean friction coefficient", above=0, at_most=1e6, default=1.0)


@section
class Design(Ranges):
    """Two or three parameters and the cheapest change of them that keeps stick-slip rare, of figure_design.

    The cost is the sum of weight |log(value / scene's own)|.
    """

    probability: float = number("Largest probability of stick-slip", above=0, below=0.5, default=0.05)
    weights: Weights | None = group(Weights)
    realisations: int = integer(
        "Realisations of the friction process, the same at every point", at_least=8, at_most=10000, default=100
    )
    duration_periods: float = number(
        "Duration of a run in natural periods, of which the second half counts", at_least=20, at_most=10000, default=40
    )


# In an overlay, the ranges of a section replace those inherited. Another oscillator or friction has its own ranges.
_OF_OTHERS = ("ensemble.damping_ratios", *(f"map.{key}" for key in KEYS.values()))
REPLACES: dict[str, dict[str, tuple[str, ...]]] = {
    "": {"oscillator": _OF_OTHERS, "friction": _OF_OTHERS},
    **{
        name: {key: tuple(other for other in KEYS.values() if other != key) for key in KEYS.values()}
        for name in ("map", "design")
    },
}
Z2 = 1.959963984540054**2  # of the 95 % interval of a probability


def mistakes(scene: Values) -> Iterator[Mistake]:
    """A map has two parameters, or none for the default; a design has two or three, and runs enough for its limit."""
    yield from _range_mistakes(scene, "map", (0, 2))
    yield from _range_mistakes(scene, "design", (2, 3))
    design = scene.get("design")
    if not isinstance(design, dict):
        return
    limit, runs = design.get("probability", 0.05), design.get("realisations", 100)
    if limit is not None and runs is not None and Z2 / (runs + Z2) > limit:
        least = f"at least {int(min(Z2 / limit - Z2, 1e18)) + 1}, or the interval of no stick-slip at all exceeds"
        yield refused(runs, f"{least} design.probability = {shown(limit)}", "design.realisations")
    for name in design.get("weights") or {}:
        if name in KEYS and KEYS[name] not in design:
            yield missing("its weight is given", f"design.{KEYS[name]}", f"design.weights.{name}")


def _range_mistakes(scene: Values, name: str, allowed: tuple[int, ...]) -> Iterator[Mistake]:
    found = scene.get(name)
    if not isinstance(found, dict):
        return
    given = [key for key in KEYS.values() if key in found]
    if len(given) not in allowed:
        ranges = f"{len(given)} ranges are given ({', '.join(given) or 'none'})"
        yield Mistake((name,), f"{ranges}; give {' or '.join(map(str, allowed))} of {', '.join(KEYS.values())}")
    for key in given:
        if isinstance(found[key], list) and not strictly_increasing(found[key]):
            yield refused(found[key], "strictly increasing", f"{name}.{key}")
