"""Meshes, share of modes and tolerance of solves, where a scene leaves them to the accuracy that it asks for.

Errors by cells are a x^p at x = cell / correlation length. Of strips it is the error of friction after extrapolation.
Of the square it is that of the distribution of the pressure, with and without the error at edges of contacts. Modes
that are left out leave it a share of their variance. Measured on smooth heights at percentiles 20 to 95, docs/notebook.
Pilots then show what remains on the scene's own surface. Where that is too much, they refuse it with advice.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import ceil, gcd, lcm

from roughslip.scene.auto import AUTO
from roughslip.scene.contact import MOST_NODES
from roughslip.scene.mistakes import Mistake, Values, given, refused

SCAN, NODES = "roughness.scan", "square.nodes"
SHARE = 0.7  # of what is asked of friction, for the cells; the rest is for few strips
ERRORS = {"friction_mean": 0.175, "friction_std": 1.23}  # a
ORDER = 1.75  # p
COARSEST = 1 / 4  # x at most: a quarter of the correlation length
LENGTHS = tuple(f"strip.{name}_m" for name in ("length", "margin", "width", "window", "window_spacing"))
SPACING = "strip.expansion_spacing_m"
# Relative error of the scatter of friction, below which the solver's part of it stays at a residual, with the residual
RESIDUALS = ((2e-2, 1e-4), (5e-3, 1e-5), (0.0, 1e-6))
SQUARE_CELLS = {"corrected": (0.1, 2), "nodes": (0.06, 1)}  # a, p by numerics.contact_area
SQUARE_MODES = 0.4  # error of the distribution over the variance that is left out
SQUARE_SHARES = 0.1, 0.2  # of accuracy.pressure for cells and for modes
FEWEST_MODES = 0.8  # share of the variance at least


def discretised(scene: Values) -> tuple[Values, list[Mistake]]:
    """The scene with numbers where it says auto, and a mistake where what they follow from is not given."""
    mistakes = []
    for key, (number_of, needed, others) in AUTO_KEYS.items():
        if given(scene, key) != AUTO:
            continue
        number, (section, _, name) = number_of(scene), key.partition(".")
        if number is None:
            by_hand = needed.partition(",")[0]
            with_scan = f"with {SCAN} {by_hand}, for cells of at most a quarter of its shortest correlation length"
            mistakes.append(refused(AUTO, with_scan if given(scene, SCAN) and SCAN in others else needed, key, *others))
        elif key == NODES and number > MOST_NODES:
            allowed = f"at most {MOST_NODES}; auto takes so many for accuracy.pressure"
            mistakes.append(refused(number, allowed, key, *others))
        else:
            scene = scene | {section: scene[section] | {name: number}}
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


def _strip_cell(scene: Values) -> float | None:
    """Of the strip. None where accuracies of friction, a correlation length or a size are missing."""
    asked, length = _asked(scene), _shortest_length(scene)
    sizes = [_positive(scene, key) for key in LENGTHS if given(scene, key) != 0]
    sizes += [2 * _positive(scene, SPACING)] if given(scene, SPACING) else []
    return cell_m(asked, length, sizes) if asked and length and all(sizes) else None


def _tolerance(scene: Values) -> float | None:
    """Of contact solves. None where accuracies of friction are missing."""
    asked = _asked(scene)
    return tolerance(asked) if asked else None


def square_nodes(scene: Values) -> int | None:
    """Nodes along an edge of the square. None where accuracy.pressure, the edge or a correlation length is missing."""
    asked, edge, length = (
        _positive(scene, "accuracy.pressure"),
        _positive(scene, "square.edge_m"),
        _shortest_length(scene),
    )
    law = SQUARE_CELLS.get(given(scene, "numerics.contact_area"))
    if not (asked and edge and length and law):
        return None
    most = min(COARSEST, (SQUARE_SHARES[0] * asked / law[0]) ** (1 / law[1]))
    return ceil(edge / (most * length))


def square_share(scene: Values) -> float | None:
    """Of the variance, for the modes of the square. None where accuracy.pressure is missing."""
    asked = _positive(scene, "accuracy.pressure")
    return max(FEWEST_MODES, round(1 - SQUARE_SHARES[1] * asked / SQUARE_MODES, 4)) if asked else None


def _shortest_length(scene: Values) -> float:
    """Correlation length [m] of the heights, across the belt where it is shorter there; 0 where it is missing."""
    length = _positive(scene, "roughness.correlation_length_m")
    return min(length, _positive(scene, "roughness.correlation_length_across_m") or length)


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


# By key: the number, what is needed, and the other keys of the message
AUTO_KEYS: dict[str, tuple[Callable[[Values], float | None], str, tuple[str, ...]]] = {
    "strip.cell_m": (
        _strip_cell,
        "a number > 0 [m], or auto with accuracy of friction (mean and std) and a correlation length",
        (SCAN, "accuracy.friction_std"),
    ),
    "numerics.contact_tolerance": (
        _tolerance,
        "a number from 1e-14 to 0.001, or auto with accuracy of friction (mean and std)",
        ("accuracy.friction_std",),
    ),
    NODES: (
        square_nodes,
        "a whole number from 2 to 1024, or auto with accuracy.pressure and a correlation length",
        (SCAN, "accuracy.pressure"),
    ),
    "square.variance_share": (
        square_share,
        "a number > 0 and <= 1, or auto with accuracy.pressure",
        ("accuracy.pressure",),
    ),
}
