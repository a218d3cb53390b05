"""The forms of `roughness` in a scene, a field, a fractal or a scan, and what ties the keys of each together."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from roughslip.scene.strict_yaml import shown

FIELD = ("covariance", "rms_height_m", "correlation_length_m")
SHAPES = {"smoothness": "matern", "hurst": "self_affine", "bandwidth": "self_affine"}
FIELD_OPTIONS = ("correlation_length_across_m", "lay_rad", *SHAPES, "marginal")
FRACTAL, SCAN = "fractal", "scan"
KEYS = (*FIELD, *FIELD_OPTIONS, FRACTAL, SCAN)

# By the key that tells a form: the keys that it needs, and those that it may have.
FORMS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "covariance": (FIELD, FIELD_OPTIONS),
    FRACTAL: ((FRACTAL, "rms_height_m"), ()),
    SCAN: ((SCAN,), ()),
}

# Of each family of laws: the names of its shapes, and their limits.
FAMILIES = {"beta": ("a, b", 0.02, 1e4), "weibull": ("k", 0.2, 50.0), "lognormal": ("s", 0.02, 1.5)}

STATED = ("spacing_x_m", "spacing_y_m", "height_unit")  # of a file that does not say

# In an overlay: by section, what a key takes the place of, where the overlay does not give that too.
REPLACES: dict[str, dict[str, tuple[str, ...]]] = {
    "roughness": {
        SCAN: (*FIELD, *FIELD_OPTIONS, FRACTAL),
        FRACTAL: (*(key for key in (*FIELD, *FIELD_OPTIONS) if key != "rms_height_m"), SCAN),
        **dict.fromkeys((*FIELD, *FIELD_OPTIONS), (FRACTAL, SCAN)),
        "rms_height_m": (SCAN,),
        "covariance": (FRACTAL, SCAN, *SHAPES),
    },
    "roughness.marginal": {"family": ("shapes", "mirrored")},
    "roughness.scan": {"file": ("grinding",), "grinding": ("file", *STATED), "marginal": ("correct_correlation",)},
}


class Mistake(NamedTuple):
    """keys : the dotted keys involved, the one to name first; text : what is wrong with it and what is allowed"""

    keys: tuple[str, ...]
    text: str


def mistakes(roughness: dict[str, Any]) -> Iterator[Mistake]:
    """What is wrong with the forms of roughness, and within each; what the schema refuses is left to it."""
    form = next((key for key in (SCAN, FRACTAL) if key in roughness), "covariance")
    needed, optional = FORMS[form]
    for key, value in roughness.items():
        if key in KEYS and key not in (*needed, *optional):
            text = f"{shown(value)} is not allowed beside roughness.{form}; give one"
            yield Mistake((f"roughness.{key}", f"roughness.{form}"), text)
    for key in needed:
        if key not in roughness:
            text = f"missing; give {', '.join(FIELD)}, or {FRACTAL} with rms_height_m, or {SCAN}"
            yield Mistake((f"roughness.{key}",), text)
    if form == "covariance":
        yield from _field_mistakes(roughness)
    if isinstance(scan := roughness.get(SCAN), dict):
        yield from _scan_mistakes(scan)


def _field_mistakes(field: dict[str, Any]) -> Iterator[Mistake]:
    kind = field.get("covariance")
    for shape, owner in SHAPES.items():
        keys = f"roughness.{shape}", "roughness.covariance"
        if shape in field and kind in (*SHAPES.values(), "gaussian", "exponential", "separable_exponential"):
            if kind != owner:
                yield Mistake(keys, f"{shown(field[shape])} is not allowed; roughness.covariance = {kind} has none")
        elif kind == owner:
            yield Mistake(keys, f"missing; roughness.covariance = {kind} needs it")
    if "lay_rad" in field and "correlation_length_across_m" not in field:
        keys = "roughness.correlation_length_across_m", "roughness.lay_rad"
        yield Mistake(keys, "missing; goes with roughness.lay_rad")
    marginal = field.get("marginal")
    if (
        isinstance(marginal, dict)
        and marginal.get("family") in tuple(FAMILIES)
        and isinstance(marginal.get("shapes"), list)
    ):
        names, least, most = FAMILIES[marginal["family"]]
        shapes = marginal["shapes"]
        numbers = all(isinstance(shape, int | float) for shape in shapes)
        if len(shapes) != len(names.split(", ")) or (numbers and not all(least <= s <= most for s in shapes)):
            text = f"{shown(shapes)} is not allowed; [{names}] of {marginal['family']}, each {least:g} to {most:g}"
            yield Mistake(("roughness.marginal.shapes", "roughness.marginal.family"), text)


def _scan_mistakes(scan: dict[str, Any]) -> Iterator[Mistake]:
    sources = [key for key in ("file", "grinding") if key in scan]
    if not sources:
        yield Mistake(("roughness.scan.file",), "missing; give the file of a scan, or grinding to have one made")
    if "grinding" in sources:
        for key in ("file", *STATED):
            if key in scan:
                text = f"{shown(scan[key])} is not allowed beside roughness.scan.grinding; give one"
                yield Mistake((f"roughness.scan.{key}", "roughness.scan.grinding"), text)
    spacings = [key for key in STATED[:2] if key in scan]
    if len(spacings) == 1 and "grinding" not in sources:
        (absent,) = set(STATED[:2]) - set(spacings)
        given = f"roughness.scan.{spacings[0]}"
        yield Mistake((f"roughness.scan.{absent}", given), f"missing; goes with {given}")
    if scan.get("marginal") == "gaussian" and "correct_correlation" in scan:
        keys = "roughness.scan.correct_correlation", "roughness.scan.marginal"
        text = f"{shown(scan[keys[0].rpartition('.')[2]])} is not allowed; a gaussian marginal changes no correlation"
        yield Mistake(keys, text)
