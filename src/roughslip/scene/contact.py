"""Sections `material`, `square` and `strip` of a scene: what is pressed against a rigid plane."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterator

from roughslip.limits import FUNCTIONALS, MOST_NUMBERS, MOST_WINDOWS, TRAINING_SPACING
from roughslip.scene.expansion import designs_fit, terms
from roughslip.scene.fields import Section, integer, many, number, section
from roughslip.scene.mistakes import (
    MEMORY,
    Mistake,
    Rule,
    Values,
    increasing,
    missing,
    not_together,
)

MOST_NODES = 1024  # along an edge of a square: 8 MB a field


@section
class Material(Section):
    """Half-space, elastic, or elastic and plastic where a hardness is given."""

    young_modulus_pa: float = number("Young's modulus, from soft gels to diamond", "Pa", minimum=1000, maximum=1e13)
    poisson_ratio: float = number("Poisson's ratio", above=-1, maximum=0.5)
    hardness_pa: float | None = number(
        "Highest contact pressure, at which the surface yields; without it the contact is elastic",
        "Pa",
        above=0,
        maximum=1e13,
        default=None,
    )


@section
class Square(Section):
    """Square surface of figure 2, a truncated Karhunen-Loeve expansion in contact with a rigid plane."""

    edge_m: float = number("Edge of the square", "m", above=0, maximum=1)
    nodes: int = integer("Nodes along an edge, and cells", minimum=2, maximum=MOST_NODES)
    modes: int | None = integer(
        "Random modes of the Karhunen-Loeve expansion, the mean not counted; at most nodes^2",
        minimum=1,
        maximum=262144,
        default=None,
    )
    variance_share: float | None = number(
        "In place of modes: share of the variance over the mesh that the modes must carry. The fewest such modes are "
        "taken. A field that needs more than a quarter of all modes is refused",
        above=0,
        maximum=1,
        default=None,
    )
    penetration_percentile: float = number(
        "The plane stands at the height that this percentage of the ensemble of heights exceeds; 50 is the median",
        "%",
        above=0,
        below=100,
    )
    monte_carlo_samples: int = integer("Surfaces of the Monte Carlo reference", minimum=100, maximum=5_000_000)
    latin_hypercube_samples: int = integer(
        "Surfaces of the Latin hypercube designs. Each full 4000 are a design of their own, to which eqs. (8) and (9) "
        "of the paper are fitted, on the samples in contact alone; with fewer it breaks down at median penetration. "
        "Two designs or more give an interval",
        minimum=8000,
        maximum=1_000_000,
    )


@section
class Strip(Section):
    """Long strip on whose sliding windows the friction coefficient is evaluated."""

    length_m: float = number(
        "Length of the strip along the belt on which windows lie, at least four windows", "m", above=0, maximum=1
    )
    margin_m: float = number(
        "Length solved beyond either end and not used, because the ends of a contact carry more pressure",
        "m",
        minimum=0,
        maximum=1,
    )
    width_m: float = number("Width of strip and windows across the belt", "m", above=0, maximum=1)
    cell_m: float = number(
        "Edge of the square cells; length, margin, width, window and spacing are whole multiples of it",
        "m",
        above=0,
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
        maximum=99,
    )
    samples: int = integer(
        "Strips that are solved; a bootstrap over strips needs at least 8. With load, periodic cells of 8 "
        "windows, or fewer of as many in all, at least 16",
        minimum=8,
        maximum=100_000,
    )
    training_samples: int = integer(
        "Number of the first solved strips that also train the expansion", minimum=1, maximum=100_000
    )
    expansion_spacing_m: float | None = number(
        "Distance of the columns at which the expansion is evaluated, for smooth heights a third of the correlation "
        "length; strip.cell_m where not given",
        "m",
        above=0,
        maximum=1,
        default=None,
    )
    expansion_samples: int = integer(
        "Strips that the expansion is evaluated on, the solved ones among them", minimum=8, maximum=1_000_000
    )


LEVELS = "strip.penetration_percentiles"
MODES, SHARE = "square.modes", "square.variance_share"
EXTRAPOLATE, LENGTHS = "numerics.extrapolate_mesh", "length_m margin_m width_m window_m window_spacing_m"
CELLS, ROWS = 4_000_000, 3  # of a strip at most, and across it at least
MOST_TRAINING = 400_000_000  # pressures in all cells of the training strips at most: 3.2 GB
MULTIPLES = {
    "cell_m": f"{LENGTHS} expansion_spacing_m",
    "expansion_spacing_m": "length_m window_m window_spacing_m",
    "window_spacing_m": "window_m",
}

REPLACES: dict[str, tuple[str, ...]] = {MODES: (SHARE,), SHARE: (MODES,)}


def training_columns(columns: float) -> int:
    """Columns of a strip that train the expansion, as from_scene.geometry counts them."""
    return math.ceil((columns - TRAINING_SPACING // 2) / TRAINING_SPACING) if columns < CELLS else CELLS


def _is_multiple(length: float, cell: float) -> bool:
    cells = length / cell
    return math.isfinite(cells) and abs(cells - round(cells)) <= 1e-9 * cells


def _training_fits(n: int, levels: list[float], cell: float, length: float, margin: float, width: float) -> bool:
    """Whether the training strips fit into memory; another rule refuses more than CELLS."""
    cells = (length + 2 * margin) / cell * (width / cell)
    return cells > CELLS or n * len(levels) * cells <= MOST_TRAINING


RULES = (
    *(
        Rule(
            (strips, LEVELS, "strip.length_m", "strip.window_m", "strip.window_spacing_m"),
            lambda n, levels, length, window, spacing: (
                n * len(levels) * ((length - window) / spacing + 1) <= MOST_WINDOWS
            ),
            f"strips times {LEVELS} times windows of a strip at most {MOST_WINDOWS} (2.5 GB of memory)",
        )
        for strips in ("strip.samples", "strip.expansion_samples")
    ),
    Rule(
        ("strip.training_samples", LEVELS, "strip.cell_m", "strip.length_m", "strip.margin_m", "strip.width_m"),
        _training_fits,
        f"strips times {LEVELS} times cells of a strip at most {MOST_TRAINING} (3.2 GB of memory)",
    ),
    Rule((MODES, "square.nodes"), lambda m, n: m <= n**2, "at most square.nodes^2 = {1}^2"),
    Rule(
        (MODES, "square.nodes"),
        lambda m, n: m > n**2 or m * n**2 <= MOST_NUMBERS,
        f"modes times nodes^2 at most {MEMORY}, here with {{1}} nodes",
    ),
    designs_fit("square.latin_hypercube_samples"),
    *(
        Rule((f"strip.{length}", f"strip.{step}"), _is_multiple, f"a whole multiple of strip.{step} = {{1}} [m]")
        for step, lengths in MULTIPLES.items()
        for length in lengths.split()
    ),
    Rule(
        ("strip.length_m", "strip.window_m"),
        lambda length, window: length >= 4 * window,
        "at least four times strip.window_m = {1} [m], for lags of three windows",
    ),
    Rule(
        ("strip.window_spacing_m", "strip.window_m"),
        lambda spacing, window: 2 * spacing <= window * (1 + 1e-9),
        "at most half of strip.window_m = {1} [m], for lags within the window",
    ),
    Rule(
        ("strip.width_m", "strip.cell_m"),
        lambda width, cell: not _is_multiple(width, cell) or round(width / cell) >= ROWS,
        f"at least {ROWS} times strip.cell_m = {{1}} [m], for slope and curvature across the strip",
    ),
    Rule(
        ("strip.cell_m", "strip.length_m", "strip.margin_m", "strip.width_m"),
        lambda cell, length, margin, width: (length + 2 * margin) / cell * (width / cell) < CELLS + 0.5,
        f"at most {CELLS} cells on the strip of {{1}} + 2 x {{2}} by {{3}} m",
    ),
    Rule(
        (EXTRAPOLATE, "strip.cell_m", *(f"strip.{length}" for length in LENGTHS.split())),
        lambda asked, cell, *lengths: not asked or all(_is_multiple(length, 2 * cell) for length in lengths),
        f"false, or each of strip.{LENGTHS.replace(' ', ', ')} a whole multiple of two cells, 2 x {{1}} m",
    ),
    increasing(LEVELS),
    Rule(
        (LEVELS, "friction.mean_at_median"),
        lambda percentiles, _: 50 in percentiles,
        "50 among them: friction.mean_at_median sets the shear strength there",
    ),
    Rule(
        ("strip.training_samples", "strip.length_m", "strip.cell_m", "expansion.degree"),
        lambda n, length, cell, d: n > 1 and n * training_columns(length / cell) > terms(FUNCTIONALS, d),
        f"at least 2, and enough that every {TRAINING_SPACING}th column gives more samples than "
        f"C({FUNCTIONALS} + {{3}}, {{3}})",
    ),
    Rule(("strip.training_samples", "strip.samples"), operator.le, "at most strip.samples = {1}"),
    Rule(
        ("strip.expansion_samples", "strip.samples"),
        lambda expanded, solved: expanded >= 2 * solved,
        "at least twice strip.samples = {1}",
    ),
)


def mistakes(scene: Values) -> Iterator[Mistake]:
    """The square ends at an order or at a share of the variance, one of them."""
    square = scene.get("square")
    if not isinstance(square, dict):
        return
    if "modes" not in square and "variance_share" not in square:
        yield missing(f"give it, or {SHARE}", MODES)
    elif "modes" in square and "variance_share" in square:
        yield not_together(SHARE, square["variance_share"], MODES)
