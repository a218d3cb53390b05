"""Runs of the oscillator at points of a box of parameters, on the same realisations of friction at every point."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from roughslip.errors import InputError
from roughslip.friction.paths import path_sampler
from roughslip.oscillator.path import KeptPath
from roughslip.oscillator.states import run_until_known
from roughslip.scene.ensemble import StickSlipMap
from roughslip.scene.fields import unless_auto
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import mass_on_belt, variation
from roughslip.stages.from_scene.mass_on_belt import FrictionNumbers
from roughslip.stages.from_scene.own_limits import own_range

NODES = 4  # per correlation length: whether a mass sticks again depends on integrals over many of them
OF_FRICTION = ("windows", "correlation_length", "mean_friction")  # parameters that change the friction process
Box = dict[str, tuple[float, float]]


def box(scene: Scene, numbers: FrictionNumbers, asked: StickSlipMap) -> Box:
    """First and last value of the two parameters of a map, by names of `variation.PARAMETERS` in their order.

    asked : section `map`; auto stands for `own_range`

    Raises InputError for a parameter without effect in the scene.
    """
    own, changeable = variation.system(scene, numbers), variation.changeable(scene)
    for name in asked.parameters:
        if name not in changeable:
            allowed = ", ".join(changeable)
            raise InputError(f"map.parameters: {name} has no effect in this scene; choose of: {allowed}")
    ends = {name: unless_auto(value) for name, value in zip(asked.parameters, asked.ranges, strict=True)}
    return {
        name: own_range(name, own) if (pair := ends[name]) is None else (float(pair[0]), float(pair[1]))
        for name in variation.PARAMETERS
        if name in ends
    }


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
        system = variation.changed(self._scene, self._numbers, values)
        of_friction = tuple(values[name] for name in OF_FRICTION if name in values)
        if of_friction != self._of_friction:
            process = variation.process(self._scene, system, self._statistics)
            self._paths = path_sampler(process, process.correlation_length_m / NODES)
            self._of_friction, self._kept = of_friction, {}
        shares = np.empty(len(realisations))
        for row, number in enumerate(realisations):
            if number not in self._kept:
                self._kept[number] = KeptPath(self._paths.realisation([*self._seed, number]))
                self.paths += 1
            path, spacing = self._kept[number], self._paths.spacing
            motion, first, states = run_until_known(
                system.belt, system.law, path, spacing, self._periods, self._options
            )
            share = states.share(first + 0.5 * self._periods, first + self._periods)
            shares[row] = np.nan_to_num(share)  # micro-slips alone are no stick-slip
            self.runs, self.steps = self.runs + 1, self.steps + motion.steps
            self.sticks += motion.cycles + motion.micro_slips
        return shares
