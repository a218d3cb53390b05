"""Cells of strips and tolerance of their solves, where a scene leaves them to the accuracy asked of friction.

What extrapolation over two meshes leaves of the error of the cells, at x = cell / correlation length, is a x^p of the
number: measured on heights with a Gaussian covariance at percentiles 20 to 95, docs/decisions.md. The pilot strips
then show what these cells leave on the scene's own surface; where that is too much, it is refused with their advice.
"""

from __future__ import annotations

from fractions import Fraction
from math import ceil, gcd, lcm

from roughslip.scene.expansion import AUTO
from roughslip.scene.mistakes import Mistake, Values, given, refused

CELL, TOLERANCE, SCAN = "strip.cell_m", "numerics.contact_tolerance", "roughness.scan"
SHARE = 0.7  # of what is asked, for the cells; the rest is for few strips
ERRORS = {"friction_mean": 0.175, "friction_std": 1.23}  # a
ORDER = 1.75  # p
COARSEST = 1 / 4  # x at most, so that cells of twice the edge still follow the heights
LENGTHS = tuple(f"strip.{name}_m" for name in ("length", "margin", "width", "window", "window_spacing"))
SPACING = "strip.expansion_spacing_m"
# Relative error of the scatter of friction, below which the solver's part of it stays at a residual, with the residual
RESIDUALS = ((2e-2, 1e-4), (5e-3, 1e-5), (0.0, 1e-6))


def discretised(scene: Values) -> tuple[Values, list[Mistake]]:
    """The scene with numbers where it says auto, and a mistake where what they follow from is not given."""
    asked, mistakes = _asked(scene), []
    if given(scene, CELL) == AUTO:
        length = _positive(scene, "roughness.correlation_length_m")
        across = _positive(scene, "roughness.correlation_length_across_m") or length
        sizes = [_positive(scene, key) for key in LENGTHS if given(scene, key) != 0]
        sizes += [2 * _positive(scene, SPACING)] if given(scene, SPACING) else []
        if asked and length and all(sizes):
            scene = scene | {"strip": scene["strip"] | {"cell_m": cell_m(asked, min(length, across), sizes)}}
        else:
            needed = "a number > 0 [m], or auto with accuracy of friction (mean and std) and a correlation length"
            if given(scene, SCAN):
                needed = f"with {SCAN} a number > 0 [m], at most a quarter of its shortest correlation length"
            mistakes.append(refused(AUTO, needed, CELL, SCAN, "accuracy.friction_std"))
    if given(scene, TOLERANCE) == AUTO:
        if asked:
            scene = scene | {"numerics": scene["numerics"] | {"contact_tolerance": tolerance(asked)}}
        else:
            needed = "a number from 1e-14 to 0.001, or auto with accuracy of friction (mean and std)"
            mistakes.append(refused(AUTO, needed, TOLERANCE, "accuracy.friction_std"))
    return scene, mistakes


def cell_m(asked: dict[str, float], length_m: float, sizes_m: list[float]) -> float:
    """The coarsest cell of which all sizes are even multiples, and which leaves SHARE of what is asked.

    asked : half width by name of ERRORS; length_m : correlation length; sizes_m : lengths on the strip
    """
    most = min([COARSEST, *((SHARE * asked[name] / a) ** (1 / ORDER) for name, a in ERRORS.items())]) * length_m
    common = _common_measure(sizes_m) / 2
    return float(common / ceil(float(common) / most * (1 - 1e-9)))


def tolerance(asked: dict[str, float]) -> float:
    """The largest residual of RESIDUALS whose error is a tenth of what is asked of the scatter, or less."""
    return next(residual for least, residual in RESIDUALS if asked["friction_std"] >= least)


def _common_measure(sizes_m: list[float]) -> Fraction:
    """The largest length that all sizes are whole multiples of, read as decimal numbers."""
    sizes = [Fraction(repr(size)) for size in sizes_m]
    parts = lcm(*(size.denominator for size in sizes))
    return Fraction(gcd(*(int(size * parts) for size in sizes)), parts)


def _asked(scene: Values) -> dict[str, float] | None:
    """Accuracies of friction; None where not all are given."""
    values = {name: _positive(scene, f"accuracy.{name}") for name in ERRORS}
    return values if all(values.values()) else None


def _positive(scene: Values, key: str) -> float:
    """A number of a scene that is above zero, else 0."""
    value = given(scene, key)
    return float(value) if isinstance(value, (int, float)) and value > 0 else 0.0
