"""Sections `material`, `square` and `strip` of a scene: what is pressed against a rigid plane."""

from __future__ import annotations

from collections.abc import Iterator

from roughslip.scene.auto import AUTO, Auto
from roughslip.scene.fields import Section, integer, many, number, section
from roughslip.scene.mistakes import Mistake, Values, missing, not_together, refused, strictly_increasing

MOST_NODES = 1024  # along an edge of a square: 8 MB a field


@section
class Material(Section):
    """Half-space, elastic, or elastic and plastic where a hardness is given."""

    young_modulus_pa: float = number("Young's modulus, from soft gels to diamond", "Pa", at_least=1000, at_most=1e13)
    poisson_ratio: float = number("Poisson's ratio", above=-1, at_most=0.5)
    hardness_pa: float | None = number(
        "Highest contact pressure, at which the surface yields; without it the contact is elastic",
        "Pa",
        above=0,
        at_most=1e13,
        default=None,
    )


@section
class Square(Section):
    """Square surface of figure 2, a truncated Karhunen-Loeve expansion in contact with a rigid plane."""

    edge_m: float = number("Edge of the square", "m", above=0, at_most=1)
    nodes: int = integer(
        "Nodes along an edge, and cells. With auto, the fewest that leave accuracy.pressure room for few samples",
        at_least=2,
        at_most=MOST_NODES,
        or_auto=True,
    )
    modes: int | None = integer(
        "Random modes of the Karhunen-Loeve expansion, the mean not counted; at most nodes^2",
        at_least=1,
        at_most=262144,
        default=None,
    )
    variance_share: float | None = number(
        "In place of modes: share of the variance over the mesh that the modes must carry. The fewest such modes are "
        "taken. A field that needs more than a quarter of all modes is refused. With auto, the lowest share that "
        "leaves accuracy.pressure room for few samples",
        above=0,
        at_most=1,
        or_auto=True,
        default=None,
    )
    penetration_percentile: float = number(
        "The plane stands at the height that this percentage of the ensemble of heights exceeds; 50 is the median",
        "%",
        above=0,
        below=100,
    )
    monte_carlo_samples: Auto[int] = integer(
        "Surfaces of the Monte Carlo reference. With auto, as many as accuracy takes",
        at_least=100,
        at_most=5_000_000,
        or_auto=True,
        default=AUTO,
    )
    latin_hypercube_samples: int = integer(
        "Surfaces of the Latin hypercube designs. Each full 4000 are a design of their own, to which eqs. (8) and (9) "
        "of the paper are fitted, on the samples in contact alone; with fewer it breaks down at median penetration",
        at_least=4000,
        at_most=1_000_000,
    )


@section
class Strip(Section):
    """Long strip on whose sliding windows the friction coefficient is evaluated."""

    length_m: float = number(
        "Length of the strip along the belt on which windows lie, at least four windows", "m", above=0, at_most=1
    )
    margin_m: float = number(
        "Length solved beyond either end and not used, because the ends of a contact carry more pressure",
        "m",
        at_least=0,
        at_most=1,
    )
    width_m: float = number("Width of strip and windows across the belt", "m", above=0, at_most=1)
    cell_m: float = number(
        "Edge of the square cells; length, margin, width, window and spacing are whole multiples of it. With auto, the "
        "coarsest that leave accuracy.friction_mean and accuracy.friction_std room for few strips",
        "m",
        above=0,
        or_auto=True,
    )
    window_m: float = number("Length of a window along the belt", "m", above=0)
    window_spacing_m: float = number(
        "Distance between the starts of neighbouring windows, the step of the lags of the autocorrelation",
        "m",
        above=0,
    )
    penetration_percentiles: tuple[float, ...] = many(
        "Penetrations of figure 3, strictly increasing; 50 sets the shear strength",
        number("A penetration, as square.penetration_percentile", "%", above=0, below=100),
        most=99,
    )
    light_percentiles: tuple[float, ...] | None = many(
        "Further penetrations, below those, strictly increasing, at which load and scatter of pads alone are taken: "
        "few windows touch there. With load, from 0.001 on where not given",
        number("A penetration, as square.penetration_percentile", "%", above=0, below=50),
        most=20,
        default=None,
    )
    samples: Auto[int] = integer(
        "Strips that are solved; a bootstrap over strips needs at least 8. With auto, as many as accuracy takes",
        at_least=8,
        at_most=100_000,
        or_auto=True,
        default=AUTO,
    )
    training_samples: int = integer(
        "Number of the first solved strips that also train the expansion", at_least=1, at_most=100_000
    )
    expansion_spacing_m: float | None = number(
        "Distance of the columns at which the expansion is evaluated, for smooth heights a third of the correlation "
        "length; strip.cell_m where not given",
        "m",
        above=0,
        at_most=1,
        default=None,
    )
    expansion_samples: Auto[int] = integer(
        "Strips that the expansion is evaluated on, the solved ones among them. With auto, as many as accuracy takes",
        at_least=8,
        at_most=1_000_000,
        or_auto=True,
        default=AUTO,
    )


LIGHT, LEVELS = "strip.light_percentiles", "strip.penetration_percentiles"
MODES, SHARE = "square.modes", "square.variance_share"

REPLACES: dict[str, dict[str, tuple[str, ...]]] = {
    "square": {"modes": ("variance_share",), "variance_share": ("modes",)},
}


def mistakes(scene: Values) -> Iterator[Mistake]:
    """The square ends at an order or at a share of the variance, one of them. Light levels lie below the others."""
    strip = scene.get("strip") or {}
    light, levels = strip.get("light_percentiles"), strip.get("penetration_percentiles")
    if light and levels and not strictly_increasing([*light, levels[0]]):
        allowed = f"strictly increasing, below the first of {LEVELS} = {levels[0]}"
        yield refused(light, allowed, LIGHT, LEVELS)
    square = scene["square"]
    if "modes" not in square and "variance_share" not in square:
        yield missing(f"give it, or {SHARE}", MODES)
    elif "modes" in square and "variance_share" in square:
        yield not_together(SHARE, square["variance_share"], MODES)
