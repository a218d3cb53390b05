"""The uncertain numbers of a scene by source, and its machine at other values of them.

Sources are the friction curve, the friction process, the contact solves, and each number of the oscillator and the
load. Contact solves carry the standard errors of scatter and correlation length that the friction statistics have.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from roughslip import store
from roughslip.oscillator.base_law import FrictionLaw
from roughslip.oscillator.budget import Machine
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.laws import LAWS
from roughslip.probability import NORMAL_95, Source
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import mass_on_belt, variation

CURVE, PROCESS, SOLVES = "friction curve", "friction process", "contact solves"
MEANS = ("friction.statistics.mean", "load.mean_friction", "friction.mean_at_median")  # a scene reads one of them
SCATTER, LENGTH = "friction.statistics.standard_deviation", "friction.statistics.correlation_length_m"
STATIC, TABLE = "oscillator.static_friction", "oscillator.friction_table"
OF_CURVE = (*MEANS, STATIC, "oscillator.stribeck_decay_s_per_m", "oscillator.stribeck_quadratic_s2_per_m2")
MACHINE = {
    "oscillator.mass_kg": "mass",
    "oscillator.natural_frequency_rad_per_s": "natural frequency",
    "oscillator.stiffness_n_per_m": "stiffness",
    "oscillator.damping_ratio": "damping",
    "oscillator.belt_velocity_m_per_s": "belt velocity",
    "oscillator.normal_force_n": "normal force",
    "load.force_n": "normal force",
}
OF_SOLVES = {"solved.scatter": "std", "solved.length": "length_least_squares"}  # factors of mean 1, by column


@dataclass(frozen=True)
class UncertainInputs:
    """Sources, and the machine at values of their inputs by name: dotted scene keys, or those of OF_SOLVES."""

    sources: tuple[Source, ...]
    machine: Callable[[Mapping[str, float]], Machine]


def uncertain_inputs(scene: Scene, statistics: Path | None) -> UncertainInputs:
    """What is uncertain in a scene. statistics : the file of the friction, if any"""
    numbers = mass_on_belt.friction_numbers(scene, statistics)
    own = variation.system(scene, numbers)
    process = variation.process(scene, own, statistics)
    unit = mass_on_belt.unit_of_scatter(scene, numbers)
    deviation = mass_on_belt.pad_deviation(scene, numbers, statistics) / unit
    solved = scene.friction.statistics is None
    multiplies = scene.friction.scatter == "multiplicative"

    def machine(values: Mapping[str, float]) -> Machine:
        def factor(key: str) -> float:
            return values[key] / value_of(scene, key) if key in values else 1.0

        of_mean = math.prod(map(factor, MEANS))
        scatter = factor(SCATTER) * values.get("solved.scatter", 1.0) * (of_mean if solved else 1.0)
        return Machine(
            _oscillator(scene, own.belt, values),
            _law(scene, of_mean * numbers.mean, values),
            deviation * (scatter / of_mean if multiplies else scatter),
            process.correlation_length_m * factor(LENGTH) * values.get("solved.length", 1.0),
            process.autocorrelation,
        )

    return UncertainInputs(_sources(scene, statistics), machine)


def value_of(scene: Scene, key: str) -> float:
    """The number that a scene gives under a dotted key."""
    found: Any = scene
    for part in key.split("."):
        found = found[int(part)] if part.isdigit() else getattr(found, part)
    return float(found)


def _sources(scene: Scene, statistics: Path | None) -> tuple[Source, ...]:
    inputs: dict[str, dict[str, tuple[float, float]]] = {CURVE: {}, PROCESS: {}, SOLVES: _of_solves(scene, statistics)}
    for key, uncertainty in scene.standard_uncertainties:
        is_curve = key in OF_CURVE or key.startswith(f"{TABLE}.")
        name = CURVE if is_curve else PROCESS if key in (SCATTER, LENGTH) else MACHINE[key]
        inputs.setdefault(name, {})[key] = value_of(scene, key), uncertainty
    return tuple(Source.independent(name, of) for name, of in inputs.items() if of)


def _of_solves(scene: Scene, statistics: Path | None) -> dict[str, tuple[float, float]]:
    """Value 1 and relative standard error of the factors that contact solves leave uncertain."""
    if statistics is None or scene.friction.statistics is not None:
        return {}
    result, found = store.read(statistics), {}
    combined = "" if mass_on_belt.is_under_load(result) else "combined_"
    for name, column in OF_SOLVES.items():
        ends = [result[f"{combined}{column}{end}"] for end in ("", "_low", "_high")]
        value, low, high = (mass_on_belt.at_penetration(scene, result, np.asarray(end)) for end in ends)
        error = (high - low) / (2.0 * NORMAL_95 * value)
        if math.isfinite(error) and error > 0.0:
            found[name] = 1.0, error
    return found


def _oscillator(scene: Scene, own: Oscillator, values: Mapping[str, float]) -> Oscillator:
    """The mass on the belt. Where the scene gives the stiffness, the natural frequency follows from it."""
    changes = {key.rpartition(".")[2]: value for key, value in values.items() if key in MACHINE}
    stiffness = changes.pop("stiffness_n_per_m", scene.oscillator.stiffness_n_per_m)
    if "force_n" in changes:
        changes["normal_force_n"] = changes.pop("force_n")
    if stiffness is not None:
        changes["natural_frequency_rad_per_s"] = math.sqrt(stiffness / changes.get("mass_kg", own.mass_kg))
    return replace(own, **changes)


def _law(scene: Scene, mean: float, values: Mapping[str, float]) -> FrictionLaw:
    """The friction law. A limit of stick that is the first coefficient of the table stays that; none falls below it."""
    section = scene.oscillator
    changes: dict[str, Any] = {key.rpartition(".")[2]: values[key] for key in OF_CURVE if key in values}
    static = changes.get("static_friction", section.static_friction)
    if section.friction_table is not None:
        rows = [
            (speed, values.get(f"{TABLE}.{row}.1", coefficient))
            for row, (speed, coefficient) in enumerate(section.friction_table)
        ]
        if section.static_friction == section.friction_table[0][1]:
            static = rows[0][1] if f"{TABLE}.0.1" in values else static
            rows[0] = rows[0][0], static
        changes["friction_table"] = tuple(rows)
    least = mean if section.friction_table is None else changes["friction_table"][0][1]
    changes["static_friction"] = max(static, least)
    return LAWS[section.law].from_scene(SimpleNamespace(**{**vars(section), **changes}), mean)
