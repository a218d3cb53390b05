"""Oscillator: random motions, each judged by arithmetic of the judge's own.

Damping, belts, loads, friction laws, excitations and friction paths go far beyond any machine's.

Slip: from each sample to the next by the classical method of order four in small steps, all stretches at once. They are
so short that no error grows, so that a defect is the motion's own. Stick: the force is within its limits throughout,
and at one of them where the mass departs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import repeat

import numpy as np
from scipy.interpolate import PchipInterpolator

from roughslip.errors import ConvergenceError
from roughslip.oscillator.equation import SCATTERS, Oscillator
from roughslip.oscillator.event_loop import CROSSING, DEPARTURE, REATTACHMENT
from roughslip.oscillator.laws import CoulombLaw, FrictionLaw, StribeckLaw, friction
from roughslip.oscillator.motion import MotionOptions, Trajectory, trajectory
from roughslip.oscillator.table_law import TableLaw
from tests.properties.campaign import Trial, choose, log_uniform

KINDS = ("stribeck", "steep", "coulomb", "level", "table")
# Ranges of the powers of ten of Q / N and of Omega / omega.
EXCITATIONS = {"none": (), "weak": (-8, -2, -2, 1), "resonance": (-3, 1), "fast": (-3, 1, 0, 1.5)}
EXCITATIONS |= {"strong": (0, 2, -2, 0.5)}
STARTS = ("rest", "limit", "just-inside", "just-beyond", "far", "steady")
PATHS = {"none": 0.0, "weak": 0.05, "strong": 0.8, "negative": 3.0}  # size over the static coefficient
TOLERANCES, TOLERANCE_SHARES = (1e-6, 1e-4, 1e-9), (0.6, 0.2, 0.2)
BLOCK = 256  # nodes that a path repeats
PERIODS, SAMPLES = 12.0, 126  # natural periods, and samples of one: a stretch is 0.05 of tau

SUBSTEPS = (10, 100, 1000)  # of a stretch; more where fewer leave more than SURE of the defect allowed
SURE = 0.01
ALLOWED = 1000.0  # tolerances per unit of tau
KINKED = 5.0  # times ALLOWED where friction has kinks, which the smooth dense output cannot follow
DENSE = 1e-7  # of the scale, the error of the dense output between the integrator's steps
AT_LIMIT = 1e-6  # of the scale: stick goes on for 1e-7 of tau where a slip would be too short to count
LOOKS = 200  # times in a stick phase at which the judge evaluates the force


@dataclass(frozen=True)
class Equation:
    """The equation of a motion in the judge's own form. nodes : (BLOCK,) that a path repeats, empty without one"""

    oscillator: Oscillator
    law: FrictionLaw
    nodes: np.ndarray
    spacing: float
    options: MotionOptions

    @property
    def scale(self) -> float:
        """[m] scale of X and X', from friction and excitation."""
        return self.oscillator.F + self.oscillator.q

    def scatter(self, s: np.ndarray) -> np.ndarray:
        """Return mu_S, by the four nodes around each place."""
        if not self.nodes.size:
            return np.zeros_like(s)
        place = s / self.spacing
        k = np.floor(place).astype(np.int64)
        t = place - k
        before, here, there, behind = (self.nodes[(k + i) % BLOCK] for i in (-1, 0, 1, 2))
        out, into = np.where(k > 0, 0.5 * (there - before), there - here), 0.5 * (behind - here)
        rising = t**2 * (3 - 2 * t)
        return here + rising * (there - here) + t * (1 - t) ** 2 * out - t**2 * (1 - t) * into

    def gain(self, mean: float | np.ndarray) -> float | np.ndarray:
        """Return what scatter changes friction by, where that is `mean` without."""
        return mean if self.options.scatter == "multiplicative" else 1.0

    def kinetic(self, speed: np.ndarray) -> np.ndarray:
        """Return mu_D; that of a table by numpy and scipy."""
        if not isinstance(self.law, TableLaw):
            return friction(speed, self.law.parameters())
        knots, values = self.law.speeds_m_per_s, self.law.values
        return PchipInterpolator(knots, values)(np.minimum(speed, knots[-1]))

    def drive(self, tau: np.ndarray) -> np.ndarray:
        """Return the excitation [m]."""
        return self.oscillator.q * np.cos(self.oscillator.r * tau)

    def stick_force(self, tau: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return the force [m] that friction holds."""
        return x + 2 * self.oscillator.damping_ratio * self.oscillator.V - self.drive(tau)

    def limit(self, s: np.ndarray) -> np.ndarray:
        """Return the largest force [m] of stick."""
        static = self.law.static
        return self.oscillator.F * np.maximum(static + self.gain(static) * self.scatter(s), 0.0)

    def slip(self, start: np.ndarray, h: np.ndarray, steps: int) -> np.ndarray:
        """Return X and X' after slips of h each in so many steps, from start : (tau, X, X', s, sign of v_rel)."""
        first, place, _, s, sides = start
        F, V, D = self.oscillator.F, self.oscillator.V, self.oscillator.damping_ratio
        omega = self.oscillator.natural_frequency_rad_per_s

        def rate(tau: np.ndarray, y: np.ndarray) -> np.ndarray:
            x, u = y
            slipped = s + sides * (V * (tau - first) - (x - place))
            mean = self.kinetic(np.abs(omega * (V - u)))
            mu = np.maximum(mean + self.gain(mean) * self.scatter(slipped), 0.0)
            return np.stack([u, sides * F * mu - 2 * D * u - x + self.drive(tau)])

        d, y = h / steps, start[1:3]
        for step in range(steps):
            tau = first + step * d
            k1 = rate(tau, y)
            k2 = rate(tau + d / 2, y + d / 2 * k1)
            k3 = rate(tau + d / 2, y + d / 2 * k2)
            k4 = rate(tau + d, y + d * k3)
            y = y + d / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return y

    def defects(self, start: np.ndarray, h: np.ndarray, end: np.ndarray, allowed: float) -> np.ndarray:
        """Return the defect of slips that end at (X, X'), per unit of tau and of the scale.

        Few steps accept a slip only where, with twice the error of the judge, they leave far less than is allowed. All
        others take more steps, from whose defect that error is subtracted.
        """
        unit = h * (self.scale + np.max(np.abs(start[1:3]), axis=0) + self.oscillator.V)
        defect, open_ = np.zeros(h.size), np.arange(h.size)
        for steps in SUBSTEPS:
            with np.errstate(over="ignore", invalid="ignore"):  # steps that are too few may end in no number
                coarse, fine = (self.slip(start[:, open_], h[open_], n) for n in (steps, 2 * steps))
            off, own = np.abs(fine - end[:, open_]) / unit[open_], np.abs(fine - coarse) / unit[open_]
            at_most = np.max(off + 2 * own, axis=0)
            sure = at_most <= SURE * allowed
            defect[open_] = np.where(sure, at_most, np.max(np.maximum(off - 2 * own, 0.0), axis=0))
            open_ = open_[~sure]
            if not open_.size:
                break
        return defect

    def judge_slips(self, trial: Trial, drawn: Trajectory) -> None:
        """Check the largest defect of a stretch of slip, per unit of tau."""
        motion, V = drawn.motion, self.oscillator.V
        kinked = isinstance(self.law, TableLaw) or motion.cuts > 0
        allowed = ALLOWED * self.options.tolerance + DENSE / np.diff(drawn.time[:2])[0]
        last = np.searchsorted(motion.time, drawn.time, side="right") - 1
        together = np.flatnonzero((last[1:] == last[:-1]) & (last[1:] >= 0))
        together = together[motion.kind[last[together]] != REATTACHMENT]
        if together.size:
            event = last[together]
            sides = np.sign(self.stick_force(motion.time, motion.position))[event]
            tau, x, u = (row[together] for row in (drawn.time, drawn.position, drawn.velocity))
            s = motion.slipped_distance[event] + sides * (V * (tau - motion.time[event]) - (x - motion.position[event]))
            end, h = np.stack([drawn.position, drawn.velocity])[:, together + 1], drawn.time[together + 1] - tau
            allowed *= KINKED if kinked else 1.0
            worst = np.max(self.defects(np.stack([tau, x, u, s, sides]), h, end, allowed))
            trial.check("slip errs per unit of tau", worst, allowed)

    def judge_sticks(self, trial: Trial, drawn: Trajectory, start: float) -> None:
        """Check stick phases, from the start or a reattachment to the next departure or the end."""
        motion, V = drawn.motion, self.oscillator.V
        rows = np.stack([motion.time, motion.position, motion.slipped_distance], axis=1)
        departures = motion.time[motion.kind == DEPARTURE]
        phases = [(0.0, start, 0.0)] if not (departures.size and departures[0] == 0.0) else []
        for tau, x, s in [*phases, *rows[motion.kind == REATTACHMENT]]:
            later = departures[departures >= tau]
            end = later[0] if later.size else motion.duration
            looks = tau + (end - tau) * np.linspace(0.0, 1.0, LOOKS)
            force = np.abs(self.stick_force(looks, x + V * (looks - tau)))
            limit = self.limit(np.full(LOOKS, s))
            slack = AT_LIMIT * (self.scale + V + np.abs(x))
            trial.check(f"stick from tau = {tau:.6g} over its limit", np.max((force - limit) / slack), 1.0)
            if later.size:
                trial.check(f"departure at tau = {end:.6g} below it", ((limit - force) / slack)[-1], 1.0)


def attempt(trial: Trial) -> None:
    """Draw, compute and judge a motion; the step limit with advice answers any."""
    rng = trial.rng
    omega = log_uniform(rng, -1, 5)
    mass, load = log_uniform(rng, -3, 3), log_uniform(rng, -9, 9)
    natural = load / (mass * omega**2)  # F, the scale of X and X'
    belt = natural * log_uniform(rng, -6, 3) * float(rng.random() > 0.08)
    excitation = choose(rng, tuple(EXCITATIONS))
    ranges = EXCITATIONS[excitation]
    size = log_uniform(rng, *ranges[:2]) if ranges else 0.0
    ratio = log_uniform(rng, *ranges[2:]) if ranges[2:] else 1.0
    damping = float(choose(rng, (0.0, log_uniform(rng, -4, 0), rng.uniform(0, 5))))
    oscillator = Oscillator(mass, omega, damping, belt * omega, load, size * load, ratio * omega)
    kind, scatter = choose(rng, KINDS), choose(rng, tuple(PATHS))
    law = draw_law(rng, kind, oscillator)
    per_cycle = log_uniform(rng, -3, 3)
    travel = 2 * math.pi * max(belt, 0.1 * natural)
    begin, size_of_path = choose(rng, STARTS), PATHS[scatter] * law.static
    nodes = size_of_path * rng.uniform(-1, 1, BLOCK) if size_of_path > 0 else np.zeros(0)
    options = MotionOptions(
        tolerance=float(choose(rng, TOLERANCES, TOLERANCE_SHARES)),
        samples_per_period=SAMPLES,
        scatter=choose(rng, SCATTERS),
    )
    equation, F = Equation(oscillator, law, nodes, travel / per_cycle, options), oscillator.F
    limit = F * law.static - 2 * damping * oscillator.V + oscillator.q
    places = (0.0, limit, limit - 1e-12 * F, limit + 1e-12 * F, 30 * F, F * float(law.mu(belt * omega)))
    start = places[STARTS.index(begin)]
    trial.case |= {"tolerance": options.tolerance, "law": kind, "excitation": excitation, "path": scatter}
    trial.case["begin"] = begin
    trial.answers = (ConvergenceError,)
    path = repeat(nodes) if nodes.size else None
    drawn = trajectory(oscillator, law, path, equation.spacing, PERIODS, options, start)
    motion, slipped = drawn.motion, drawn.motion.slipped_distance
    changes = motion.kind[motion.kind != CROSSING]
    alternate = np.where(np.arange(changes.size) % 2 == 0, DEPARTURE, REATTACHMENT)
    assert np.array_equal(changes, alternate), "departures and reattachments do not alternate"
    assert (np.diff(motion.time) >= 0).all(), "time runs back"
    assert (np.diff(slipped) >= -4 * np.spacing(slipped[1:])).all(), "slip runs back"
    assert np.isfinite([drawn.position, drawn.velocity]).all(), "samples are not finite"
    equation.judge_slips(trial, drawn)
    equation.judge_sticks(trial, drawn, start)


def draw_law(rng: np.random.Generator, kind: str, oscillator: Oscillator) -> FrictionLaw:
    """Draw a friction law that bends at speeds of the faster of belt and mass."""
    speed = oscillator.natural_frequency_rad_per_s * max(oscillator.V, oscillator.F)
    static = log_uniform(rng, -2, 0.3)
    if kind == "table":
        knots = np.concatenate(([0.0], np.cumsum(rng.uniform(0.05, 0.5, 6)))) * speed
        values = static * rng.uniform(0.2, 1.0, 7)
        return TableLaw(tuple(knots), tuple(values), float(max(values[0], static)))
    if kind in ("coulomb", "level"):
        return CoulombLaw(static * (rng.random() if kind == "coulomb" else 1.0), static)
    decay, fit = log_uniform(rng, 1, 3) if kind == "steep" else log_uniform(rng, -1, 1), static * rng.random()
    return StribeckLaw(fit, static, decay / speed, log_uniform(rng, -4, -1) / speed**2)
