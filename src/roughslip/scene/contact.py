"""Sections `material`, `square`, `expansion`, `strip` and `numerics` of a scene: what is pressed on a rigid plane."""

import math
import operator
from typing import Annotated, Literal

from roughslip.limits import FUNCTIONALS, MARGIN, MOST_WINDOWS, TRAINING_SPACING, WINDOWS
from roughslip.scene.mistakes import Rule, fits, is_increasing
from roughslip.scene.section import Section, key, many


class Material(Section):
    """Half-space, elastic, or elastic and plastic where a hardness is given."""

    young_modulus_pa: float = key("Pa", ge=1000, le=1e13)
    """Young's modulus, from soft gels to diamond."""
    poisson_ratio: float = key(gt=-1, le=0.5)
    """Poisson's ratio."""
    hardness_pa: float | None = key("Pa", gt=0, le=1e13, default=None)
    """Highest contact pressure, at which the surface yields; without it the contact is elastic."""


class Square(Section):
    """Square surface of figure 2, a truncated Karhunen-Loeve expansion in contact with a rigid plane."""

    edge_m: float = key("m", gt=0, le=1)
    """Edge of the square."""
    nodes: int = key(ge=2, le=1024)
    """Nodes along an edge, and cells."""
    modes: int = key(ge=FUNCTIONALS, le=262144)
    """Random modes of the Karhunen-Loeve expansion, the mean not counted: at least one for each variable of our
    expansion, at most nodes^2."""
    monte_carlo_samples: int = key(ge=100, le=5_000_000)
    """Surfaces of the Monte Carlo reference."""
    latin_hypercube_samples: int = key(ge=8000, le=1_000_000)
    """Surfaces of the Latin hypercube designs. Each full 4000 are a design of their own, to which eqs. (8) and (9) of
    the paper are fitted, on the samples in contact alone; with fewer it breaks down at median penetration. Two
    designs or more give an interval."""


class Expansion(Section):
    """Polynomial chaos expansion of the pressure, fitted to all samples."""

    degree: int = key(ge=1, le=10)
    """Total degree of the Hermite polynomials of the eight local functionals of the heights; there are C(8 + degree,
    8)."""
    target: Literal["trial_pressure", "squared_pressure"] = key()
    """Expanded quantity. The trial_pressure is p - gap/B_ii, for meshes as coarse as the correlation length. The
    squared_pressure is p^2 continued outside contact, for meshes that resolve it; on coarse ones they agree."""
    samples: int = key(ge=10, le=1_000_000)
    """Surfaces that the expansion of the square is fitted to, more than it has terms."""


Percentile = Annotated[float, key("%", gt=0, lt=100)]


class Strip(Section):
    """Long strip on whose sliding windows the friction coefficient is evaluated, which takes all keys but
    expansion_spacing_m."""

    width_m: float = key("m", gt=0, le=1, default=None)
    """Width of strip and windows across the belt."""
    cell_m: float = key("m", gt=0, default=None)
    """Edge of the square cells; width, window and spacing are whole multiples of it, and so is half a window."""
    window_m: float = key("m", gt=0, le=1, default=None)
    """Length of a window along the belt. Windows lie on four times this length; half of it is solved beyond either end
    and not used, because the ends of a contact carry more pressure."""
    window_spacing_m: float = key("m", gt=0, default=None)
    """Distance between the starts of neighbouring windows, the step of the lags of the autocorrelation."""
    penetration_percentiles: tuple[Percentile, ...] = many(min_length=1, max_length=99, default=None)
    """Penetrations of figure 3, strictly increasing, each as the percentage of the heights above the plane; 50 sets the
    shear strength."""
    samples: int = key(ge=8, le=100_000, default=None)
    """Strips that are solved; a bootstrap over strips needs at least 8. With load, periodic cells of 8 windows, or
    fewer of as many in all, at least 16."""
    training_samples: int = key(ge=1, le=100_000, default=None)
    """Number of the first solved strips that also train the expansion."""
    expansion_spacing_m: float | None = key("m", gt=0, le=1, default=None)
    """Distance of the columns at which the expansion is evaluated, for smooth heights a third of the correlation
    length; strip.cell_m where not given."""
    expansion_samples: int = key(ge=8, le=1_000_000, default=None)
    """Strips that the expansion is evaluated on, the solved ones among them."""


class Numerics(Section):
    """Tolerance of the solves, and what counts as contact."""

    contact_tolerance: float = key(ge=1e-14, le=0.001, default=1e-4)
    """Relative residual to which a contact is solved; with 1e-4 the mean of A / N is known to 3e-4, its scatter to
    2e-3."""
    contact_area: Literal["corrected", "nodes"] = key(default="corrected")
    """corrected: a cell at the edge of a contact counts by its covered share, and the pressure at the centre of the
    square by its distance from the edge. With nodes, each node in contact counts as a whole cell, too much by a share
    of the perimeter."""


