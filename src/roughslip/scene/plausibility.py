"""Warnings on a scene that is allowed but implausible: what, its number, the key, what to do.

They take its values, and the files that give these. Those on its surface stand in `roughslip.surface.plausibility`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from roughslip.limits import LEAST_CONTACT, WINDOWS
from roughslip.scene.contact import terms, training_columns
from roughslip.scene.files import read_chain
from roughslip.scene.mistakes import Values, given
from roughslip.scene.types import get
from roughslip.study.plan import stages_needed

SOLIDS = {  # [Pa] the softest and the stiffest or hardest solids; beyond, a unit is wrong
    "young_modulus_pa": (1e5, "soft rubber", 1.3e12, "diamond"),
    "hardness_pa": (1e6, "rubber", 1.5e11, "diamond"),
}
LEAST_CELLS = 2.0  # in contact: one cell keeps its area at a vanishing force, so that its A / N has no variance
SAMPLES_PER_TERM = 2  # least oversampling of regressions, Hosder, Walters & Balch, AIAA 2007-1939


def cells_of(scene: Values) -> dict[str, float]:
    """[m] edge of the cells of strip and square, by key, of those that the scene solves."""
    stages, cells = stages_needed(scene), {}
    if stages & {"contact"}:
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
    if not stages_needed(scene) & {"contact", "contact_square"}:
        return
    for key, (minimum, softest, maximum, hardest) in SOLIDS.items():
        value = get(scene, f"material.{key}")
        if value is not None and not minimum <= value <= maximum:
            which = (
                f"below the {minimum:g} Pa of {softest}"
                if value < minimum
                else f"above the {maximum:g} Pa of {hardest}"
            )
            yield f"material.{key} = {value:.3g} Pa is {which}: check the unit, Pa"


def _static_friction(scene: Values) -> Iterator[str]:
    """A mean above the static coefficient where the rules of scenes do not refuse it."""
    static, table = get(scene, "oscillator.static_friction"), get(scene, "oscillator.friction_table")
    if table is None or "cycles" not in stages_needed(scene):
        return
    largest = max(coefficient for _, coefficient in table)
    if static < largest:
        yield (
            f"oscillator.static_friction = {static:.3g} is below {largest:.3g}, the largest of "
            "oscillator.friction_table: stick ends at less friction than slip has. Check both"
        )


def _training(scene: Values, length_m: float | None) -> Iterator[str]:
    """Few samples for the terms of an expansion. Columns of a strip count once a correlation length."""
    stages, degree, samples = stages_needed(scene), get(scene, "expansion.degree"), get(scene, "expansion.samples")
    if stages.isdisjoint({"chaos_square", "chaos_strip"}):
        return
    needed = SAMPLES_PER_TERM * terms(degree)
    few = f"fewer than {SAMPLES_PER_TERM} for each of the {terms(degree)} terms of expansion.degree = {degree}"
    if "chaos_square" in stages and samples < needed:
        yield f"expansion.samples = {samples} are {few}. Take at least {needed}, or a lower degree"
    if "chaos_strip" in stages:
        strip: dict[str, Any] = get(scene, "strip")
        columns = training_columns(WINDOWS * strip["window_m"] / strip["cell_m"])
        if length_m is not None:
            columns = min(columns, max(1, int(WINDOWS * strip["window_m"] / length_m * (1 + 1e-9))))
        strips, least = strip["training_samples"], math.ceil(needed / columns)
        if strips < least:
            yield (
                f"strip.training_samples = {strips} have {strips * columns} independent columns, {few}. Take at "
                f"least {least}, or a lower degree"
            )


def _least_contact(scene: Values) -> Iterator[str]:
    """Windows that count with a single cell in contact."""
    if not stages_needed(scene) & {"contact"}:
        return
    strip = get(scene, "strip")
    cells = LEAST_CONTACT * strip["window_m"] * strip["width_m"] / strip["cell_m"] ** 2
    if cells < LEAST_CELLS * (1 - 1e-9):
        most = math.sqrt(cells / LEAST_CELLS) * strip["cell_m"]
        yield (
            f"strip.cell_m = {strip['cell_m']:g} m lets a window count with {cells:.2g} cells in contact. The friction "
            f"of a single cell grows without bound. Take cells of at most {most:.2g} m, or larger windows"
        )


_OWN_CURVE = ("law", "friction_table", "stribeck_decay_s_per_m")


def inherited(name: str, scenes_folder: Path) -> list[str]:
    """Warnings on what a valid scene inherits and hardly means: a friction curve of another machine.

    A key counts as the scene's own where the file that gives it stands above the file that gives the other one.
    """
    chain, merged = read_chain(scenes_folder / f"{name}.yaml", scenes_folder)

    def height(*keys: str) -> int:
        """The topmost file that gives one of these keys, counted from the top; beyond the last where none does."""
        files = (merged.file_of(tuple(key.split("."))) for key in keys if given(merged.values, key) is not None)
        return min(map(chain.index, files), default=len(chain))

    warnings = []
    curve = height(*(f"oscillator.{key}" for key in _OWN_CURVE))
    own = [key for key in ("load", "material.young_modulus_pa") if height(key) < curve]
    if own and curve < len(chain):
        warnings.append(
            f"oscillator.law: the friction curve is that of scene {chain[curve].stem}, and {' and '.join(own)} is of "
            "this scene. The curve decides whether stick-slip occurs: give law, its numbers and static_friction"
        )
    return warnings
