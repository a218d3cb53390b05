"""What goes together in an expansion: samples or an error, the field of the square, a surface that yields."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from roughslip.scene.roughness import Mistake
from roughslip.scene.strict_yaml import shown

AUTO = "auto"
BEST = "best"  # number of variables
FEWEST, GIVEN, MOST = 2, 8, 12  # variables that it is chosen from, as in chaos/selection.py, and local functionals
EXTENDED = ("sobol", "monte_carlo")  # designs that can be
SAMPLES, ERROR, DESIGN = "expansion.samples", "expansion.cdf_error", "expansion.design"
HARDNESS = "material.hardness_pa"
FIELD = "figure_field"  # the target that expands the pressure at every node
FIELD_GROUPS, FIELD_SAMPLES = 10, 100  # that its stage leaves out in turn, and that it needs
FIELD_NUMBERS = 90_000_000  # in each of the two tables that its stage holds: 1.5 GB


def terms(variables: int | str, degree: int, best: int = GIVEN) -> int:
    """Terms of an expansion; where the best number of variables is to be found, those of so many."""
    return math.comb((best if isinstance(variables, str) else variables) + degree, degree)


# In an overlay: by section, what a key takes the place of, where the overlay does not give that too.
REPLACES: dict[str, dict[str, tuple[str, ...]]] = {"expansion": {"samples": ("cdf_error",)}}


def mistakes(scene: dict[str, Any]) -> Iterator[Mistake]:
    """What does not go with the expansion; what the schema refuses is left to it."""
    yield from _sample_mistakes(scene)
    yield from _field_mistakes(scene)
    yield from _hardness_mistakes(scene)


def _sample_mistakes(scene: dict[str, Any]) -> Iterator[Mistake]:
    """What does not go with the samples; what the schema refuses is left to it."""
    samples, error, design = (scene["expansion"].get(key) for key in ("samples", "cdf_error", "design"))
    if samples == AUTO:
        if error is None:
            yield Mistake((ERROR, SAMPLES), f"missing; {SAMPLES} = {AUTO} needs it")
        if design is not None and design not in EXTENDED:
            text = f"{shown(design)} is not allowed; {' or '.join(EXTENDED)} with {SAMPLES} = {AUTO}, to be extended"
            yield Mistake((DESIGN, SAMPLES), text)
    elif samples is not None and error is not None:
        text = f"{shown(error)} is not allowed beside {SAMPLES} = {shown(samples)}; only {AUTO} takes it"
        yield Mistake((ERROR, SAMPLES), text)


def _field_mistakes(scene: dict[str, Any]) -> Iterator[Mistake]:
    """What does not go with the expansion at every node: a basis in all modes, and tables of all nodes."""
    samples, square, targets = scene["expansion"].get("samples"), scene.get("square"), scene.get("targets")
    asked = isinstance(targets, list) and FIELD in targets
    if not asked or not isinstance(samples, int) or not isinstance(square, dict):
        return
    modes, nodes = (square.get(key) if isinstance(square.get(key), int) else None for key in ("modes", "nodes"))
    if modes is not None and samples - math.ceil(samples / FIELD_GROUPS) <= modes + 1:
        text = f"{samples} is not allowed; without a {FIELD_GROUPS}th of them still more than the {modes + 1} terms of "
        yield Mistake((SAMPLES, "square.modes"), f"{text}{FIELD}, square.modes and a constant")
    elif samples < FIELD_SAMPLES:
        yield Mistake((SAMPLES,), f"{samples} is not allowed; at least {FIELD_SAMPLES} for {FIELD}")
    if nodes is not None and modes is not None and FIELD_GROUPS * modes * nodes**2 > FIELD_NUMBERS:
        text = f"{modes} is not allowed; {FIELD_GROUPS} times the modes times the {nodes**2} nodes at most "
        yield Mistake(("square.modes", "square.nodes"), f"{text}{FIELD_NUMBERS} (0.8 GB of memory) for {FIELD}")
    if nodes is not None and samples * nodes**2 > FIELD_NUMBERS:
        text = f"{samples} is not allowed; samples times the {nodes**2} nodes of the square at most {FIELD_NUMBERS}"
        yield Mistake((SAMPLES, "square.nodes"), f"{text} (1.5 GB of memory) for {FIELD}")


def _hardness_mistakes(scene: dict[str, Any]) -> Iterator[Mistake]:
    """What does not go with a surface that yields: a target without a gap, and ranks of pressures that are equal."""
    material, targets = scene.get("material"), scene.get("targets")
    hardness = material.get("hardness_pa") if isinstance(material, dict) else None
    if hardness is None:
        return
    if scene["expansion"].get("target") == "censored":
        text = f"{shown('censored')} is not allowed; trial_pressure, squared_pressure or best where the surface yields"
        yield Mistake(("expansion.target", HARDNESS), f"{text}, at {HARDNESS} = {hardness} [Pa]")
    if isinstance(targets, list) and FIELD in targets:
        text = f"{shown(targets)} is not allowed; {FIELD} ranks the pressures of a node, and those at {HARDNESS}"
        yield Mistake(("targets", HARDNESS), f"{text} are equal: leave it out")