def terms(degree: int) -> int:
    """Terms of an expansion."""
    return math.comb(FUNCTIONALS + degree, degree)


CELLS, ROWS = 4_000_000, 3  # of a strip at most, and across it at least
MOST_TRAINING = 400_000_000  # pressures in all cells of the training strips at most: 3.2 GB
LEVELS = "strip.penetration_percentiles"
WINDOW, WIDTH, CELL, SPACING = "strip.window_m", "strip.width_m", "strip.cell_m", "strip.window_spacing_m"
EXPANSION_SPACING = "strip.expansion_spacing_m"
_TERMS = f"the terms of the expansion, C({FUNCTIONALS} + {{1}}, {{1}})"
_SAMPLES = ("square.latin_hypercube_samples", "expansion.samples")


def training_columns(columns: float) -> int:
    """Columns of a strip that train the expansion, as from_scene.geometry counts them."""
    return math.ceil((columns - TRAINING_SPACING // 2) / TRAINING_SPACING) if columns < CELLS else CELLS


def cells_of_strip(window: float, width: float, cell: float) -> float:
    """Cells of a strip with its margins."""
    return (WINDOWS + 2 * MARGIN) * window / cell * (width / cell)


def _is_multiple(length: float, cell: float) -> bool:
    cells = length / cell
    return math.isfinite(cells) and abs(cells - round(cells)) <= 1e-9 * cells


RULES = (
    Rule(("square.modes", "square.nodes"), lambda modes, nodes: modes <= nodes**2, "at most square.nodes^2 = {1}^2"),
    fits(("square.modes", "square.nodes"), lambda modes, nodes: modes * nodes**2, "modes times nodes^2"),
    *(fits((samples, "square.modes"), operator.mul, "samples times square.modes = {1}") for samples in _SAMPLES),
    *(
        Rule((samples, "expansion.degree"), lambda n, degree: n > terms(degree), f"more than {_TERMS}")
        for samples in _SAMPLES
    ),
    *(
        fits((samples, "expansion.degree"), lambda n, degree: n * terms(degree), f"samples times {_TERMS},")
        for samples in _SAMPLES
    ),
    *(
        Rule((length, of), _is_multiple, f"a whole multiple of {of} = {{1}} [m]")
        for of, lengths in {
            CELL: (WIDTH, WINDOW, SPACING, EXPANSION_SPACING),
            SPACING: (WINDOW,),
            EXPANSION_SPACING: (WINDOW, SPACING),
        }.items()
        for length in lengths
    ),
    Rule(
        (WINDOW, CELL),
        lambda window, cell: not _is_multiple(window, cell) or _is_multiple(MARGIN * window, cell),
        f"an even number of cells, {CELL} = {{1}} [m]: half a window is the margin of a strip",
    ),
    Rule(
        (SPACING, WINDOW),
        lambda spacing, window: 2 * spacing <= window * (1 + 1e-9),
        f"at most half of {WINDOW} = {{1}} [m], for lags within the window",
    ),
    Rule(
        (WIDTH, CELL),
        lambda width, cell: width / cell >= ROWS - 0.5,
        f"at least {ROWS} times {CELL} = {{1}} [m], for slope and curvature across the strip",
    ),
    Rule(
        (CELL, WINDOW, WIDTH),
        lambda cell, window, width: cells_of_strip(window, width, cell) < CELLS + 0.5,
        f"at most {CELLS} cells on the strip of {WINDOWS + 2 * MARGIN:g} x {{1}} by {{2}} m",
    ),
    Rule((LEVELS,), is_increasing, "strictly increasing"),
    Rule(
        (LEVELS, "friction.mean"),
        lambda percentiles, _: 50 in percentiles,
        "50 among them: friction.mean sets the shear strength there",
    ),
    *(
        fits(
            (strips, LEVELS, WINDOW, SPACING),
            lambda n, levels, window, spacing: n * len(levels) * ((WINDOWS - 1) * window / spacing + 1),
            f"strips times {LEVELS} times windows of a strip",
            MOST_WINDOWS,
        )
        for strips in ("strip.samples", "strip.expansion_samples")
    ),
    fits(
        ("strip.training_samples", LEVELS, WINDOW, WIDTH, CELL),
        lambda n, levels, *strip: n * len(levels) * min(cells_of_strip(*strip), CELLS),
        f"strips times {LEVELS} times cells of a strip",
        MOST_TRAINING,
    ),
    Rule(
        ("strip.training_samples", "expansion.degree", WINDOW, CELL),
        lambda n, degree, window, cell: n > 1 and n * training_columns(WINDOWS * window / cell) > terms(degree),
        f"at least 2, and with every {TRAINING_SPACING}th column of each more than {_TERMS}",
    ),
    Rule(("strip.training_samples", "strip.samples"), operator.le, "at most strip.samples = {1}"),
    Rule(
        ("strip.expansion_samples", "strip.samples"),
        lambda expanded, solved: expanded >= 2 * solved,
        "at least twice strip.samples = {1}",
    ),
)
