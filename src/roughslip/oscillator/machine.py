"""A machine: a mass on a belt, its friction law and the scatter about it, and what follows from a change of either.

What is not changed stays as a part of the machine: spring k [N/m], damper d [kg/s], mass, belt velocity, normal force,
excitation. So omega = sqrt(k / m) and D = d / (2 sqrt(k m)) follow from a change of mass or stiffness. A change of
damping changes the damper alone, and one of load friction too as far as `FrictionOverLoad` is known. The mean friction
coefficient changes with the shear strength of the contacts: mean and scatter in proportion, and the law as it says
itself.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.limits import PATH_NODES
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.limits import slip_loop
from roughslip.oscillator.memory_law import MemoryLaw
from roughslip.oscillator.motion import DEFAULTS, MotionOptions
from roughslip.oscillator.path import KeptPath
from roughslip.validation import gate


class Parameter(NamedTuple):
    """What an engineer can change: its title with its symbol, and its unit."""

    title: str
    unit: str


PARAMETERS = {
    "damping": Parameter("damping ratio D", "1"),
    "belt_velocity": Parameter("belt velocity v0", "m s-1"),
    "mass": Parameter("mass m", "kg"),
    "stiffness": Parameter("stiffness k", "N m-1"),
    "load": Parameter("normal force N", "N"),
    "windows": Parameter("windows in parallel n", "1"),
    "correlation_length": Parameter("correlation length L", "m"),
    "mean_friction": Parameter("mean friction coefficient", "1"),
    "memory_length": Parameter("memory length D_c", "m"),
    "direct_effect": Parameter("direct effect a", "1"),
    "ageing_effect": Parameter("ageing effect b", "1"),
}
OF_FRICTION = ("windows", "correlation_length", "mean_friction")
OF_MEMORY = {"memory_length": "memory_length_m", "direct_effect": "direct_effect", "ageing_effect": "ageing_effect"}
OF_OSCILLATOR = tuple(name for name in PARAMETERS if name not in (*OF_FRICTION, *OF_MEMORY))


@dataclass(frozen=True)
class FrictionOverLoad:
    """How the friction force of a pad follows its normal force.

    loads : (n,) [N] normal forces, rising
    forces : (n,) [N] friction force over the friction coefficient of the machine, rising; the same where that is held

    Power laws between, in proportion beyond. Friction at all speeds, the limit of stick and scatter follow alike: all
    are in proportion to the contact area. So a load acts as that of the same friction force, with all else held.
    """

    loads: tuple[float, ...]
    forces: tuple[float, ...]

    def force(self, load: float) -> float:
        """[N] of a normal force [N]."""
        return _along(load, self.loads, self.forces)

    def load(self, force: float) -> float:
        """Normal force [N] that has a friction force [N]."""
        return _along(force, self.forces, self.loads)


def _along(place: float, places: Sequence[float], values: Sequence[float]) -> float:
    inside = min(max(place, places[0]), places[-1])
    return place / inside * math.exp(float(np.interp(math.log(inside), np.log(places), np.log(values))))


class ScatteringFriction(Protocol):
    """Friction of the pad that bears the load, with paths of mu_S: `roughslip.friction.Friction`."""

    @property
    def path_deviation(self) -> float:
        """Standard deviation of mu_S."""


@gate
@dataclass(frozen=True)
class Machine:
    """Oscillator, friction law and the scatter about it.

    oscillator : mass, spring, damper, belt and load
    law : mean friction against sliding speed
    friction : its scatter along the slipped distance, a `roughslip.friction.Friction`; None for none
    options : how its motion is integrated; whether scatter multiplies is as the friction says
    over_load : how friction follows the normal force; None where the friction coefficient is held. The oscillator then
        has the normal force of the same friction force under that coefficient
    """

    oscillator: Oscillator
    law: FrictionLaw
    friction: ScatteringFriction | None = None
    options: MotionOptions = DEFAULTS
    over_load: FrictionOverLoad | None = None

    def __post_init__(self) -> None:
        if self.friction is not None:
            kind = "multiplicative" if self.scattering.multiplies else "additive"
            object.__setattr__(self, "options", replace(self.options, scatter=kind))

    @property
    def scattering(self) -> Any:
        """The friction, of a machine that has one."""
        if self.friction is None:
            raise ParameterError("the machine has no friction that scatters: give it a roughslip.friction.Friction")
        return self.friction

    @property
    def memory(self) -> MemoryLaw:
        """The law, of a machine whose friction has a memory."""
        if not isinstance(self.law, MemoryLaw):
            raise ParameterError("friction has no memory: give a MemoryLaw")
        return self.law

    @gate
    def value(self, name: str) -> float:
        """A parameter of PARAMETERS, in its unit."""
        belt = self.oscillator
        if name in OF_MEMORY:
            return float(getattr(self.memory, OF_MEMORY[name]))
        if name in OF_FRICTION:
            friction = self.scattering
            of_friction = {"windows": friction.windows, "correlation_length": friction.length_m}
            return of_friction.get(name, friction.mean)
        return {
            "damping": belt.damping_ratio,
            "belt_velocity": belt.belt_velocity_m_per_s,
            "mass": belt.mass_kg,
            "stiffness": belt.stiffness_n_per_m,
            "load": belt.normal_force_n if self.over_load is None else self.over_load.load(belt.normal_force_n),
        }[name]

    @gate
    def changed(self, values: Mapping[str, float]) -> Machine:
        """The machine with some parameters at other values.

        values : by names of PARAMETERS, in their units; windows are rounded to a whole number

        Given together, damping holds for the changed mass and stiffness. Raises ParameterError for another name or a
        value that is not finite and positive (damping may be 0).
        """
        for name, value in values.items():
            if name not in PARAMETERS:
                raise ParameterError(f"a machine has no {name} to change: choose of {', '.join(PARAMETERS)}")
            if not (math.isfinite(value) and (value > 0.0 or (name, value) == ("damping", 0.0))):
                raise ParameterError(f"{name} must be finite and positive, not {value}")
        changed = replace(self, oscillator=self._oscillator(values))
        if OF_MEMORY.keys() & values.keys():
            of_memory: dict[str, Any] = {OF_MEMORY[name]: values[name] for name in OF_MEMORY if name in values}
            changed = replace(changed, law=replace(self.memory, **of_memory))
        if not any(name in values for name in OF_FRICTION):
            return changed
        own = self.scattering
        mean, windows = values.get("mean_friction", own.mean), values.get("windows", own.windows)
        length = values.get("correlation_length", own.length_m)
        friction = own.changed(mean=mean, windows=max(round(windows), 1), length_m=length)
        law = changed.law.times(mean / own.mean) if "mean_friction" in values else changed.law
        return replace(changed, law=law, friction=friction)

    def _oscillator(self, values: Mapping[str, float]) -> Oscillator:
        """The oscillator with other values."""
        belt = self.oscillator
        if {"mass", "stiffness"} & values.keys():
            mass, stiffness = values.get("mass", belt.mass_kg), values.get("stiffness", belt.stiffness_n_per_m)
            omega = math.sqrt(stiffness / mass)
            ratio = belt.damper_kg_per_s / (2.0 * mass * omega)
            belt = replace(belt, mass_kg=mass, natural_frequency_rad_per_s=omega, damping_ratio=ratio)
        load = values.get("load")
        if load is not None and self.over_load is not None:
            load = self.over_load.force(load)
        return replace(
            belt,
            damping_ratio=values.get("damping", belt.damping_ratio),
            belt_velocity_m_per_s=values.get("belt_velocity", belt.belt_velocity_m_per_s),
            normal_force_n=belt.normal_force_n if load is None else load,
        )

    @cached_property
    def paths(self) -> Any:
        """Friction paths by their seeds, the same for every machine of equal friction."""
        return self.scattering.paths(PATH_NODES)

    @gate
    def kept_path(self, seed: Sequence[int], most_nodes: float = math.inf) -> KeptPath:
        """The path of a seed, kept in memory as far as motions read it. most_nodes : that are kept"""
        return KeptPath(self.paths.realisation(seed), most_nodes)


def cycle_exists(machine: Machine) -> bool | None:
    """Whether the stick-slip cycle without scatter exists; None where slip is too stiff to decide."""
    try:
        return slip_loop(machine.oscillator, machine.law).cycle is not None
    except ConvergenceError:
        return None
