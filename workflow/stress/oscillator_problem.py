"""Random motions: damping, belts, loads, friction laws, excitations and friction paths far beyond any machine's."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import repeat

import numpy as np

from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_law import FrictionLaw
from roughslip.oscillator.friction_laws.coulomb import CoulombLaw
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.laws import LAWS
from roughslip.oscillator.motion import NEGATIVE_FRICTION, MotionOptions
from roughslip.oscillator.path import INTERPOLATIONS
from roughslip.oscillator.runge_kutta import PAIRS
from workflow.stress.runner import choose, log_uniform

KINDS = ("stribeck", "steep", "coulomb", "level", "table")
KINDS += tuple(name for name in sorted(LAWS) if name not in KINDS)
EXCITATIONS = ("none", "weak", "resonance", "fast", "strong")
FOLLOWS = ("slip", "belt", "time")
STARTS = ("rest", "limit", "just-inside", "just-beyond", "far", "steady")
PATHS = ("none", "weak", "strong", "negative")
TOLERANCES = (1e-6, 1e-4, 1e-9)
BLOCK = 256  # nodes that a path repeats
PERIODS = 12.0


@dataclass(frozen=True)
class MotionProblem:
    """A motion to compute.

    number : of the problem
    oscillator, law : of the motion
    nodes : (BLOCK,) [-] that the path repeats; empty without a path
    spacing : [m], or [s] where friction follows time
    start : [m] X at the beginning
    periods : duration
    options : of the motion
    labels : what else names the case
    """

    number: int
    oscillator: Oscillator
    law: FrictionLaw
    nodes: np.ndarray
    spacing: float
    start: float
    periods: float
    options: MotionOptions
    labels: dict[str, str]

    @property
    def path(self) -> Iterator[np.ndarray] | None:
        """Repeat the nodes without end."""
        return repeat(self.nodes) if self.nodes.size else None

    @property
    def may_turn_negative(self) -> bool:
        """Whether the least sum of law and path is below zero, with the overshoot of splines."""
        lowest = self.nodes.min(initial=0.0) - 0.25 * np.ptp(self.nodes) if self.nodes.size else 0.0
        return self.law.parameters().least + lowest < 0.0


def random_problem(seed: int, number: int) -> MotionProblem:
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
    kind, scatter = choose(generator, KINDS), choose(generator, PATHS)
    law = _law(generator, kind, oscillator)
    per_cycle = log_uniform(generator, -3, 3)
    travel = 2 * math.pi * (1 / omega if follows == "time" else max(belt, 0.1 * natural if follows == "slip" else 0))
    start_kind = choose(generator, STARTS)
    return MotionProblem(
        number=number,
        oscillator=oscillator,
        law=law,
        nodes=_nodes(generator, scatter, law.static),
        spacing=travel / per_cycle,
        start=_start(start_kind, oscillator, law),
        periods=PERIODS,
        options=MotionOptions(
            tolerance=float(choose(generator, TOLERANCES, (0.6, 0.2, 0.2))),
            stochastic_static_limit=bool(generator.integers(2)),
            interpolation=choose(generator, INTERPOLATIONS),
            friction_follows=follows,
            negative_friction=choose(generator, NEGATIVE_FRICTION, (0.8, 0.2)),
            integrator=choose(generator, tuple(PAIRS)),
        ),
        labels={"law": kind, "excitation": excitation, "path": scatter, "begin": start_kind},
    )


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


def _nodes(generator: np.random.Generator, kind: str, static: float) -> np.ndarray:
    size = {"none": 0.0, "weak": 0.05, "strong": 0.8, "negative": 3.0}[kind] * static
    return size * generator.uniform(-1, 1, BLOCK) if size > 0 else np.zeros(0)


def _start(kind: str, oscillator: Oscillator, law: FrictionLaw) -> float:
    limit = oscillator.F * law.static - 2 * oscillator.damping_ratio * oscillator.V + oscillator.q
    match kind:
        case "rest":
            return 0.0
        case "limit":
            return limit
        case "just-inside":
            return limit - 1e-12 * oscillator.F
        case "just-beyond":
            return limit + 1e-12 * oscillator.F
        case "far":
            return 30.0 * oscillator.F
    return oscillator.F * float(law.mu(oscillator.belt_velocity_m_per_s))
