"""Section `square` of a scene."""

from __future__ import annotations

from collections.abc import Iterator

from roughslip.scene.fields import Section, integer, number, section
from roughslip.scene.mistakes import Mistake, Values, missing, not_together

MODES, SHARE = "square.modes", "square.variance_share"


@section
class Square(Section):
    """Square surface of figure 2, a truncated Karhunen-Loeve expansion in contact with a rigid plane."""

    edge_m: float = number("Edge of the square", "m", above=0, at_most=1)
    nodes: int = integer(
        "Nodes along an edge, and cells; 1024 limits the memory of a field to 8 MB", at_least=2, at_most=1024
    )
    modes: int | None = integer(
        "Random modes of the Karhunen-Loeve expansion, the mean not counted; at most nodes^2",
        at_least=1,
        at_most=262144,
        default=None,
    )
    variance_share: float | None = number(
        "In place of modes: share of the variance over the mesh that the modes must carry. The fewest such modes are "
        "taken. A field that needs more than a quarter of all modes is refused",
        above=0,
        at_most=1,
        default=None,
    )
    penetration_percentile: float = number(
        "The plane stands at the height that this percentage of the ensemble of heights exceeds; 50 is the median",
        "%",
        above=0,
        below=100,
    )
    monte_carlo_samples: int = integer("Surfaces of the Monte Carlo reference", at_least=100, at_most=100_000_000)
    latin_hypercube_samples: int = integer(
        "Surfaces of the Latin hypercube design, to which eqs. (8) and (9) of the paper are fitted, on the samples in "
        "contact alone. Below 4000 that fit breaks down at median penetration, so fewer are not allowed",
        at_least=4000,
        at_most=1_000_000,
    )


REPLACES: dict[str, dict[str, tuple[str, ...]]] = {
    "square": {"modes": ("variance_share",), "variance_share": ("modes",)}
}


def mistakes(scene: Values) -> Iterator[Mistake]:
    """The expansion of the square ends at an order or at a share of the variance, one of them."""
    square = scene["square"]
    if "modes" not in square and "variance_share" not in square:
        yield missing(f"give it, or {SHARE}", MODES)
    elif "modes" in square and "variance_share" in square:
        yield not_together(SHARE, square["variance_share"], MODES)
