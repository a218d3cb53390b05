"""Stress campaign of the oscillator: random motions, each judged by arithmetic of the judge's own.

Slip: from each sample to the next by the classical method of order four in small steps, all stretches at once. They are
so short that no error grows, so that a defect is the motion's own. Stick: the force is within its limits throughout,
and at one of them where the mass departs.

`python -m workflow.stress.oscillator -j 2 --output results/stress/oscillator.json` runs the campaign; `--only 17` runs
one problem.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from roughslip.errors import ConvergenceError, ParameterError, RoughslipError
from roughslip.oscillator.event_loop import CROSSING, DEPARTURE, REATTACHMENT
from roughslip.oscillator.motion import Trajectory, trajectory
from workflow.evidence.rows import Row
from workflow.stress import runner
from workflow.stress.oscillator_problem import MotionProblem, random_problem
from workflow.stress.runner import Verdict, has_advice

STAGE = "oscillator"
PROBLEMS = 2000
SAMPLES = 126  # a period: a stretch is 0.05 of tau

SUBSTEPS = 100
ALLOWED = 1000.0  # tolerances per unit of tau
KINKED = 5.0  # times ALLOWED where friction has kinks, which the smooth dense output cannot follow
DENSE = 1e-7  # of the scale, the error of the dense output between the integrator's steps
AT_LIMIT = 1e-6  # of the scale: stick goes on for 1e-7 of tau where a slip would be too short to count
LOOKS = 200  # times in a stick phase at which the judge evaluates the force


def row_of(seed: int, number: int) -> Row:
    """Return the row of the problem of this number."""
    problem = random_problem(seed, number)
    answers = partial(is_answer, may_turn_negative=problem.may_turn_negative)
    return runner.problem_row(STAGE, runner.case_of(problem), partial(judged, problem), answers)


def judged(problem: MotionProblem) -> Verdict:
    """Compute the motion and judge it."""
    return judge(problem, drawn(problem))


def drawn(problem: MotionProblem) -> Trajectory:
    """Return the motion of a problem at SAMPLES times a period."""
    start, options = problem.start, problem.options
    return trajectory(
        problem.oscillator, problem.law, problem.path, problem.spacing, problem.periods, options, start, SAMPLES
    )


def is_answer(error: RoughslipError, may_turn_negative: bool) -> bool:
    """Whether an error answers a problem: the step limit with advice, or negative friction that must be refused."""
    if isinstance(error, ParameterError):
        return may_turn_negative and "negative" in str(error)
    return isinstance(error, ConvergenceError) and has_advice(error)


class Slide(NamedTuple):
    """Arrays of equal length: tau, X, X', s and the sign of v_rel."""

    tau: np.ndarray
    x: np.ndarray
    u: np.ndarray
    s: np.ndarray
    sigma: np.ndarray


