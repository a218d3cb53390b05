"""Sections `map` and `survival` of a scene, of figure_map."""

from __future__ import annotations

from collections.abc import Iterator

from roughslip.scene.fields import Section, integer, many, number, section
from roughslip.scene.mistakes import Mistake, Values, given, refused, strictly_increasing
from roughslip.scene.oscillator import FORCE


@section
class StickSlipMap(Section):
    """Probability of stick-slip over damping and belt velocity, of figure_map."""

    belt_velocities_m_per_s: tuple[float, ...] = many(
        "First and last velocity of the belt; those between are spaced evenly in their logarithm",
        number("A velocity, as oscillator.belt_velocity_m_per_s", "m/s", above=0, at_most=1000),
        fewest=2,
        most=2,
    )
    damping_ratios: tuple[float, ...] = many(
        "First and last damping ratio; those between are spaced evenly",
        number("A damping ratio, as oscillator.damping_ratio", at_least=0, at_most=10),
        fewest=2,
        most=2,
    )
    points: int = integer("Points on either axis", at_least=2, at_most=200)
    realisations: int = integer(
        "Realisations of the friction process, the same at every point", at_least=8, at_most=10000
    )
    duration_periods: float = number(
        "Duration of a run in natural periods, of which the second half counts", at_least=20, at_most=10000
    )


@section
class Survival(Section):
    """Lifetimes of stick-slip and of steady sliding near the limit of existence, of figure_map."""

    scatter_factors: tuple[float, ...] = many(
        "Multiples of the standard deviation of friction, strictly increasing",
        number("A multiple", above=0, at_most=100),
        most=20,
    )
    points: int = integer(
        "Damping ratios around the limit of existence, as far from it as the scatter moves it", at_least=2, at_most=200
    )
    realisations: int = integer(
        "Realisations of the friction process at each, from rest on the belt and from steady sliding",
        at_least=8,
        at_most=10000,
    )
    duration_periods: float = number("Duration of a run in natural periods", at_least=20, at_most=10000)


ASCENDING = ("map.belt_velocities_m_per_s", "map.damping_ratios", "survival.scatter_factors")


def mistakes(scene: Values) -> Iterator[Mistake]:
    """What does not go together in map and survival."""
    for key in ASCENDING:
        values = given(scene, key)
        if values is not None and not strictly_increasing(values):
            yield refused(values, "strictly increasing", key)
    targets = scene.get("targets") or ()
    if "figure_map" in targets and (given(scene, FORCE) or 0) > 0:
        allowed = f"figure_map draws limits of the free oscillator, and {FORCE} is not 0"
        yield refused(targets, allowed, "targets", FORCE)
