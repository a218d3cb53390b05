"""The parameters of the oscillator and its friction that an engineer can change, and what follows from a change.

Those of the oscillator are in `roughslip.oscillator.changed`. The number of windows does not follow from the normal
force. The mean friction coefficient changes with the shear strength of the contacts: mean and scatter in proportion,
the static limit not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path

from roughslip.errors import ParameterError
from roughslip.friction.process import FrictionProcess
from roughslip.oscillator.base_law import FrictionLaw
from roughslip.oscillator.changed import PARAMETERS as OF_OSCILLATOR
from roughslip.oscillator.changed import changed_oscillator
from roughslip.oscillator.equation import Oscillator
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
    **{
        name: Parameter(one.title, one.unit, attrgetter(f"belt.{one.attribute}")) for name, one in OF_OSCILLATOR.items()
    },
    "windows": Parameter("windows in parallel n", "1", lambda system: system.windows),
    "correlation_length": Parameter("correlation length L", "m", lambda system: system.numbers.correlation_length_m),
    "mean_friction": Parameter("mean friction coefficient", "1", lambda system: system.numbers.mean),
}


def system(scene: Scene, numbers: FrictionNumbers) -> System:
    """What the scene states. It reads the section `oscillator`."""
    law = mass_on_belt.law(scene, numbers.mean)
    return System(mass_on_belt.oscillator(scene), law, numbers, scene.oscillator.windows_in_parallel)


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
    belt = changed_oscillator(own.belt, values)
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
