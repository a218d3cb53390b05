"""The parameters of the oscillator and its friction that an engineer can change, and what follows from a change.

Those of the oscillator are in `roughslip.oscillator.changed`. The number of windows does not follow from the normal
force. The mean friction coefficient changes with the shear strength of the contacts: mean and scatter in proportion,
the static limit not.

Damping ratios and ranges of parameters follow from the limits of the scene's own oscillator. Points of a box of
parameters are run on the same realisations of friction.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from roughslip.errors import ConvergenceError, IllPosedError, InputError, ParameterError
from roughslip.friction.paths import path_sampler
from roughslip.friction.process import FrictionProcess
from roughslip.limits import PATH_NODES
from roughslip.oscillator.base_law import FrictionLaw
from roughslip.oscillator.changed import PARAMETERS as OF_OSCILLATOR
from roughslip.oscillator.changed import Parameter, changed_oscillator
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.limits import hopf_damping, limits_or_nan
from roughslip.oscillator.path import KeptPath
from roughslip.oscillator.states import run_until_known
from roughslip.scene.ensemble import StickSlipMap
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


def _of_belt(parameter: Parameter) -> Parameter:
    """A parameter of the oscillator as one of a system."""
    return replace(parameter, value=lambda system: parameter.value(system.belt))


PARAMETERS = {
    **{name: _of_belt(parameter) for name, parameter in OF_OSCILLATOR.items()},
    "windows": Parameter("windows in parallel n", "1", lambda system: system.windows),
    "correlation_length": Parameter("correlation length L", "m", lambda system: system.numbers.correlation_length_m),
    "mean_friction": Parameter("mean friction coefficient", "1", lambda system: system.numbers.mean),
}


def system(scene: Scene, numbers: FrictionNumbers) -> System:
    """What the scene states. It reads the section `oscillator`."""
    law = mass_on_belt.law(scene, numbers)
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
        curve=numbers.curve and numbers.curve.times(mean / numbers.mean),
    )
    windows = max(round(values.get("windows", own.windows)), 1)
    law = mass_on_belt.law(scene, friction) if "mean_friction" in values else own.law
    return System(belt, law, friction, windows)


def process(scene: Scene, changed: System, statistics: Path | None) -> FrictionProcess:
    """The stochastic part of friction of a changed system."""
    return mass_on_belt.friction_process(scene, changed.numbers, statistics, changed.windows)


BELOW, NEAR, ABOVE = 5, 12, 3
REACH = 3.0  # standard deviations of the limit
FACTOR = 4.0  # of a range around the scene's own value


def damping_ratios(scene: Scene, numbers: FrictionNumbers, statistics: Path | None) -> tuple[float, ...]:
    """The damping ratios of figure5: as given, or around the limits of the scene without excitation.

    They go from a fifth of the smaller limit to 1.25 of the larger one, or as far as the scatter of friction moves the
    existence limit: NEAR of them where it moves it, BELOW and ABOVE of them on either side. It reads the sections
    `oscillator` and `ensemble`. Raises IllPosedError where the law has no limits.

    statistics : the file of the friction, if any
    """
    if scene.ensemble.damping_ratios is not None:
        return scene.ensemble.damping_ratios
    free = replace(mass_on_belt.oscillator(scene), excitation_force_n=0.0)
    law = mass_on_belt.law(scene, numbers)
    try:
        response, scatter = mass_on_belt.response_of_limit(scene, free, numbers, statistics)
    except (ParameterError, IllPosedError, ConvergenceError) as error:
        raise IllPosedError(
            "ensemble.damping_ratios is not given and follows from the limits of the stick-slip cycle, which the "
            f"oscillator does not have ({error}); give a list"
        ) from error
    deviation = numbers.standard_deviation / math.sqrt(mass_on_belt.independent_windows(scene, statistics))
    limit, hopf = response.limit, max(hopf_damping(free, law), 0.0)
    moved = REACH * scatter * deviation
    first = 0.2 * (min(limit, hopf) or limit)
    last = max(1.25 * max(limit, hopf), limit + moved)
    near = np.linspace(max(limit - moved, first), limit + moved, NEAR)
    below, above = np.linspace(first, near[0], BELOW + 1)[:-1], np.linspace(near[-1], last, ABOVE + 1)[1:]
    return tuple(np.unique(np.concatenate([below, near, above])).tolist())


def own_range(name: str, own: System) -> tuple[float, float]:
    """First and last value of a parameter of `PARAMETERS`: a factor of FACTOR around that of the scene.

    Damping ratios also reach half of the smaller limit of the scene and twice the larger one, where it has limits.
    """
    value = PARAMETERS[name].value(own)
    values = [value / FACTOR, value * FACTOR] if value > 0.0 else []
    if name == "damping":
        limits = [limit for limit in limits_or_nan(own.belt, own.law) if limit > 0.0]
        values += [factor * limit for limit in limits for factor in (0.5, 2.0)]
        values = values or [0.01, 1.0]
    return max(min(values), 1.0) if name == "windows" else min(values), max(values)


OF_FRICTION = ("windows", "correlation_length", "mean_friction")  # parameters that change the friction process
Box = dict[str, tuple[float, float]]


def box(scene: Scene, numbers: FrictionNumbers, asked: StickSlipMap) -> Box:
    """First and last value of the two parameters of a map, by names of `PARAMETERS` in their order.

    asked : section `map`; where it gives no ranges, those of `own_range` serve

    Raises InputError for a parameter without effect in the scene.
    """
    own, allowed = system(scene, numbers), changeable(scene)
    for name in asked.parameters:
        if name not in allowed:
            raise InputError(f"map.parameters: {name} has no effect in this scene; choose of: {', '.join(allowed)}")
    if asked.ranges is None:
        ranges = {name: own_range(name, own) for name in asked.parameters}
    else:
        ranges = dict(zip(asked.parameters, asked.ranges, strict=True))
    return {name: (float(ranges[name][0]), float(ranges[name][1])) for name in PARAMETERS if name in ranges}


def spaced(first: float, last: float, points: int) -> np.ndarray:
    """Values from first to last, evenly in their logarithm, or evenly from zero."""
    return np.geomspace(first, last, points) if first > 0.0 else np.linspace(first, last, points)


class PointRuns:
    """Shares of stick-slip in the second half of runs from rest on the belt, counted from the first departure.

    One generator per realisation serves every point, so that neighbours err together. Results do not depend on the
    order of the points.

    scene : with section `oscillator`, and `ensemble.marginal`
    numbers, statistics : friction of the scene, and its file if any
    periods : natural periods of a run after its first departure
    stream : of the random numbers
    runs, steps, sticks, paths : counts of what was done
    """

    def __init__(
        self, scene: Scene, numbers: FrictionNumbers, statistics: Path | None, periods: float, stream: int
    ) -> None:
        self._scene, self._numbers, self._statistics = scene, numbers, statistics
        self._periods, self._seed = periods, (scene.seed, stream)
        self._options = mass_on_belt.motion_options(scene)
        self._of_friction: tuple[float, ...] | None = None
        self._kept: dict[int, KeptPath] = {}
        self.runs = self.steps = self.sticks = self.paths = 0

    def shares(self, values: Mapping[str, float], realisations: Sequence[int]) -> np.ndarray:
        """(realisations,) [-] at a point, given by values of the parameters of the box."""
        point = changed(self._scene, self._numbers, values)
        of_friction = tuple(values[name] for name in OF_FRICTION if name in values)
        if of_friction != self._of_friction:
            friction = process(self._scene, point, self._statistics)
            self._paths = path_sampler(friction, friction.correlation_length_m / PATH_NODES)
            self._of_friction, self._kept = of_friction, {}
        shares = np.empty(len(realisations))
        for row, number in enumerate(realisations):
            if number not in self._kept:
                self._kept[number] = KeptPath(self._paths.realisation([*self._seed, number]))
                self.paths += 1
            path, spacing = self._kept[number], self._paths.spacing
            motion, first, states = run_until_known(point.belt, point.law, path, spacing, self._periods, self._options)
            share = states.share(first + 0.5 * self._periods, first + self._periods)
            shares[row] = np.nan_to_num(share)  # micro-slips alone are no stick-slip
            self.runs, self.steps = self.runs + 1, self.steps + motion.steps
            self.sticks += motion.cycles + motion.micro_slips
        return shares
