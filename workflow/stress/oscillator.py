"""Campaign of the oscillator: random motions, each judged by arithmetic of the judge's own.

Damping, belts, loads, friction laws, excitations and friction paths go far beyond any machine's.

Slip: from each sample to the next by the classical method of order four in small steps, all stretches at once. They are
so short that no error grows, so that a defect is the motion's own. Stick: the force is within its limits throughout,
and at one of them where the mass departs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import repeat

import numpy as np
import scipy

from roughslip.errors import ConvergenceError, RoughslipError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.event_loop import CROSSING, DEPARTURE, REATTACHMENT
from roughslip.oscillator.friction_law import FrictionLaw, friction
from roughslip.oscillator.friction_laws.coulomb import CoulombLaw
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.friction_laws.table import TableLaw
from roughslip.oscillator.laws import LAWS
from roughslip.oscillator.motion import MotionOptions, Trajectory, trajectory
from roughslip.oscillator.path import INTERPOLATIONS
from roughslip.oscillator.runge_kutta import PAIRS
from workflow.stress.runner import Problem, Verdict, choose, has_advice, log_uniform

KINDS = ("stribeck", "steep", "coulomb", "level", "table")
KINDS += tuple(name for name in sorted(LAWS) if name not in KINDS)
EXCITATIONS = ("none", "weak", "resonance", "fast", "strong")
FOLLOWS = ("slip", "belt", "time")
STARTS = ("rest", "limit", "just-inside", "just-beyond", "far", "steady")
PATHS = {"none": 0.0, "weak": 0.05, "strong": 0.8, "negative": 3.0}  # size over the static coefficient
TOLERANCES = (1e-6, 1e-4, 1e-9)
BLOCK = 256  # nodes that a path repeats
PERIODS = 12.0
SAMPLES = 126  # a period: a stretch is 0.05 of tau

SUBSTEPS = (10, 100, 1000)  # of a stretch; more where fewer leave more than SURE of the defect allowed
SURE = 0.01
ALLOWED = 1000.0  # tolerances per unit of tau
KINKED = 5.0  # times ALLOWED where friction has kinks, which the smooth dense output cannot follow
DENSE = 1e-7  # of the scale, the error of the dense output between the integrator's steps
AT_LIMIT = 1e-6  # of the scale: stick goes on for 1e-7 of tau where a slip would be too short to count
LOOKS = 200  # times in a stick phase at which the judge evaluates the force


@dataclass(frozen=True)
class MotionProblem:
    """A motion to compute, and its equation in the judge's own form.

    oscillator, law : of the motion
    nodes : (BLOCK,) [-] that the path repeats; empty without a path
    spacing : [m], or [s] where friction follows time
    start : [m] X at the beginning
    options : of the motion
    kinked : whether friction bends where the dense output does not
    """

    oscillator: Oscillator
    law: FrictionLaw
    nodes: np.ndarray
    spacing: float
    start: float
    options: MotionOptions
    kinked: bool

    @property
    def may_turn_negative(self) -> bool:
        """Whether the least sum of law and path is below zero, with the overshoot of splines."""
        lowest = self.nodes.min(initial=0.0) - 0.25 * np.ptp(self.nodes) if self.nodes.size else 0.0
        return self.law.parameters().least + lowest < 0.0

    def solve(self) -> Trajectory:
        """Return the motion at SAMPLES times a period."""
        path = repeat(self.nodes) if self.nodes.size else None
        options = replace(self.options, samples_per_period=SAMPLES)
        return trajectory(self.oscillator, self.law, path, self.spacing, PERIODS, options, self.start)

    def is_answer(self, error: RoughslipError) -> bool:
        """Whether an error answers it: the step limit with advice."""
        return isinstance(error, ConvergenceError) and has_advice(error)

    @property
    def scale(self) -> float:
        """[m] scale of X and X', from friction and excitation."""
        return self.oscillator.F + self.oscillator.q

    def scatter(self, tau: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return mu_S, by the four nodes around each place."""
        oscillator = self.oscillator
        if not self.nodes.size:
            return np.zeros_like(tau)
        z = {"slip": s, "belt": oscillator.V * tau, "time": tau / oscillator.natural_frequency_rad_per_s}
        place = z[self.options.friction_follows] / self.spacing
        k = np.floor(place).astype(np.int64)
        t = place - k
        before, here, there, behind = (self.nodes[(k + i) % self.nodes.size] for i in (-1, 0, 1, 2))
        if self.options.interpolation == "linear":
            return here + t * (there - here)
        out = np.where(k > 0, 0.5 * (there - before), there - here)
        into = 0.5 * (behind - here)
        weights = (1 - t) ** 2 * (1 + 2 * t), t**2 * (3 - 2 * t), t * (1 - t) ** 2, -(t**2) * (1 - t)
        return sum(w * v for w, v in zip(weights, (here, there, out, into), strict=True))

    def drive(self, tau: np.ndarray) -> np.ndarray:
        oscillator = self.oscillator
        return oscillator.q * np.cos(oscillator.r * tau)

    def stick_force(self, tau: np.ndarray, x: np.ndarray) -> np.ndarray:
        oscillator = self.oscillator
        return x + 2 * oscillator.damping_ratio * oscillator.V - self.drive(tau)

    def limit(self, tau: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return the largest force [m] of stick."""
        law, scatter, options = self.law, self.scatter(tau, s), self.options
        kinetic = float(law.mu(0.0)) + scatter
        limit = law.static + scatter if options.stochastic_static_limit else np.maximum(law.static, kinetic)
        return self.oscillator.F * np.maximum(limit, 0.0)

    @cached_property
    def friction(self) -> Callable[[np.ndarray], np.ndarray]:
        """mu_D at speeds, in numpy."""
        law, parameters = self.law, self.law.parameters()
        if not isinstance(law, TableLaw):
            return lambda speed: friction(speed, parameters)
        knots, values = law.speeds_m_per_s, law.values
        if law.interpolation == "linear":
            return lambda speed: np.interp(speed, knots, values)
        cubic = scipy.interpolate.PchipInterpolator(knots, values)
        return lambda speed: cubic(np.minimum(speed, knots[-1]))

    def slip(self, start: np.ndarray, h: np.ndarray, steps: int) -> tuple[np.ndarray, np.ndarray]:
        """Return X and X' after slips of h each in so many steps, from start : (tau, X, X', s, sign of v_rel)."""
        oscillator = self.oscillator
        omega, V, D = oscillator.natural_frequency_rad_per_s, oscillator.V, oscillator.damping_ratio
        first, place, u, s, sides = start

        def acceleration(tau: np.ndarray, x: np.ndarray, u: np.ndarray) -> np.ndarray:
            slipped = s + sides * (V * (tau - first) - (x - place))
            mu = np.maximum(self.friction(np.abs(omega * (V - u))) + self.scatter(tau, slipped), 0.0)
            return sides * oscillator.F * mu - 2 * D * u - x + self.drive(tau)

        d, x = h / steps, place
        for step in range(steps):
            tau = first + step * d
            a1 = acceleration(tau, x, u)
            u2 = u + d / 2 * a1
            a2 = acceleration(tau + d / 2, x + d / 2 * u, u2)
            u3 = u + d / 2 * a2
            a3 = acceleration(tau + d / 2, x + d / 2 * u2, u3)
            u4 = u + d * a3
            a4 = acceleration(tau + d, x + d * u3, u4)
            x = x + d / 6 * (u + 2 * u2 + 2 * u3 + u4)
            u = u + d / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        return x, u

    def defects(self, start: np.ndarray, h: np.ndarray, end: np.ndarray, allowed: float) -> np.ndarray:
        """Return the defect of slips that end at (X, X'), per unit of tau and of the scale.

        Few steps accept a slip only where, with twice the error of the judge, they leave far less than is allowed. All
        others take more steps, from whose defect that error is subtracted.
        """
        unit = h * (self.scale + np.max(np.abs(start[1:3]), axis=0) + self.oscillator.V)
        defect, open_ = np.zeros(h.size), np.arange(h.size)
        for steps in SUBSTEPS:
            with np.errstate(over="ignore", invalid="ignore"):  # steps that are too few may end in no number
                coarse, fine = (np.stack(self.slip(start[:, open_], h[open_], n)) for n in (steps, 2 * steps))
            off, own = np.abs(fine - end[:, open_]) / unit[open_], np.abs(fine - coarse) / unit[open_]
            at_most = np.max(off + 2 * own, axis=0)
            sure = at_most <= SURE * allowed
            defect[open_] = np.where(sure, at_most, np.max(np.maximum(off - 2 * own, 0.0), axis=0))
            open_ = open_[~sure]
            if not open_.size:
                break
        return defect

    def judge(self, drawn: Trajectory) -> Verdict:
        """Return the conditions that a motion breaks; the residual is the worst stretch of slip, per unit of tau."""
        broken: list[str] = []
        motion = drawn.motion
        changes = motion.kind[motion.kind != CROSSING]
        if not np.array_equal(changes, np.where(np.arange(changes.size) % 2 == 0, DEPARTURE, REATTACHMENT)):
            broken.append("departures and reattachments do not alternate")
        slipped = motion.slipped_distance
        if np.any(np.diff(motion.time) < 0) or np.any(np.diff(slipped) < -4 * np.spacing(slipped[1:])):
            broken.append("time or slip runs back")
        if not (np.isfinite(drawn.position).all() and np.isfinite(drawn.velocity).all()):
            return Verdict(np.inf, (*broken, "samples are not finite"))
        residual, allowed = self.slips(drawn)
        if not residual <= allowed:
            broken.append(f"slip errs by {residual:.2e} per unit of tau, more than {allowed:.2e}")
        broken += self.sticks(drawn)
        return Verdict(residual, tuple(broken))

    def slips(self, drawn: Trajectory) -> tuple[float, float]:
        """Return the largest defect of a stretch of slip, and the largest allowed one."""
        motion, V = drawn.motion, self.oscillator.V
        allowed = ALLOWED * self.options.tolerance + DENSE / np.diff(drawn.time[:2])[0]
        allowed *= KINKED if self.kinked or self.may_turn_negative else 1.0
        last = np.searchsorted(motion.time, drawn.time, side="right") - 1
        together = np.flatnonzero((last[1:] == last[:-1]) & (last[1:] >= 0))
        together = together[motion.kind[last[together]] != REATTACHMENT]
        if not together.size:
            return 0.0, float(allowed)
        event = last[together]
        sides = np.sign(self.stick_force(motion.time, motion.position))[event]
        tau, x, u = (row[together] for row in (drawn.time, drawn.position, drawn.velocity))
        s = motion.slipped_distance[event] + sides * (V * (tau - motion.time[event]) - (x - motion.position[event]))
        end = np.stack([drawn.position[together + 1], drawn.velocity[together + 1]])
        defects = self.defects(np.stack([tau, x, u, s, sides]), drawn.time[together + 1] - tau, end, allowed)
        return float(np.max(defects)), float(allowed)

    def sticks(self, drawn: Trajectory) -> list[str]:
        """Return what is wrong with stick phases, from the start or a reattachment to the next departure or the end."""
        motion, V = drawn.motion, self.oscillator.V
        keep = motion.kind != CROSSING
        kind, time, place, slipped = (
            row[keep] for row in (motion.kind, motion.time, motion.position, motion.slipped_distance)
        )
        starts = [(0.0, self.start, 0.0)] if not (kind.size and kind[0] == DEPARTURE and time[0] == 0.0) else []
        starts += [(time[k], place[k], slipped[k]) for k in np.flatnonzero(kind == REATTACHMENT)]
        departures = time[kind == DEPARTURE]
        broken = []
        for tau, x, s in starts:
            later = departures[departures >= tau]
            end = later[0] if later.size else motion.duration
            looks = tau + (end - tau) * np.linspace(0.0, 1.0, LOOKS)
            force = np.abs(self.stick_force(looks, x + V * (looks - tau)))
            limit = self.limit(looks, np.full(LOOKS, s))
            slack = AT_LIMIT * (self.scale + V + np.abs(x))
            if np.any(force > limit + slack):
                broken.append(f"stick from tau = {tau:.6g} exceeds its limit by {np.max(force - limit):.2e} m")
            if later.size and force[-1] < limit[-1] - slack:
                broken.append(f"departure at tau = {end:.6g} lies {limit[-1] - force[-1]:.2e} m within the limit")
        return broken[:3]


def problem(seed: int, number: int) -> Problem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number])
    omega = log_uniform(generator, -1, 5)
    mass, load = log_uniform(generator, -3, 3), log_uniform(generator, -9, 9)
    natural = load / (mass * omega**2)  # F, the scale of X and X'
    belt = natural * log_uniform(generator, -6, 3) * float(generator.random() > 0.08)
    excitation, follows = choose(generator, EXCITATIONS), choose(generator, FOLLOWS)
    if belt == 0.0 and follows == "belt":
        follows = "time"
    size, ratio = _excitation(generator, excitation)
    oscillator = Oscillator(
        mass_kg=mass,
        natural_frequency_rad_per_s=omega,
        damping_ratio=float(choose(generator, (0.0, log_uniform(generator, -4, 0), generator.uniform(0, 5)))),
        belt_velocity_m_per_s=belt * omega,
        normal_force_n=load,
        excitation_force_n=size * load,
        excitation_frequency_rad_per_s=ratio * omega,
    )
    kind, scatter = choose(generator, KINDS), choose(generator, tuple(PATHS))
    law = _law(generator, kind, oscillator)
    per_cycle = log_uniform(generator, -3, 3)
    travel = 2 * math.pi * (1 / omega if follows == "time" else max(belt, 0.1 * natural if follows == "slip" else 0))
    start_kind, size_of_path = choose(generator, STARTS), PATHS[scatter] * law.static
    motion = MotionProblem(
        oscillator=oscillator,
        law=law,
        nodes=size_of_path * generator.uniform(-1, 1, BLOCK) if size_of_path > 0 else np.zeros(0),
        spacing=travel / per_cycle,
        start=_start(start_kind, oscillator, law),
        options=MotionOptions(
            tolerance=float(choose(generator, TOLERANCES, (0.6, 0.2, 0.2))),
            stochastic_static_limit=bool(generator.integers(2)),
            interpolation=choose(generator, INTERPOLATIONS),
            friction_follows=follows,
            integrator=choose(generator, tuple(PAIRS)),
        ),
        kinked=kind == "table",
    )
    case = {"tolerance": motion.options.tolerance, "law": kind, "excitation": excitation, "path": scatter}
    case |= {"begin": start_kind, "friction_follows": follows}
    return Problem(case, motion.solve, motion.judge, motion.is_answer)


