"""Sections `material`, `square`, `expansion`, `strip` and `numerics` of a scene: what is pressed on a rigid plane."""

from __future__ import annotations

import math
import operator
from typing import Annotated, Literal

from pydantic import Field

from roughslip.limits import FUNCTIONALS, MARGIN, MOST_NUMBERS, MOST_WINDOWS, TRAINING_SPACING, WINDOWS
from roughslip.scene.mistakes import MEMORY, Rule, increasing
from roughslip.scene.section import Section, choice, many, number


class Material(Section):
    """Half-space, elastic, or elastic and plastic where a hardness is given."""

    young_modulus_pa: float = number("Young's modulus, from soft gels to diamond", "Pa", ge=1000, le=1e13)
    poisson_ratio: float = number("Poisson's ratio", gt=-1, le=0.5)
    hardness_pa: float | None = number(
        "Highest contact pressure, at which the surface yields; without it the contact is elastic",
        "Pa",
        gt=0,
        le=1e13,
        default=None,
    )


class Square(Section):
    """Square surface of figure 2, a truncated Karhunen-Loeve expansion in contact with a rigid plane."""

    edge_m: float = number("Edge of the square", "m", gt=0, le=1)
    nodes: int = number("Nodes along an edge, and cells", ge=2, le=1024)
    modes: int = number(
        "Random modes of the Karhunen-Loeve expansion, the mean not counted: at least one for each variable of our "
        "expansion, at most nodes^2",
        ge=FUNCTIONALS,
        le=262144,
    )
    monte_carlo_samples: int = number("Surfaces of the Monte Carlo reference", ge=100, le=5_000_000)
    latin_hypercube_samples: int = number(
        "Surfaces of the Latin hypercube designs. Each full 4000 are a design of their own, to which eqs. (8) and (9) "
        "of the paper are fitted, on the samples in contact alone; with fewer it breaks down at median penetration. "
        "Two designs or more give an interval",
        ge=8000,
        le=1_000_000,
    )


class Expansion(Section):
    """Polynomial chaos expansion of the pressure, fitted to all samples."""

    degree: int = number(
        "Total degree of the Hermite polynomials of the eight local functionals of the heights; there are "
        "C(8 + degree, 8)",
        ge=1,
        le=10,
    )
    target: Literal["trial_pressure", "squared_pressure"] = choice(
        "Expanded quantity. The trial_pressure is p - gap/B_ii, for meshes as coarse as the correlation length. The "
        "squared_pressure is p^2 continued outside contact, for meshes that resolve it; on coarse ones they agree"
    )
    samples: int = number(
        "Surfaces that the expansion of the square is fitted to, more than it has terms", ge=10, le=1_000_000
    )


Percentile = Annotated[float, Field(gt=0, lt=100, description="A penetration [%]")]


class Strip(Section):
    """Long strip on whose sliding windows the friction coefficient is evaluated."""

    width_m: float = number("Width of strip and windows across the belt", "m", gt=0, le=1)
    cell_m: float = number(
        "Edge of the square cells; width, window and spacing are whole multiples of it, and so is half a window",
        "m",
        gt=0,
    )
    window_m: float = number(
        "Length of a window along the belt. Windows lie on four times this length; half of it is solved beyond either "
        "end and not used, because the ends of a contact carry more pressure",
        "m",
        gt=0,
        le=1,
    )
    window_spacing_m: float = number(
        "Distance between the starts of neighbouring windows, the step of the lags of the autocorrelation",
        "m",
        gt=0,
    )
    penetration_percentiles: tuple[Percentile, ...] = many(
        "Penetrations of figure 3, strictly increasing, each as the percentage of the heights above the plane; 50 sets "
        "the shear strength",
        min_length=1,
        max_length=99,
    )
    samples: int = number(
        "Strips that are solved; a bootstrap over strips needs at least 8. With load, periodic cells of 8 "
        "windows, or fewer of as many in all, at least 16",
        ge=8,
        le=100_000,
    )
    training_samples: int = number("Number of the first solved strips that also train the expansion", ge=1, le=100_000)
    expansion_spacing_m: float | None = number(
        "Distance of the columns at which the expansion is evaluated, for smooth heights a third of the correlation "
        "length; strip.cell_m where not given",
        "m",
        gt=0,
        le=1,
        default=None,
    )
    expansion_samples: int = number(
        "Strips that the expansion is evaluated on, the solved ones among them", ge=8, le=1_000_000
    )


class Numerics(Section):
    """Tolerance of the solves, and what counts as contact."""

    contact_tolerance: float = number(
        "Relative residual to which a contact is solved; with 1e-4 the mean of A / N is known to 3e-4, its scatter to "
        "2e-3",
        ge=1e-14,
        le=0.001,
        default=1e-4,
    )

    contact_area: Literal["corrected", "nodes"] = choice(
        "corrected: a cell at the edge of a contact counts by its covered share, and the pressure at the centre of the "
        "square by its distance from the edge. With nodes, each node in contact counts as a whole cell, too much by a "
        "share of the perimeter",
        default="corrected",
    )


def terms(degree: int) -> int:
    """Terms of an expansion."""
    return math.comb(FUNCTIONALS + degree, degree)


