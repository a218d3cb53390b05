"""Runs that show whether a machine stick-slips, each looked at at a time of its own, and its cycles drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from roughslip.errors import ConvergenceError
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.motion import FrictionPath, Motion, Trajectory, trajectory
from roughslip.oscillator.path import KeptPath
from roughslip.oscillator.states import States, run_until_known, time_scales
from roughslip.probability.search import PROBES

KEPT_NODES, KEPT_PATHS, FAR_NODES = 2**16, 200, 2**19  # 100 MB; 50 MB of PROBES paths; what is beyond is drawn again
SAMPLES = 100  # a natural period, of the displacement: its extremes err by at most (pi / SAMPLES)^2 / 2
MOST_SAMPLES = 1e6  # of a run
LONGEST_RUN = 400.0  # natural periods that a run lasts by itself
MOST_STEPS, STEP_S = 5e8, 4e-7  # of slip in an answer; CPU seconds of a step
STEPS_PER_NODE = 0.15  # that the work of a node of the path is worth
SHOWN = 4  # cycles, or natural periods of sliding, that a picture shows
STRAIGHT = 1e-6  # of the range of X' and X: what a sample may differ from its neighbours' mean, and be left out
DIGITS = 5  # of the numbers of a picture


@dataclass(frozen=True)
class Run:
    """A run: its motion, first departure and states, and when it is looked at."""

    motion: Motion
    first: float
    states: States
    looked_at: float

    @property
    def cycles(self) -> bool:
        """Whether it stick-slips when it is looked at."""
        return self.states.is_stick_slip(self.looked_at)


@dataclass(frozen=True)
class Curve:
    """A motion to draw, with as many samples as it needs.

    time_s : (samples,) [s] from 0
    displacement_m, velocity_m_per_s : (samples,) [m], [m/s]
    cycles : how many of them it shows; 0 is sliding
    """

    time_s: tuple[float, ...]
    displacement_m: tuple[float, ...]
    velocity_m_per_s: tuple[float, ...]
    cycles: int


@dataclass(frozen=True)
class Runs:
    """Runs on the same friction paths, each looked at at a time of its own in the second half.

    count : of runs from either start
    duration : natural periods of a run; None for what its time scales take, up to LONGEST_RUN
    seed : of the path of run i, (*seed, i)
    steps : of each run so far, with those that its nodes are worth
    """

    own: Machine
    count: int
    duration: float | None
    seed: Sequence[int]
    kept: dict[int, KeptPath] = field(default_factory=dict)
    steps: list[float] = field(default_factory=list)

    def path(self, number: int) -> KeptPath:
        """The friction path of a run."""
        if number not in self.kept:
            nodes = FAR_NODES if number < PROBES else KEPT_NODES if number < KEPT_PATHS else 0
            self.kept[number] = self.own.kept_path([*self.seed, number], nodes)
        return self.kept[number]

    def periods(self, machine: Machine) -> float:
        """Natural periods of a run after its first departure."""
        return min(max(time_scales(machine).values()), LONGEST_RUN) if self.duration is None else self.duration

    def one(self, machine: Machine, number: int, periods: float, from_sliding: bool) -> Run:
        """A run up to its time in the second half; times are spread evenly, so that their mean is the share of it."""
        time = 0.5 * periods * (1.0 + (number + 0.5) / self.count)
        path, spacing = self.path(number), self.own.paths.spacing
        motion, first, states = run_until_known(machine, path, spacing, time, from_sliding)
        nodes = float(motion.slipped_distance.max(initial=0.0)) / spacing
        self._count(motion.steps + STEPS_PER_NODE * nodes)
        return Run(motion, first, states, first + time)

    def _count(self, steps: float) -> None:
        """Raise ConvergenceError where runs of no given duration take over MOST_STEPS, or will by the first one."""
        self.steps.append(steps)
        expected = max(sum(self.steps), 2 * self.count * self.steps[0])
        if self.duration is None and expected > MOST_STEPS:
            raise ConvergenceError(
                f"the runs of an answer take {expected:.2g} steps of slip or more, {STEP_S * expected / 60.0:.2g} "
                "minutes: give their duration, fewer runs, a longer correlation length or a lower normal force",
                scene_keys="answer.duration_periods, answer.realisations, oscillator.normal_force_n",
                residual=1.0,
                work=int(sum(self.steps)),
            )

    def of_value(self, name: str, value: float, numbers: range) -> np.ndarray:
        """(runs,) whether the mass stick-slips, from rest on the belt, with one parameter at another value."""
        machine = self.own.changed({name: value})
        periods = self.periods(machine)
        return np.array([self.one(machine, number, periods, False).cycles for number in numbers], dtype=bool)

    def drawn(
        self, machine: Machine, path: FrictionPath, periods: float, start: float | tuple[float, float] = 0.0
    ) -> Trajectory:
        """The motion of a machine, sampled as finely as so long a run allows. start : as in `trajectory`"""
        options = replace(machine.options, samples_per_period=min(SAMPLES, max(int(MOST_SAMPLES / periods), 1)))
        return trajectory(machine.oscillator, machine.law, path, self.own.paths.spacing, periods, options, start)

    def cycles_of(self, number: int, run: Run) -> np.ndarray:
        """The whole cycles of a run of the own machine, as `whole_cycles` gives them."""
        if run.motion.cycles < 2:
            return np.empty((0, 2))
        return whole_cycles(self.drawn(self.own, self.path(number), run.motion.duration / (2 * np.pi)), run.states)

    def curves(self, runs: Sequence[Run]) -> dict[str, Curve]:
        """A few periods of the own machine, with scatter and without.

        With scatter they are those of the first run that shows what most runs do.
        """
        usual = np.mean([run.cycles for run in runs]) > 0.5
        number = next(i for i, run in enumerate(runs) if run.cycles == usual)
        periods = runs[number].motion.duration / (2 * np.pi)
        omega = self.own.oscillator.natural_frequency_rad_per_s
        return {
            name: curve(self.drawn(self.own, path, periods), omega)
            for name, path in (("with_scatter", self.path(number)), ("without_scatter", None))
        }


def whole_cycles(drawn: Trajectory, states: States) -> np.ndarray:
    """(cycles, 2) half the distance of the extremes of the displacement [m] and duration [tau] of each cycle.

    A cycle lasts from one reattachment after backward motion to the next, without steady sliding between.
    """
    ends = drawn.motion.time[drawn.motion.backwards]
    slid = 2 * np.pi * states.sliding[:, 0]
    rows = []
    for start, finish in pairwise(ends):
        if not np.any((start <= slid) & (slid < finish)):
            first, last = np.searchsorted(drawn.time, (start, finish))
            rows.append((0.5 * float(np.ptp(drawn.position[first:last])), finish - start))
    return np.reshape(rows, (-1, 2))


def curve(drawn: Trajectory, omega: float) -> Curve:
    """The last SHOWN cycles of a motion, from one reattachment after backward motion to another.

    omega : [rad/s]

    Without two cycles in the last half of the motion its last SHOWN natural periods.
    """
    ends = drawn.motion.time[drawn.motion.backwards]
    ends = ends[ends > 0.5 * drawn.motion.duration][-SHOWN - 1 :]
    cycles = max(ends.size - 1, 0)
    last = drawn.motion.duration
    start, finish = (ends[0], ends[-1]) if cycles else (max(last - 2 * np.pi * SHOWN, 0.0), last)
    first, end = np.searchsorted(drawn.time, (start, finish))
    time, x, u = drawn.time[first:end], drawn.position[first:end], drawn.velocity[first:end]
    kept = np.ones(time.size, dtype=bool)
    kept[1:-1] = np.any([np.abs(np.diff(y, 2)) > 2 * STRAIGHT * np.ptp(y) for y in (x, u)], axis=0)
    columns = ((time - start) / omega, x, omega * u)
    shown = [tuple(float(f"{value:.{DIGITS}g}") for value in column[kept]) for column in columns]
    return Curve(shown[0], shown[1], shown[2], cycles)
