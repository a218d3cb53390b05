"""The parameters of the oscillator and its friction that an engineer can change, and what follows from a change.

What is not changed stays as a part of the machine: spring k [N/m], damper d [kg/s], mass, belt velocity, normal force,
excitation. So omega = sqrt(k / m) and D = d / (2 sqrt(k m)) follow from a change of mass or stiffness. A change of
damping changes the damper alone. The number of windows does not follow from the normal force. The mean friction
coefficient changes with the shear strength of the contacts: mean and scatter in proportion, the static limit not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from roughslip.errors import ParameterError
from roughslip.friction.process import FrictionProcess
from roughslip.oscillator.base_law import FrictionLaw
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.limits import slip_loop
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import mass_on_belt
from roughslip.stages.from_scene.mass_on_belt import FrictionNumbers


@dataclass(frozen=True)
class System:
    """Oscillator, law, numbers of friction and windows in parallel that belong together."""

    belt: Oscillator
    law: FrictionLaw
    numbers: FrictionNumbers
    windows: int

    @property
    def damper_kg_per_s(self) -> float:
        """d = 2 D m omega [kg/s]."""
        return 2.0 * self.belt.damping_ratio * self.belt.mass_kg * self.belt.natural_frequency_rad_per_s


@dataclass(frozen=True)
class Parameter:
    """One of them.

    title : with its symbol, for axes and sentences
    unit : in SI
    value : of a system
    """

    title: str
    unit: str
    value: Callable[[System], float]


PARAMETERS = {
    "damping": Parameter("damping ratio D", "1", lambda system: system.belt.damping_ratio),
    "belt_velocity": Parameter("belt velocity v0", "m s-1", lambda system: system.belt.belt_velocity_m_per_s),
    "mass": Parameter("mass m", "kg", lambda system: system.belt.mass_kg),
    "stiffness": Parameter("stiffness k", "N m-1", lambda system: system.belt.stiffness_n_per_m),
    "load": Parameter("normal force N", "N", lambda system: system.belt.normal_force_n),
    "windows": Parameter("windows in parallel n", "1", lambda system: system.windows),
    "correlation_length": Parameter("correlation length L", "m", lambda system: system.numbers.correlation_length_m),
    "mean_friction": Parameter("mean friction coefficient", "1", lambda system: system.numbers.mean),
}


def system(scene: Scene, numbers: FrictionNumbers) -> System:
    """What the scene states. It reads the section `oscillator`."""
    law = mass_on_belt.law(scene, numbers.mean)
    return System(mass_on_belt.oscillator(scene), law, numbers, scene.oscillator.windows_in_parallel)


def leaves_known_speeds(system: System) -> bool:
    """Whether sliding, steady or in the stick-slip cycle, is faster than the friction law was measured."""
    known = system.law.fastest_known
    return not math.isinf(known) and slip_loop(system.belt, system.law).fastest > known


def changeable(scene: Scene) -> list[str]:
    """The parameters that have an effect in the scene, in the order of PARAMETERS.

    A friction table gives the mean itself, and measured quantiles are those of one window. It reads the section
    `oscillator` and `ensemble.marginal`.
    """
    fixed = {
        "mean_friction": scene.oscillator.law == "table",
        "windows": scene.ensemble.marginal == "empirical",
    }
    return [name for name in PARAMETERS if not fixed.get(name)]


def changed(scene: Scene, numbers: FrictionNumbers, values: Mapping[str, float]) -> System:
    """The system of the scene with some parameters at other values.

    numbers : friction of the scene
    values : by names of PARAMETERS, in their units; windows are rounded to a whole number

    Given together, damping holds for the changed mass and stiffness. Raises ParameterError for a name that is not
    `changeable` or a value that is not positive (damping may be 0), InputError where the mean friction coefficient
    exceeds the static one.
    """
    refused = [name for name in values if name not in changeable(scene)]
    if refused:
        raise ParameterError(f"{refused[0]} has no effect in this scene; choose of: {', '.join(changeable(scene))}")
    for name, value in values.items():
        if not (math.isfinite(value) and (value > 0.0 or (name == "damping" and value == 0.0))):
            raise ParameterError(f"{name} must be finite and positive, not {value}")
    own = system(scene, numbers)
    belt = own.belt
    mass, stiffness = values.get("mass", belt.mass_kg), values.get("stiffness", belt.stiffness_n_per_m)
    if {"mass", "stiffness"} & values.keys():
        omega = math.sqrt(stiffness / mass)
        ratio = own.damper_kg_per_s / (2.0 * mass * omega)
        belt = replace(belt, mass_kg=mass, natural_frequency_rad_per_s=omega, damping_ratio=ratio)
    belt = replace(
        belt,
        damping_ratio=values.get("damping", belt.damping_ratio),
        belt_velocity_m_per_s=values.get("belt_velocity", belt.belt_velocity_m_per_s),
        normal_force_n=values.get("load", belt.normal_force_n),
    )
    mean = values.get("mean_friction", numbers.mean)
    friction = replace(
        numbers,
        mean=mean,
        standard_deviation=numbers.standard_deviation * (mean / numbers.mean),
        correlation_length_m=values.get("correlation_length", numbers.correlation_length_m),
    )
    windows = max(round(values.get("windows", own.windows)), 1)
    law = mass_on_belt.law(scene, mean) if "mean_friction" in values else own.law
    return System(belt, law, friction, windows)


def process(scene: Scene, changed: System, statistics: Path | None) -> FrictionProcess:
    """The stochastic part of friction of a changed system."""
    return mass_on_belt.friction_process(scene, changed.numbers, statistics, changed.windows)