CELLS, ROWS = 4_000_000, 3  # of a strip at most, and across it at least
MOST_TRAINING = 400_000_000  # pressures in all cells of the training strips at most: 3.2 GB
LEVELS = "strip.penetration_percentiles"
WINDOW, CELL = "strip.window_m", "strip.cell_m"
REPLACES: dict[str, tuple[str, ...]] = {}


def training_columns(columns: float) -> int:
    """Columns of a strip that train the expansion, as from_scene.geometry counts them."""
    return math.ceil((columns - TRAINING_SPACING // 2) / TRAINING_SPACING) if columns < CELLS else CELLS


def cells_of_strip(window: float, width: float, cell: float) -> float:
    """Cells of a strip with its margins."""
    return (WINDOWS + 2 * MARGIN) * window / cell * (width / cell)


def _is_multiple(length: float, cell: float) -> bool:
    cells = length / cell
    return math.isfinite(cells) and abs(cells - round(cells)) <= 1e-9 * cells


def _training_fits(n: int, levels: list[float], cell: float, window: float, width: float) -> bool:
    """Whether the training strips fit into memory; another rule refuses more than CELLS."""
    cells = cells_of_strip(window, width, cell)
    return cells > CELLS or n * len(levels) * cells <= MOST_TRAINING


RULES = (
    Rule(("square.modes", "square.nodes"), lambda modes, nodes: modes <= nodes**2, "at most square.nodes^2 = {1}^2"),
    Rule(
        ("square.modes", "square.nodes"),
        lambda modes, nodes: modes > nodes**2 or modes * nodes**2 <= MOST_NUMBERS,
        f"modes times nodes^2 at most {MEMORY}, here with {{1}} nodes",
    ),
    *(
        rule
        for samples in ("square.latin_hypercube_samples", "expansion.samples")
        for rule in (
            Rule(
                (samples, "square.modes"),
                lambda samples, modes: samples * modes <= MOST_NUMBERS,
                f"samples times square.modes = {{1}} at most {MEMORY}",
            ),
            Rule(
                (samples, "expansion.degree"),
                lambda samples, degree: samples > terms(degree),
                f"more than the terms of the expansion, C({FUNCTIONALS} + {{1}}, {{1}})",
            ),
            Rule(
                (samples, "expansion.degree"),
                lambda samples, degree: samples * terms(degree) <= MOST_NUMBERS or samples <= terms(degree),
                f"samples times terms, C({FUNCTIONALS} + {{1}}, {{1}}), at most {MEMORY}",
            ),
        )
    ),
    *(
        Rule((f"strip.{length}", CELL), _is_multiple, f"a whole multiple of {CELL} = {{1}} [m]")
        for length in ("width_m", "window_m", "window_spacing_m", "expansion_spacing_m")
    ),
    Rule((WINDOW, "strip.window_spacing_m"), _is_multiple, "a whole multiple of strip.window_spacing_m = {1} [m]"),
    *(
        Rule(
            (f"strip.{length}", "strip.expansion_spacing_m"),
            _is_multiple,
            "a whole multiple of strip.expansion_spacing_m = {1} [m]",
        )
        for length in ("window_m", "window_spacing_m")
    ),
    Rule(
        (WINDOW, CELL),
        lambda window, cell: not _is_multiple(window, cell) or _is_multiple(MARGIN * window, cell),
        f"an even number of cells, {CELL} = {{1}} [m]: half a window is the margin of a strip",
    ),
    Rule(
        ("strip.window_spacing_m", WINDOW),
        lambda spacing, window: 2 * spacing <= window * (1 + 1e-9),
        f"at most half of {WINDOW} = {{1}} [m], for lags within the window",
    ),
    Rule(
        ("strip.width_m", CELL),
        lambda width, cell: not _is_multiple(width, cell) or round(width / cell) >= ROWS,
        f"at least {ROWS} times {CELL} = {{1}} [m], for slope and curvature across the strip",
    ),
    Rule(
        (CELL, WINDOW, "strip.width_m"),
        lambda cell, window, width: cells_of_strip(window, width, cell) < CELLS + 0.5,
        f"at most {CELLS} cells on the strip of {WINDOWS + 2 * MARGIN:g} x {{1}} by {{2}} m",
    ),
    increasing(LEVELS),
    Rule(
        (LEVELS, "friction.mean"),
        lambda percentiles, _: 50 in percentiles,
        "50 among them: friction.mean sets the shear strength there",
    ),
    *(
        Rule(
            (strips, LEVELS, WINDOW, "strip.window_spacing_m"),
            lambda strips, levels, window, spacing: (
                strips * len(levels) * ((WINDOWS - 1) * window / spacing + 1) <= MOST_WINDOWS
            ),
            f"strips times {LEVELS} times windows of a strip at most {MOST_WINDOWS} (2.5 GB of memory)",
        )
        for strips in ("strip.samples", "strip.expansion_samples")
    ),
    Rule(
        ("strip.training_samples", LEVELS, CELL, WINDOW, "strip.width_m"),
        _training_fits,
        f"strips times {LEVELS} times cells of a strip at most {MOST_TRAINING} (3.2 GB of memory)",
    ),
    Rule(
        ("strip.training_samples", WINDOW, CELL, "expansion.degree"),
        lambda strips, window, cell, degree: (
            strips > 1 and strips * training_columns(WINDOWS * window / cell) > terms(degree)
        ),
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