def _excitation(generator: np.random.Generator, kind: str) -> tuple[float, float]:
    """Draw Q / N and Omega / omega."""
    match kind:
        case "none":
            return 0.0, 1.0
        case "weak":
            return log_uniform(generator, -8, -2), log_uniform(generator, -2, 1)
        case "resonance":
            return log_uniform(generator, -3, 1), 1.0
        case "fast":
            return log_uniform(generator, -3, 1), log_uniform(generator, 0, 1.5)
    return log_uniform(generator, 0, 2), log_uniform(generator, -2, 0.5)


def _law(generator: np.random.Generator, kind: str, oscillator: Oscillator) -> FrictionLaw:
    """Draw a friction law that bends at speeds of the faster of belt and mass."""
    speed = oscillator.natural_frequency_rad_per_s * max(oscillator.V, oscillator.F)
    static = log_uniform(generator, -2, 0.3)
    match kind:
        case "steep":
            decay = log_uniform(generator, 1, 3)
            return StribeckLaw(
                static * generator.random(), static, decay / speed, log_uniform(generator, -4, -1) / speed**2
            )
        case "level":
            return CoulombLaw(static, static)
    return LAWS[kind].example(generator, static, speed)


def _start(kind: str, oscillator: Oscillator, law: FrictionLaw) -> float:
    limit = oscillator.F * law.static - 2 * oscillator.damping_ratio * oscillator.V + oscillator.q
    return {
        "rest": 0.0,
        "limit": limit,
        "just-inside": limit - 1e-12 * oscillator.F,
        "just-beyond": limit + 1e-12 * oscillator.F,
        "far": 30.0 * oscillator.F,
        "steady": oscillator.F * float(law.mu(oscillator.belt_velocity_m_per_s)),
    }[kind]
