"""Warnings on a scene that is allowed but implausible: what, its number, the key, what to do.

They take its values, and the files that give these. Those on its surface stand in `roughslip.surface.plausibility`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from roughslip.limits import FUNCTIONALS
from roughslip.scene.contact import training_columns
from roughslip.scene.expansion import terms
from roughslip.scene.loader import read_chain
from roughslip.scene.mistakes import Values
from roughslip.scene.plan import stages_needed
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
    if "chaos_square" in stages:
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
        minimum = math.ceil(SAMPLES_PER_TERM * count / columns)
        if strips < minimum:
            yield (
                f"strip.training_samples = {strips} have {strips * columns} independent columns, fewer than "
                f"{SAMPLES_PER_TERM} for each of the {count} terms of expansion.degree = {degree}. Take at least "
                f"{minimum}, or a lower degree"
            )


def _least_contact(scene: Values) -> Iterator[str]:
    """Windows that count with a single cell in contact."""
    if not stages_needed(scene) & {"contact"}:
        return
    strip, share = get(scene, "strip"), get(scene, "friction.least_contact_fraction")
    cells = strip["window_m"] * strip["width_m"] / strip["cell_m"] ** 2
    if share * cells < LEAST_CELLS * (1 - 1e-9):
        yield (
            f"friction.least_contact_fraction = {share:g} lets a window count with {share * cells:.2g} cells in "
            f"contact. The friction of a single cell grows without bound. Take at least {LEAST_CELLS / cells:.2g}, or "
            "smaller cells"
        )


_OWN_CURVE = ("law", "friction_table", "stribeck_decay_s_per_m")


def inherited(name: str, scenes_folder: Path) -> list[str]:
    """Warnings on what a valid scene inherits and hardly means: a friction curve and a spring of another machine.

    A key counts as the scene's own where the file that gives it stands above the file that gives the other one.
    """
    chain, merged = read_chain(scenes_folder / f"{name}.yaml", scenes_folder)
    level = {file: chain.index(file) for file in chain}

    def height(*keys: str) -> int:
        """The topmost file that gives one of these keys, counted from the top; beyond the last where none does."""
        paths = [path for key in keys if _has(merged.values, path := tuple(key.split(".")))]
        return min((level[merged.file_of(path)] for path in paths), default=len(chain))

    warnings = []
    curve = height(*(f"oscillator.{key}" for key in _OWN_CURVE))
    own = [key for key in ("load", "material.young_modulus_pa") if height(key) < curve]
    if own and curve < len(chain):
        warnings.append(
            f"oscillator.law: the friction curve is that of scene {chain[curve].stem}, and {' and '.join(own)} is of "
            "this scene. The curve decides whether stick-slip occurs: give law, its numbers and static_friction"
        )
    if height("oscillator.mass_kg") < height("oscillator.natural_frequency_rad_per_s") < len(chain):
        mass, omega = (merged.values["oscillator"][key] for key in ("mass_kg", "natural_frequency_rad_per_s"))
        warnings.append(
            f"oscillator.mass_kg: with the natural frequency of scene "
            f"{chain[height('oscillator.natural_frequency_rad_per_s')].stem}, {omega:g} rad/s, the spring follows as "
            f"{mass * omega**2:.3g} N/m: give stiffness_n_per_m"
        )
    return warnings


def _has(values: Any, path: tuple[str, ...]) -> bool:
    """Whether there is a value at a path."""
    for key in path:
        if not isinstance(values, dict) or key not in values:
            return False
        values = values[key]
    return True
