"""What an engineer can change of a mass on a belt: its parameters by name, and what follows from a change.

What is not changed stays as a part of the machine: spring k [N/m], damper d [kg/s], mass, belt velocity, normal force,
excitation. So omega = sqrt(k / m) and D = d / (2 sqrt(k m)) follow from a change of mass or stiffness. A change of
damping changes the damper alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

from roughslip.oscillator.equation import Oscillator


@dataclass(frozen=True)
class Parameter:
    """One of them.

    title : with its symbol, for axes and sentences
    unit : in SI
    value : of an oscillator, or of what the parameter belongs to
    """

    title: str
    unit: str
    value: Callable[[Any], float]


PARAMETERS = {
    "damping": Parameter("damping ratio D", "1", attrgetter("damping_ratio")),
    "belt_velocity": Parameter("belt velocity v0", "m s-1", attrgetter("belt_velocity_m_per_s")),
    "mass": Parameter("mass m", "kg", attrgetter("mass_kg")),
    "stiffness": Parameter("stiffness k", "N m-1", attrgetter("stiffness_n_per_m")),
    "load": Parameter("normal force N", "N", attrgetter("normal_force_n")),
}


def damper_kg_per_s(oscillator: Oscillator) -> float:
    """d = 2 D m omega [kg/s]."""
    return 2.0 * oscillator.damping_ratio * oscillator.mass_kg * oscillator.natural_frequency_rad_per_s


def changed_oscillator(oscillator: Oscillator, values: Mapping[str, float]) -> Oscillator:
    """The oscillator with some parameters at other values. values : by names of PARAMETERS, in their units

    Given together, damping holds for the changed mass and stiffness. Raises ParameterError as `Oscillator` does.
    """
    belt = oscillator
    if {"mass", "stiffness"} & values.keys():
        mass, stiffness = values.get("mass", belt.mass_kg), values.get("stiffness", belt.stiffness_n_per_m)
        omega = math.sqrt(stiffness / mass)
        ratio = damper_kg_per_s(belt) / (2.0 * mass * omega)
        belt = replace(belt, mass_kg=mass, natural_frequency_rad_per_s=omega, damping_ratio=ratio)
    return replace(
        belt,
        damping_ratio=values.get("damping", belt.damping_ratio),
        belt_velocity_m_per_s=values.get("belt_velocity", belt.belt_velocity_m_per_s),
        normal_force_n=values.get("load", belt.normal_force_n),
    )
