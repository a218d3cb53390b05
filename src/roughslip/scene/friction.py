"""Section `friction` of a scene: from solved pressures, or given as statistics."""

from __future__ import annotations

from collections.abc import Iterator

from roughslip.scene.fields import Section, group, many, number, section
from roughslip.scene.mistakes import Mistake, Values, missing, not_together


@section
class FrictionStatistics(Section):
    """Friction process as numbers, in place of surfaces and contact."""

    mean: float = number("Mean friction coefficient, mu_fit of eq. (13)", above=0, at_most=10)
    standard_deviation: float = number("Standard deviation of the friction coefficient", above=0, at_most=10)
    correlation_length_m: float = number(
        "Length of the exponential autocorrelation along the belt", "m", above=0, at_most=1
    )
    beta_shapes: tuple[float, float] = many(
        "Shapes of the Beta marginal", number("A shape", above=0, at_most=1000), fewest=2, most=2
    )


@section
class Friction(Section):
    """Friction coefficient from solved pressures (mean_at_median, least_contact_fraction), or given as statistics."""

    mean_at_median: float = number(
        "Mean friction coefficient at median penetration; sets the shear strength", above=0, at_most=10, default=None
    )
    least_contact_fraction: float = number(
        "A window with a smaller fraction of its area in contact has no friction coefficient",
        above=0,
        at_most=0.1,
        default=None,
    )
    statistics: FrictionStatistics | None = group(FrictionStatistics)


SOLVED = ("mean_at_median", "least_contact_fraction")
STATISTICS = "friction.statistics"

REPLACES: dict[str, dict[str, tuple[str, ...]]] = {
    "friction": {"statistics": SOLVED, **dict.fromkeys(SOLVED, ("statistics",))}
}


def mistakes(scene: Values) -> Iterator[Mistake]:
    """Friction has exactly one of its two forms."""
    friction = scene["friction"]
    solved = [key for key in SOLVED if key in friction]
    if "statistics" in friction:
        for key in solved:
            yield not_together(f"friction.{key}", friction[key], STATISTICS)
    elif not solved:
        yield Mistake(("friction",), f"empty; give statistics, or {' with '.join(SOLVED)}")
    elif len(solved) < len(SOLVED):
        (absent,) = set(SOLVED).difference(solved)
        yield missing(f"goes with friction.{solved[0]}", f"friction.{absent}", f"friction.{solved[0]}")