@dataclass(frozen=True)
class Judge:
    """The equation of motion of a problem, in the judge's own form."""

    problem: MotionProblem

    @property
    def scale(self) -> float:
        """[m] scale of X and X', from friction and excitation."""
        oscillator = self.problem.oscillator
        return oscillator.F + oscillator.q

    def scatter(self, tau: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return mu_S, by the four nodes around each place."""
        problem, oscillator = self.problem, self.problem.oscillator
        if not problem.nodes.size:
            return np.zeros_like(tau)
        z = {"slip": s, "belt": oscillator.V * tau, "time": tau / oscillator.natural_frequency_rad_per_s}
        place = z[problem.options.friction_follows] / problem.spacing
        k = np.floor(place).astype(np.int64)
        t = place - k
        before, here, there, behind = (problem.nodes[(k + i) % problem.nodes.size] for i in (-1, 0, 1, 2))
        if problem.options.interpolation == "linear":
            return here + t * (there - here)
        out = np.where(k > 0, 0.5 * (there - before), there - here)
        into = 0.5 * (behind - here)
        weights = (1 - t) ** 2 * (1 + 2 * t), t**2 * (3 - 2 * t), t * (1 - t) ** 2, -(t**2) * (1 - t)
        return sum(w * v for w, v in zip(weights, (here, there, out, into), strict=True))

    def drive(self, tau: np.ndarray) -> np.ndarray:
        oscillator = self.problem.oscillator
        return oscillator.q * np.cos(oscillator.r * tau)

    def stick_force(self, tau: np.ndarray, x: np.ndarray) -> np.ndarray:
        oscillator = self.problem.oscillator
        return x + 2 * oscillator.damping_ratio * oscillator.V - self.drive(tau)

    def limit(self, tau: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return the largest force [m] of stick."""
        law, scatter, options = self.problem.law, self.scatter(tau, s), self.problem.options
        kinetic = float(law.mu(0.0)) + scatter
        limit = law.static + scatter if options.stochastic_static_limit else np.maximum(law.static, kinetic)
        return self.problem.oscillator.F * np.maximum(limit, 0.0)

    def slip(self, y: Slide, h: np.ndarray, steps: int) -> tuple[np.ndarray, np.ndarray]:
        """Return X and X' after slips of h each."""
        oscillator, law = self.problem.oscillator, self.problem.law
        omega, V, D = oscillator.natural_frequency_rad_per_s, oscillator.V, oscillator.damping_ratio

        def acceleration(tau: np.ndarray, x: np.ndarray, u: np.ndarray) -> np.ndarray:
            s = y.s + y.sigma * (V * (tau - y.tau) - (x - y.x))
            mu = np.maximum(law.mu(omega * (V - u)) + self.scatter(tau, s), 0.0)
            return y.sigma * oscillator.F * mu - 2 * D * u - x + self.drive(tau)

        d = h / steps
        tau, x, u = y.tau, y.x, y.u
        for step in range(steps):
            tau = y.tau + step * d
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


def judge(problem: MotionProblem, drawn: Trajectory) -> Verdict:
    """Return the conditions that a motion breaks; the residual is the worst stretch of slip, per unit of tau."""
    by = Judge(problem)
    broken: list[str] = []
    motion = drawn.motion
    changes = motion.kind[motion.kind != CROSSING]
    if not np.array_equal(changes, np.where(np.arange(changes.size) % 2 == 0, DEPARTURE, REATTACHMENT)):
        broken.append("departures and reattachments do not alternate")
    if np.any(np.diff(motion.time) < 0) or np.any(np.diff(motion.slipped_distance) < 0):
        broken.append("time or slip runs back")
    if not (np.isfinite(drawn.position).all() and np.isfinite(drawn.velocity).all()):
        return Verdict(np.inf, (*broken, "samples are not finite"))
    residual, allowed = _slips(by, drawn)
    if residual > allowed:
        broken.append(f"slip errs by {residual:.2e} per unit of tau, more than {allowed:.2e}")
    broken += _sticks(by, drawn)
    return Verdict(residual, tuple(broken))


def _slips(by: Judge, drawn: Trajectory) -> tuple[float, float]:
    """Return the largest defect of a stretch of slip, and the largest allowed one."""
    motion, V = drawn.motion, by.problem.oscillator.V
    allowed = ALLOWED * by.problem.options.tolerance + DENSE / np.diff(drawn.time[:2])[0]
    allowed *= KINKED if by.problem.labels["law"] == "table" or by.problem.may_turn_negative else 1.0
    last = np.searchsorted(motion.time, drawn.time, side="right") - 1
    together = np.flatnonzero((last[1:] == last[:-1]) & (last[1:] >= 0))
    together = together[motion.kind[last[together]] != REATTACHMENT]
    if not together.size:
        return 0.0, float(allowed)
    event = last[together]
    sides = np.sign(by.stick_force(motion.time, motion.position))[event]
    tau, x, u = (row[together] for row in (drawn.time, drawn.position, drawn.velocity))
    s = motion.slipped_distance[event] + sides * (V * (tau - motion.time[event]) - (x - motion.position[event]))
    h = drawn.time[together + 1] - tau
    found = [by.slip(Slide(tau, x, u, s, sides), h, steps) for steps in (SUBSTEPS, 2 * SUBSTEPS)]
    after = drawn.position[together + 1], drawn.velocity[together + 1]
    scale = by.scale + np.maximum(np.abs(x), np.abs(u)) + V
    defect = np.zeros(together.size)
    for mine, finer, theirs in zip(*found, after, strict=True):
        own = np.abs(finer - mine)  # the error of the judge
        defect = np.maximum(defect, np.maximum(np.abs(finer - theirs) - 2 * own, 0.0))
    return float(np.max(defect / (h * scale))), float(allowed)


def _sticks(by: Judge, drawn: Trajectory) -> list[str]:
    """Return what is wrong with stick phases, from the start or a reattachment to the next departure or the end."""
    motion, V = drawn.motion, by.problem.oscillator.V
    keep = motion.kind != CROSSING
    kind, time, place, slipped = (
        row[keep] for row in (motion.kind, motion.time, motion.position, motion.slipped_distance)
    )
    starts = [(0.0, by.problem.start, 0.0)] if not (kind.size and kind[0] == DEPARTURE and time[0] == 0.0) else []
    starts += [(time[k], place[k], slipped[k]) for k in np.flatnonzero(kind == REATTACHMENT)]
    departures = time[kind == DEPARTURE]
    broken = []
    for tau, x, s in starts:
        later = departures[departures >= tau]
        end = later[0] if later.size else motion.duration
        looks = tau + (end - tau) * np.linspace(0.0, 1.0, LOOKS)
        force = np.abs(by.stick_force(looks, x + V * (looks - tau)))
        limit = by.limit(looks, np.full(LOOKS, s))
        slack = AT_LIMIT * (by.scale + V + np.abs(x))
        if np.any(force > limit + slack):
            broken.append(f"stick from tau = {tau:.6g} exceeds its limit by {np.max(force - limit):.2e} m")
        if later.size and force[-1] < limit[-1] - slack:
            broken.append(f"departure at tau = {end:.6g} lies {limit[-1] - force[-1]:.2e} m within the limit")
    return broken[:3]


if __name__ == "__main__":
    sys.exit(runner.command(__doc__, STAGE, row_of, PROBLEMS))
