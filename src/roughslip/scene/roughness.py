"""Section `roughness` of a scene: a random field, a fractal or a measured surface."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from roughslip.scene.mistakes import Mistake, Rule, Values, given, missing, not_together, refused
from roughslip.scene.section import Line, Section, choice, many, number, part, text, word

MODELS = Path(__file__).resolve().parents[1] / "surface" / "models.py"


@cache
def covariance_shapes() -> dict[str, dict[str, tuple[float, float]]]:
    """By the name of each model, its literal `kind`, the ranges of its shape parameters: its literal `shapes`.

    They are read from the source of `surface/models.py`: numpy is not imported.
    """
    classes = [node for node in ast.parse(MODELS.read_text(encoding="utf-8")).body if isinstance(node, ast.ClassDef)]
    shapes = {str(own["kind"]): own.get("shapes", {}) for own in map(_literals, classes) if "kind" in own}
    return dict(sorted(shapes.items()))


def _literals(model: ast.ClassDef) -> dict[str, Any]:
    """The attributes `kind` and `shapes` of a class, where it has them."""
    named = [(node.targets[0], node.value) for node in model.body if isinstance(node, ast.Assign)]
    named += [(node.target, node.value) for node in model.body if isinstance(node, ast.AnnAssign) and node.value]
    values = {ast.unparse(name): value for name, value in named}
    return {name: ast.literal_eval(values[name]) for name in ("kind", "shapes") if name in values}


COVARIANCES = covariance_shapes()
Shape = Annotated[float, Field(ge=0.02, le=10000, description="A shape [-]")]
Wavelength = Annotated[float, Field(gt=0, le=1, description="A wavelength [m]")]
Distance = Annotated[float, Field(ge=1e-11, le=0.01, description="A distance [m]")]


class Scan(Section):
    """A measured surface; models are fitted to it, and surfaces are sampled from these."""

    file: Line = text(
        "File of the scan; its path starts at the folder of the scene file or of the project. Allowed: a format of an "
        "instrument that SurfaceTopography reads, a .nc map, or a .txt matrix with a row for each y",
        longest=500,
    )
    spacing_m: tuple[Distance, Distance] | None = many(
        "Distance of neighbouring points along x and along y, where the file does not give it", default=None
    )
    height_unit: Literal["m", "mm", "um", "nm", "pm"] | None = choice(
        "Unit of the heights, where the file does not give it", default=None
    )
    form: Literal["mean", "plane", "quadratic"] = choice(
        "Form that is removed from the scan first, by a least squares fit"
    )
    cutoff_m: float | None = number(
        "Cutoff of a high-pass after removal of the form, the areal Gaussian filter of ISO 16610-61: waves longer than "
        "it are no part of the surface",
        "m",
        ge=1e-10,
        le=0.1,
        default=None,
    )
    endless_lay: Literal["x", "y"] | None = choice(
        "Axis along which the lay is taken as infinitely long, where grooves are longer than half the scan: the "
        "model is that across the lay, and sampled surfaces are equal along it",
        default=None,
    )
    covariance: str = word(
        "Model of the autocorrelation, fitted; best is the one of the smallest Bayesian criterion, "
        "measured the estimate itself",
        ("best", "measured", *COVARIANCES),
    )
    marginal: Literal["gaussian", "empirical"] = choice("Distribution of the heights; empirical is the measured one")
    outliers: Literal["keep", "missing"] | None = choice(
        "What is done with points far from the bulk of the heights and from their neighbours; keep where not given",
        default=None,
    )


class Roughness(Section):
    """Random heights, stationary: a field, a fractal or a measured surface.

    A field has covariance, rms_height_m and correlation_length_m, a fractal has wavelengths_m, hurst and rms_height_m.
    """

    covariance: str = word(
        "Covariance at distance r over the correlation length: gaussian is exp(-r^2), exponential is exp(-r), "
        "matern has a smoothness, self_affine a Hurst exponent and bandwidth; or a model of your own",
        tuple(COVARIANCES),
        default=None,
        or_file=True,
    )
    rms_height_m: float = number(
        "Root mean square of the heights, Sq", "m", uncertain="surface", gt=0, le=0.01, default=None
    )
    correlation_length_m: float = number(
        "Distance at which the covariance has fallen to 1/e; below the cell the heights are independent",
        "m",
        uncertain="surface",
        gt=0,
        le=1,
        default=None,
    )
    correlation_length_across_m: float | None = number(
        "Correlation length across the lay of an anisotropic surface; correlation_length_m is then that along the lay",
        "m",
        gt=0,
        le=1,
        default=None,
    )
    lay_rad: float | None = number(
        "Angle from the sliding direction x to the lay; 0 where not given", "rad", ge=-3.1416, le=3.1416, default=None
    )
    smoothness: float | None = number(
        "Smoothness nu of a matern covariance; 0.5 is exponential, large ones come close to gaussian",
        ge=0.05,
        le=20,
        default=None,
    )
    hurst: float | None = number(
        "Hurst exponent of a self_affine covariance or a fractal; the fractal dimension of the surface is 3 minus it",
        ge=0.01,
        le=1,
        default=None,
    )
    bandwidth: float | None = number(
        "Longest over shortest wavelength of the power law of a self_affine covariance", ge=1.01, le=1e6, default=None
    )
    beta_shapes: tuple[Shape, Shape] | None = many(
        "Shapes a and b of a Beta distribution of the heights, where they are not Gaussian; with a above b valleys "
        "hang below a plateau",
        default=None,
    )
    correct_correlation: bool = choice(
        "Whether the covariance is that of the heights. Otherwise it is that of the underlying Gaussian field, "
        "and the transformation to the marginal changes it a little",
        default=False,
    )
    wavelengths_m: tuple[Wavelength, Wavelength] | None = many(
        "Shortest and longest wave of a fractal: Weierstrass-Mandelbrot waves with random phases, eq. (1) and its form "
        "in two dimensions",
        default=None,
    )
    scan: Scan = part()


FIELD = ("covariance", "rms_height_m", "correlation_length_m")
SHAPES = tuple(dict.fromkeys(name for shapes in COVARIANCES.values() for name in shapes))
CORRECT, BETA, WAVES = "correct_correlation", "beta_shapes", "wavelengths_m"
FIELD_OPTIONS = ("correlation_length_across_m", "lay_rad", *SHAPES, BETA)
# The keys that each form may have.
FORMS = {
    "covariance": (*FIELD, *FIELD_OPTIONS, CORRECT),
    WAVES: (WAVES, "hurst", "rms_height_m"),
    "scan": ("scan", CORRECT),
}
STATED = ("spacing_m", "height_unit")  # for a file that does not give them

_REPLACES = {
    **dict.fromkeys((*FIELD, *FIELD_OPTIONS), (WAVES, "scan")),
    **dict.fromkeys(("rms_height_m", "hurst"), ("scan",)),
    "covariance": (WAVES, "scan", *SHAPES),
    WAVES: (*(key for key in FORMS["covariance"] if key not in ("rms_height_m", "hurst")), "scan"),
    "scan": (*FORMS["covariance"], WAVES),
    "scan.marginal": (CORRECT,),
}
REPLACES = {f"roughness.{key}": tuple(f"roughness.{old}" for old in keys) for key, keys in _REPLACES.items()}

_LENGTH, _WAVES, _CELL = "roughness.correlation_length_m", "roughness.wavelengths_m", "strip.cell_m"
RULES = (
    Rule(
        ("strip.window_m", _LENGTH),
        lambda window, correlation: window >= 2 * correlation,
        f"at least twice {_LENGTH} = {{1}} [m]",
    ),
    Rule(
        (_WAVES, "strip.window_m"),
        lambda waves, window: waves[0] <= waves[1] <= 4 * window,
        "the shortest first, the longest at most four times strip.window_m = {1} [m]",
    ),
    Rule(
        (_WAVES, _CELL),
        lambda waves, cell: waves[0] > 2 * cell,
        "a shortest wave of more than two cells, strip.cell_m = {1} [m]",
    ),
    Rule(
        ("strip.expansion_spacing_m", _CELL, _WAVES),
        lambda spacing, cell, waves: spacing == cell or waves[0] > 2 * spacing,
        f"strip.cell_m = {{1}} [m], or less than half of the first of {_WAVES}",
    ),
    Rule(
        ("targets", _WAVES),
        lambda targets, _: "figure2" not in targets,
        "figure2 expands the pressure in Gaussian variables, and a fractal has a phase a wave",
    ),
)


def mistakes(scene: Values) -> Iterator[Mistake]:
    """Roughness has exactly one of its forms, and the keys of that form alone."""
    roughness = scene.get("roughness")
    if not isinstance(roughness, dict):
        return
    form = next((key for key in ("scan", WAVES) if key in roughness), "covariance")
    every = {key for keys in FORMS.values() for key in keys}
    for key, value in roughness.items():
        if key in every.difference(FORMS[form]):
            yield not_together(f"roughness.{key}", value, f"roughness.{form}")
    for key in {"covariance": FIELD, WAVES: FORMS[WAVES]}.get(form, ()):
        if key not in roughness:
            forms = f"give {', '.join(FIELD)}, or {WAVES} with hurst and rms_height_m, or scan"
            yield missing(forms, f"roughness.{key}")
    if form == "covariance":
        yield from _field_mistakes(roughness)
    if CORRECT in roughness and form == "covariance" and BETA not in roughness:
        yield missing(f"goes with roughness.{CORRECT}", f"roughness.{BETA}", f"roughness.{CORRECT}")
    if CORRECT in roughness and given(scene, "roughness.scan.marginal") == "gaussian":
        allowed = "a gaussian marginal changes no correlation"
        yield refused(roughness[CORRECT], allowed, f"roughness.{CORRECT}", "roughness.scan.marginal")


def _field_mistakes(field: Values) -> Iterator[Mistake]:
    kind = str(field.get("covariance"))
    for shape in SHAPES if kind in COVARIANCES else ():
        keys = f"roughness.{shape}", "roughness.covariance"
        if shape in field and shape not in COVARIANCES[kind]:
            yield refused(field[shape], f"roughness.covariance = {kind} has none", *keys)
        elif shape not in field and shape in COVARIANCES[kind]:
            yield missing(f"roughness.covariance = {kind} needs it", *keys)
    if "lay_rad" in field and "correlation_length_across_m" not in field:
        yield missing("goes with roughness.lay_rad", "roughness.correlation_length_across_m", "roughness.lay_rad")
