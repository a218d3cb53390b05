"""Section `roughness` of a scene: a random field, a fractal or a measured surface."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

from roughslip.scene.mistakes import Mistake, Rule, Values, given, missing, not_together, refused
from roughslip.scene.section import Line, Section, key, many, word

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
Shape = Annotated[float, key(ge=0.02, le=10000)]
Wavelength = Annotated[float, key("m", gt=0, le=1)]
Distance = Annotated[float, key("m", ge=1e-11, le=0.01)]


class Scan(Section):
    """A measured surface; models are fitted to it, and surfaces are sampled from these."""

    file: Line = key(max_length=500)
    """File of the scan; its path starts at the folder of the scene file or of the project. Allowed: a format of an
    instrument that SurfaceTopography reads, a .nc map, or a .txt matrix with a row for each y."""
    spacing_m: tuple[Distance, Distance] | None = many(default=None)
    """Distance of neighbouring points along x and along y, where the file does not give it."""
    height_unit: Literal["m", "mm", "um", "nm", "pm"] | None = key(default=None)
    """Unit of the heights, where the file does not give it."""
    form: Literal["mean", "plane", "quadratic"] = key()
    """Form that is removed from the scan first, by a least squares fit."""
    cutoff_m: float | None = key("m", ge=1e-10, le=0.1, default=None)
    """Cutoff of a high-pass after removal of the form, the areal Gaussian filter of ISO 16610-61: waves longer than it
    are no part of the surface."""
    endless_lay: Literal["x", "y"] | None = key(default=None)
    """Axis along which the lay is taken as infinitely long, where grooves are longer than half the scan: the model is
    that across the lay, and sampled surfaces are equal along it."""
    covariance: str = word(("best", "measured", *COVARIANCES))
    """Model of the autocorrelation, fitted; best is the one of the smallest Bayesian criterion, measured the estimate
    itself."""
    marginal: Literal["gaussian", "empirical"] = key()
    """Distribution of the heights; empirical is the measured one."""
    outliers: Literal["keep", "missing"] | None = key(default=None)
    """What is done with points far from the bulk of the heights and from their neighbours; keep where not given."""


class Roughness(Section):
    """Random heights, stationary: a field, a fractal or a measured surface.

    A field has covariance, rms_height_m and correlation_length_m, a fractal has wavelengths_m, hurst and rms_height_m.
    """

    covariance: str = word(tuple(COVARIANCES), default=None, or_file=True)
    """Covariance at distance r over the correlation length: gaussian is exp(-r^2), exponential is exp(-r), matern has a
    smoothness, self_affine a Hurst exponent and bandwidth; or a model of your own."""
    rms_height_m: float = key("m", uncertain="surface", gt=0, le=0.01, default=None)
    """Root mean square of the heights, Sq."""
    correlation_length_m: float = key("m", uncertain="surface", gt=0, le=1, default=None)
    """Distance at which the covariance has fallen to 1/e; below the cell the heights are independent."""
    correlation_length_across_m: float | None = key("m", gt=0, le=1, default=None)
    """Correlation length across the lay of an anisotropic surface; correlation_length_m is then that along the lay."""
    lay_rad: float | None = key("rad", ge=-3.1416, le=3.1416, default=None)
    """Angle from the sliding direction x to the lay; 0 where not given."""
    smoothness: float | None = key(ge=0.05, le=20, default=None)
    """Smoothness nu of a matern covariance; 0.5 is exponential, large ones come close to gaussian."""
    hurst: float | None = key(ge=0.01, le=1, default=None)
    """Hurst exponent of a self_affine covariance or a fractal; the fractal dimension of the surface is 3 minus it."""
    bandwidth: float | None = key(ge=1.01, le=1e6, default=None)
    """Longest over shortest wavelength of the power law of a self_affine covariance."""
    beta_shapes: tuple[Shape, Shape] | None = many(default=None)
    """Shapes a and b of a Beta distribution of the heights, where they are not Gaussian; with a above b valleys hang
    below a plateau."""
    correct_correlation: bool = key(default=False)
    """Whether the covariance is that of the heights. Otherwise it is that of the underlying Gaussian field, and the
    transformation to the marginal changes it a little."""
    wavelengths_m: tuple[Wavelength, Wavelength] | None = many(default=None)
    """Shortest and longest wave of a fractal: Weierstrass-Mandelbrot waves with random phases, eq. (1) and its form in
    two dimensions."""
    scan: Scan = key(default=None)


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
KEYS = tuple(dict.fromkeys(key for keys in FORMS.values() for key in keys))


def _replaced(key: str) -> tuple[str, ...]:
    """The keys that no form has together with this one, and those that belong to one covariance or one scan alone."""
    allowed = {other for keys in FORMS.values() if key in keys for other in keys}
    more = {"covariance": SHAPES, "scan": (CORRECT,)}.get(key, ())
    return tuple(f"roughness.{other}" for other in KEYS if other in more or other not in allowed)


_LENGTH, _WAVES, _CELL = "roughness.correlation_length_m", "roughness.wavelengths_m", "strip.cell_m"
REPLACES = {f"roughness.{key}": _replaced(key) for key in KEYS} | {"roughness.scan.marginal": (f"roughness.{CORRECT}",)}
RULES = (
    Rule(
        ("strip.window_m", _LENGTH),
        lambda window, correlation: window >= 2 * correlation,
        f"at least twice {_LENGTH} = {{1}} [m]",
    ),
    Rule(
        (_WAVES, "strip.window_m", _CELL),
        lambda waves, window, cell: 2 * cell < waves[0] <= waves[1] <= 4 * window,
        "the shortest first, of more than two cells, strip.cell_m = {2} [m]; the longest at most four times "
        "strip.window_m = {1} [m]",
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
    """Roughness has exactly one of its forms, the keys of that form alone, and the shapes of its covariance."""
    roughness = scene.get("roughness")
    if not isinstance(roughness, dict):
        return
    form = next((name for name in ("scan", WAVES) if name in roughness), "covariance")
    for name in roughness.keys() & {*KEYS} - {*FORMS[form]}:
        yield not_together(scene, f"roughness.{name}", f"roughness.{form}")
    for name in {"covariance": FIELD, WAVES: FORMS[WAVES], "scan": ()}[form]:
        if name not in roughness:
            forms = f"give {', '.join(FIELD)}, or {WAVES} with hurst and rms_height_m, or scan"
            yield missing(forms, f"roughness.{name}")
    if form == "covariance":
        yield from _shape_mistakes(roughness)
    goes_with = {CORRECT: BETA, "lay_rad": "correlation_length_across_m"} if form == "covariance" else {}
    for name, other in goes_with.items():
        if name in roughness and other not in roughness:
            yield missing(f"goes with roughness.{name}", f"roughness.{other}", f"roughness.{name}")
    if CORRECT in roughness and given(scene, "roughness.scan.marginal") == "gaussian":
        allowed = "a gaussian marginal changes no correlation"
        yield refused(roughness[CORRECT], allowed, f"roughness.{CORRECT}", "roughness.scan.marginal")


def _shape_mistakes(field: Values) -> Iterator[Mistake]:
    kind = str(field.get("covariance"))
    for shape in SHAPES if kind in COVARIANCES else ():
        keys = f"roughness.{shape}", "roughness.covariance"
        if shape in field and shape not in COVARIANCES[kind]:
            yield refused(field[shape], f"roughness.covariance = {kind} has none", *keys)
        elif shape not in field and shape in COVARIANCES[kind]:
            yield missing(f"roughness.covariance = {kind} needs it", *keys)
