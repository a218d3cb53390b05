"""Warnings on a scene that is allowed but implausible: what, its number, the key, what to do.

They take the scene's values alone. Those on its surface stand in `roughslip.surface.plausibility`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from roughslip.limits import FUNCTIONALS
from roughslip.scene.auto import unless_auto
from roughslip.scene.expansion import terms
from roughslip.scene.mistakes import Values
from roughslip.scene.plan import stages_needed
from roughslip.scene.rules import training_columns
from roughslip.scene.types import get

SOLIDS = {  # [Pa] the softest and the stiffest or hardest solids; beyond, a unit is wrong
    "young_modulus_pa": (1e5, "soft rubber", 1.3e12, "diamond"),
    "hardness_pa": (1e6, "rubber", 1.5e11, "diamond"),
}
SHALLOW = 1.3  # mean friction at 5 % over that at the median, on the surfaces of the shipped scenes
LEAST_CELLS = 2.0  # in contact: one cell keeps its area at a vanishing force, so that its A / N has no variance
SAMPLES_PER_TERM = 2  # least oversampling of regressions, Hosder, Walters & Balch, AIAA 2007-1939


def cells_of(scene: Values) -> dict[str, float]:
    """[m] edge of the cells of strip and square, by key, of those that the scene solves."""
    stages, cells = stages_needed(scene), {}
    if "contact_strip" in stages:
        cells["strip.cell_m"] = get(scene, "strip.cell_m")
    if "karhunen_loeve" in stages:
        cells["square.edge_m / square.nodes"] = get(scene, "square.edge_m") / get(scene, "square.nodes")
    return cells


def warnings(scene: Values, length_m: float | None = None) -> list[str]:
    """A line for each thing that the scene hardly means.

    length_m : 1/e length of the heights along the belt, where it is known
    """
    return [*_materials(scene), *_static_friction(scene), *_training(scene, length_m), *_least_contact(scene)]


def _materials(scene: Values) -> Iterator[str]:
    if not stages_needed(scene) & {"contact_strip", "contact_square", "adaptive_training"}:
        return
    for key, (least, softest, most, hardest) in SOLIDS.items():
        value = get(scene, f"material.{key}")
        if value is not None and not least <= value <= most:
            which = f"below the {least:g} Pa of {softest}" if value < least else f"above the {most:g} Pa of {hardest}"
            yield f"material.{key} = {value:.3g} Pa is {which}: check the unit, Pa"


def _static_friction(scene: Values) -> Iterator[str]:
    """A mean above the static coefficient where the rules of scenes do not refuse it."""
    static, law = get(scene, "oscillator.static_friction"), get(scene, "oscillator.law")
    if "deterministic" not in stages_needed(scene):
        return
    if law == "table":
        largest = max(coefficient for _, coefficient in get(scene, "oscillator.friction_table"))
        if static < largest:
            yield (
                f"oscillator.static_friction = {static:.3g} is below {largest:.3g}, the largest of "
                "oscillator.friction_table: stick ends at less friction than slip has. Check both"
            )
    elif (get(scene, "oscillator.penetration_percentile") or 50.0) < 50:  # none where it follows from a load
        mean = SHALLOW * get(scene, "friction.mean_at_median")
        if static < mean:
            yield (
                f"oscillator.static_friction = {static:.3g} may be below the mean friction at "
                f"oscillator.penetration_percentile, up to {mean:.3g}, and is then refused after all contacts "
                f"are solved. Take at least {mean:.3g}"
            )


def _training(scene: Values, length_m: float | None) -> Iterator[str]:
    """Few samples for the terms of an expansion. Columns of a strip count once a correlation length."""
    stages, degree = stages_needed(scene), get(scene, "expansion.degree")
    variables, samples = get(scene, "expansion.variables"), get(scene, "expansion.samples")
    if "chaos_square" in stages and unless_auto(samples) is not None:
        count = terms(variables, degree)
        needed = SAMPLES_PER_TERM * count
        if samples < needed:
            yield (
                f"expansion.samples = {samples} are fewer than {SAMPLES_PER_TERM} for each of the {count} terms of "
                f"expansion.variables = {variables} and expansion.degree = {degree}. Take at least {needed}, "
                "or a lower degree"
            )
    if "chaos_strip" in stages:
        strip: dict[str, Any] = get(scene, "strip")
        columns = training_columns(strip["length_m"] / strip["cell_m"])
        if length_m is not None:
            columns = min(columns, max(1, int(strip["length_m"] / length_m * (1 + 1e-9))))
        strips, count = strip["training_samples"], terms(FUNCTIONALS, degree)
        least = math.ceil(SAMPLES_PER_TERM * count / columns)
        if strips < least:
            yield (
                f"strip.training_samples = {strips} have {strips * columns} independent columns, fewer than "
                f"{SAMPLES_PER_TERM} for each of the {count} terms of expansion.degree = {degree}. Take at least "
                f"{least}, or a lower degree"
            )


def _least_contact(scene: Values) -> Iterator[str]:
    """Windows that count with a single cell in contact."""
    if "contact_strip" not in stages_needed(scene):
        return
    strip, share = get(scene, "strip"), get(scene, "friction.least_contact_fraction")
    cells = strip["window_m"] * strip["width_m"] / strip["cell_m"] ** 2
    if share * cells < LEAST_CELLS * (1 - 1e-9):
        yield (
            f"friction.least_contact_fraction = {share:g} lets a window count with {share * cells:.2g} cells in "
            f"contact. The friction of a single cell grows without bound. Take at least {LEAST_CELLS / cells:.2g}, or "
            "smaller cells"
        )
