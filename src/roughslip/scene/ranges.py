"""Section `map` of a scene: two parameters of figure_map and their ranges."""

from __future__ import annotations

from collections.abc import Iterator

from roughslip.scene.auto import AUTO, Auto
from roughslip.scene.fields import Section, choice, integer, many, number, section
from roughslip.scene.mistakes import Mistake, Values, refused

Range = Auto[tuple[float, ...]]

# By the parameters of stages.from_scene.variation, the smallest and the largest value. Only damping may be zero.
LIMITS = {
    "damping": (0.0, 10.0),
    "belt_velocity": (0.0, 1000.0),
    "mass": (0.0, 1e6),
    "stiffness": (0.0, 1e15),
    "load": (0.0, 1e9),
    "windows": (1.0, 1e6),
    "correlation_length": (0.0, 1.0),
    "mean_friction": (0.0, 10.0),
}


@section
class StickSlipMap(Section):
    """Probability of stick-slip over two parameters, of figure_map."""

    parameters: tuple[str, ...] = many(
        "The two parameters that vary; the other parts of the machine stay, as spring and damper of another mass",
        choice("A parameter", tuple(LIMITS)),
        fewest=2,
        most=2,
        unique=True,
        default=["damping", "belt_velocity"],
    )
    ranges: tuple[Range, ...] = many(
        "First and last value of each, in SI units, or auto for a range around the scene's own; auto where not given. "
        "A range is spaced evenly in its logarithm, or evenly from zero",
        many("A range", number("A value", at_least=0, at_most=1e15), fewest=2, most=2, or_auto=True),
        fewest=2,
        most=2,
        default=[AUTO, AUTO],
    )
    points: int = integer(
        "Points on either axis, of which a quarter are run, at most 56", at_least=8, at_most=200, default=33
    )
    realisations: int = integer(
        "Realisations of the friction process, the same at every point", at_least=8, at_most=10000, default=20
    )
    duration_periods: float = number(
        "Duration of a run in natural periods, of which the second half counts", at_least=20, at_most=10000, default=40
    )


# In an overlay, another oscillator or friction has its own ranges, and so have other parameters.
_OF_OTHERS = ("ensemble.damping_ratios", "map.ranges")
REPLACES: dict[str, dict[str, tuple[str, ...]]] = {
    "": {"oscillator": _OF_OTHERS, "friction": _OF_OTHERS},
    "map": {"parameters": ("ranges",)},
}


def mistakes(scene: Values) -> Iterator[Mistake]:
    """A range rises within the limits of its parameter."""
    asked = scene.get("map")
    if not isinstance(asked, dict) or not asked.get("ranges"):
        return
    parameters = asked.get("parameters", ["damping", "belt_velocity"]) or ()
    for parameter, values in zip(parameters, asked["ranges"], strict=False):
        low, high = LIMITS[parameter]
        if values != AUTO and not low <= values[0] < values[1] <= high:
            allowed = f"for {parameter} a smaller and a larger number from {low:g} to {high:g}, or {AUTO}"
            yield refused(values, allowed, "map.ranges", "map.parameters")
        elif values != AUTO and values[0] == 0 and parameter != "damping":
            yield refused(values, f"for {parameter} a first number above 0", "map.ranges", "map.parameters")
