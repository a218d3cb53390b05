"""What an engineer can change of a mass on a belt: its parameters by name, and what follows from a change.

What is not changed stays as a part of the machine: spring k [N/m], damper d [kg/s], mass, belt velocity, normal force,
excitation. So omega = sqrt(k / m) and D = d / (2 sqrt(k m)) follow from a change of mass or stiffness. A change of
damping changes the damper alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from roughslip.oscillator.equation import Oscillator


@dataclass(frozen=True)
class Parameter:
    """One of them.

    title : with its symbol, for axes and sentences
    unit : in SI
    attribute : of an oscillator
    """

    title: str
    unit: str
    attribute: str

    def value(self, oscillator: Oscillator) -> float:
        """Of an oscillator."""
        return float(getattr(oscillator, self.attribute))


PARAMETERS = {
    "damping": Parameter("damping ratio D", "1", "damping_ratio"),
    "belt_velocity": Parameter("belt velocity v0", "m s-1", "belt_velocity_m_per_s"),
    "mass": Parameter("mass m", "kg", "mass_kg"),
    "stiffness": Parameter("stiffness k", "N m-1", "stiffness_n_per_m"),
    "load": Parameter("normal force N", "N", "normal_force_n"),
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
