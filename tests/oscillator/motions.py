"""What tests of motions share: the oscillator of the study, Coulomb friction of a given drop, steps of equal length.

Rare failures of stick-slip by adaptive multilevel splitting, an independent check of the theory of durations.

A slip of stick-slip fails where it lasts longer than any slip of the cycle. Many slips are run. Those that came
least far towards failure are replaced by copies of others, again and again. A copy follows the other up to where that
first came further, and has friction of its own from there on (F. Cérou & A. Guyader, Stoch. Anal. Appl. 25 (2007) 417).
The product of the shares that were kept estimates the chance of failure without bias, for any measure of how far a
slip has come. Here that is the amplitude about steady sliding that it lacks at its phase, against the slip without
scatter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from roughslip.friction.pad_friction import Friction
from roughslip.friction.recursion import _advance
from roughslip.oscillator.equation import Oscillator, slip_state
from roughslip.oscillator.event_loop import REATTACHMENT
from roughslip.oscillator.friction_laws.coulomb import CoulombLaw
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.limits import departure_point, equilibrium, slip_loop
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.motion import MotionOptions, trajectory
from roughslip.oscillator.path import piece_at
from roughslip.oscillator.runge_kutta import step
from roughslip.oscillator.states import longest_slip, slip_phases

STUDY = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
LAW = StribeckLaw(0.3)
NEARLY_GAUSSIAN = (200.0, 200.0)
F, V = STUDY.F, STUDY.V


def machine(deviation=0.03, length=3e-4, belt=STUDY, law=LAW, shapes=NEARLY_GAUSSIAN, **changes):
    """A machine whose friction scatters so. changes : of its parameters"""
    return Machine(belt, law, Friction(0.3, deviation, length, shapes)).changed(changes)


def ends(motion):
    """Time, position and slipped distance of every reattachment."""
    keep = motion.kind == REATTACHMENT
    return np.column_stack((motion.time[keep], motion.position[keep], motion.slipped_distance[keep]))


def coulomb(ratio: float, kinetic: float = 0.3) -> CoulombLaw:
    """Friction that drops by r = F (static - kinetic) / V on leaving stick."""
    return CoulombLaw(kinetic, kinetic + ratio * V / F)


def equal_steps(p, path, x, u, duration, steps, sigma=1.0):
    """The state after so many equal steps of slip from tau = 0, each on the piece of the path at its middle."""
    h = duration / steps
    y = slip_state(0.0, x, u, 0.0, sigma, piece_at(path, 0.0), p)
    for _ in range(steps):
        piece = piece_at(path, y.s + 0.5 * h * sigma * (p.V - y.u))
        y = slip_state(y.tau, y.x, y.u, y.s, sigma, piece, p)
        y, _ = step(y, h, sigma, piece, p)
    return y


KILLED = 0.1  # share of the slips that is replaced at a time
AHEAD = 3  # nodes beyond a place that friction there depends on
OPTIONS = MotionOptions(tolerance=1e-7, samples_per_period=50)


@dataclass(frozen=True)
class Slip:
    """The second slip on a friction path, after one that sticks.

    noise : (nodes,) normal numbers from which the path is made
    fails : whether it lasts longer than any slip of the cycle
    lack, place : (samples,) the largest lack of amplitude until each sample; slipped distance there, in those numbers
    cycle : [natural periods] from the departure before to its own
    """

    noise: np.ndarray
    fails: bool
    lack: np.ndarray
    place: np.ndarray
    cycle: float

    @property
    def score(self) -> float:
        """How far it came."""
        return math.inf if self.fails else float(self.lack[-1])


class Slips:
    """Slips of an oscillator on paths of a friction process."""

    def __init__(self, made: Machine) -> None:
        self.oscillator, self.law, self.paths = made.oscillator, made.law, made.paths
        oscillator, law, spacing = made.oscillator, made.law, self.paths.spacing
        self.spacing = spacing
        self.longest, self.rest = longest_slip(oscillator, law), equilibrium(oscillator, law)
        cycle = slip_loop(oscillator, law).cycle
        self.before = departure_point(oscillator, law) - 0.2 * oscillator.V
        self.periods = 3.0 * cycle.period / (2 * math.pi) + self.longest + 2.0
        self.nodes = math.ceil(2 * math.pi * 2.5 * oscillator.V * self.periods / spacing)
        still = trajectory(oscillator, law, None, 0.0, 2.0, OPTIONS, self.before)
        begin, end = slip_phases(still.motion)[0][0]
        within = (still.time > 2 * math.pi * begin) & (still.time < 2 * math.pi * end)
        self.phase, self.radius = self._polar(still.position[within], still.velocity[within])

    def _polar(self, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Phase and amplitude about steady sliding."""
        y = (x - self.rest) / self.oscillator.V
        w = u / self.oscillator.V
        return np.unwrap(np.arctan2(-w, y)), np.hypot(y, w)

    def draw(self, rng: np.random.Generator, kept: np.ndarray) -> Slip | None:
        """The slip on a path that begins with some normal numbers; None where the slip before does not stick."""
        count = self.paths.decay.size
        noise = np.append(kept, rng.standard_normal(count + self.nodes - kept.size))
        path, table = noise[count:].copy(), self.paths.translation
        _advance(self.paths.start @ noise[:count], path, self.paths.decay, self.paths.gain, table.normal, table.values)
        run = trajectory(self.oscillator, self.law, path, self.spacing, self.periods, OPTIONS, self.before)
        slips, cut_off = slip_phases(run.motion)
        lasting = np.diff(slips)[:, 0]
        if lasting[0] > self.longest:
            return None
        begin, end = slips[1]
        fails = lasting[1] > self.longest
        assert fails or len(slips) > 2 or not cut_off, (slips, self.periods)
        within = (run.time > 2 * math.pi * begin) & (run.time < 2 * math.pi * end)
        x, u = run.position[within], run.velocity[within]
        phase, radius = self._polar(x, u)
        phase += 2 * math.pi * round((self.phase[0] - phase[0]) / (2 * math.pi))
        lack = np.maximum.accumulate(1.0 - radius / np.interp(phase, self.phase, self.radius))
        slipped = self.oscillator.V * run.time[within] - (x - self.before)
        return Slip(noise, bool(fails), lack, count + slipped / self.spacing, float(slips[1, 0] - slips[0, 0]))


def lifetime(slips: Slips, number: int, rng: np.random.Generator) -> float:
    """[natural periods] the mean cycle over the chance that a slip fails. number : of slips that are kept"""
    some = [one for one in (slips.draw(rng, np.empty(0)) for _ in range(number)) if one is not None]
    cycle = float(np.mean([one.cycle for one in some]))
    chance = 1.0
    while True:
        scores = np.array([one.score for one in some])
        if np.mean(np.isinf(scores)) > KILLED:
            return cycle / (chance * float(np.mean(np.isinf(scores))))
        level = np.sort(scores)[int(KILLED * len(some)) - 1]
        alive = np.flatnonzero(scores > level)
        chance *= alive.size / len(some)
        for i in np.flatnonzero(scores <= level):
            parent = some[rng.choice(alive)]
            first = int(np.argmax(parent.lack > level))
            some[i] = slips.draw(rng, parent.noise[: int(parent.place[first]) + AHEAD])
