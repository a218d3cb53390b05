"""Random contact pressures without a contact solve: the positive part of a known response to Gaussian variables.

The response r of a surface is a polynomial of its variables, or bent or exponential in one direction of them, and
scatters; where it is positive it gives the pressure, where it is negative the gap. The plane is set so that none, one,
few, half, nearly all or all of the samples are in contact, pressures and gaps have units of 1e-9 to 1e9.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import comb

import numpy as np

from roughslip.chaos.local import Samples
from roughslip.chaos.pressure import KINDS, Kind, PressureTarget
from workflow.stress.drawing import one_of, power

ENTRIES = ("local", "best", "enriched", "in-contact")
ENTRY_SHARES = (0.6, 0.15, 0.05, 0.2)
CONTACTS = ("none", "one", "few", "half", "most", "all")
CONTACT_SHARES = (0.05, 0.05, 0.2, 0.45, 0.15, 0.1)
LAWS = ("root", "linear")  # of the pressure: of Hertz, where its square follows the response, and of a single cell
RESPONSES = ("linear", "quadratic", "kink", "exponential")
COPIES, COPY_SHARES = ("no", "some", "every", "one-surface"), (0.8, 0.08, 0.08, 0.04)

MOST_SURFACES = 1000
MOST_TERMS = 60


@dataclass(frozen=True)
class Problem:
    """Surfaces, and how their pressure comes about.

    number, seed : which ones
    entry, contact, law, response, copies : as the names of this module
    variables, nodes, surfaces, degree : of the fit
    kinds : of the targets that may be taken
    plane : of the response, in its standard deviation
    drift : of the response over a unit of squared distance
    scatter : standard deviation of the response given the variables
    pressure_unit, gap_unit : [Pa], [m]
    guess : stiffness of the gap that is given, over the true one
    asked : error of the distribution that is asked for
    """

    number: int
    seed: int
    entry: str
    contact: str
    law: str
    response: str
    copies: str
    variables: int
    nodes: int
    surfaces: int
    degree: int
    kinds: tuple[Kind, ...]
    plane: float
    drift: float
    scatter: float
    pressure_unit: float
    gap_unit: float
    guess: float
    asked: float

    @property
    def terms(self) -> int:
        return comb(self.variables + self.degree, self.degree)

    def well_posed(self) -> bool:
        """Whether a problem can be solved beyond doubt: then no error answers it."""
        clear = self.contact == "half" and self.copies == "no" and self.scatter >= 0.1 and 1 <= self.degree <= 4
        return clear and self.surfaces >= max(25 * self.terms, 200) and self.entry != "enriched"

    @property
    def distance2(self) -> np.ndarray:
        """(nodes,) [-] of each node, the central one first."""
        return np.linspace(0.0, 1.0, self.nodes) if self.nodes > 1 else np.zeros(1)

    def target(self, kind: Kind) -> PressureTarget:
        """The target of a kind, its stiffness off by the guess."""
        if kind == "trial_pressure":
            return PressureTarget(kind, self.guess * self.pressure_unit / self.gap_unit)
        stiffness = self.guess * self.pressure_unit**2 / self.gap_unit
        return PressureTarget(kind, stiffness, 0.3 * self.pressure_unit if self.law == "linear" else 0.0)

    def surfaces_of(self, first: int, last: int) -> Samples:
        """The surfaces of these numbers, of which some may be copies."""
        variables, response = self.responses(first, last)
        return Samples(variables, self.distance2, *self._split(response))

    def responses(self, first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
        """Variables : (K, nodes, v) and response : (K, nodes) of the surfaces of these numbers."""
        variables, response = zip(*(self._one(self._origin(n)) for n in range(first, last)), strict=True)
        return np.array(variables), np.array(response)

    def fresh(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Variables : (count, v) of as many other surfaces, and their pressure : (count,) [Pa] at the centre."""
        generator = np.random.default_rng([self.seed, self.number, 3])
        u = generator.standard_normal((count, self.variables))
        return u, self._split(self._response(u) + self.scatter * generator.standard_normal(count))[0]

    def _origin(self, number: int) -> int:
        match self.copies:
            case "some":
                return number if number % 3 else number // 2
            case "every":
                return number // 3
            case "one-surface":
                return 0
        return number

    def _one(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        generator = np.random.default_rng([self.seed, self.number, 2, number])
        centre = generator.standard_normal(self.variables)
        others = generator.standard_normal((self.nodes, self.variables))
        u = np.sqrt(0.5) * (centre + others)  # neighbours are alike
        u[0] = centre
        shared = self.scatter * generator.standard_normal()
        return u, self._response(u) + shared - self.drift * self.distance2

    def _response(self, u: np.ndarray) -> np.ndarray:
        """r : (...) at variables : (..., v), of order one about the plane."""
        slope = np.random.default_rng([self.seed, self.number, 1]).standard_normal(self.variables)
        slope /= np.linalg.norm(slope)
        along, across = u @ slope, u[..., -1]
        match self.response:
            case "quadratic":
                along = along + 0.3 * (across**2 - 1) + 0.2 * across * u[..., 0]
            case "kink":
                along = np.where(along > 0, along, 0.4 * along)
            case "exponential":
                along = np.exp(0.7 * along) - 1
        return along + self.plane

    def _split(self, response: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pressure [Pa] and gap [m]."""
        pressed = np.maximum(response, 0.0)
        pressure = np.sqrt(pressed) if self.law == "root" else pressed
        return self.pressure_unit * pressure, self.gap_unit * np.maximum(-response, 0.0)


def random_problem(seed: int, number: int) -> Problem:
    """The problem of this number."""
    generator = np.random.default_rng([seed, number, 0])
    entry = one_of(generator, ENTRIES, ENTRY_SHARES)
    contact = one_of(generator, CONTACTS, CONTACT_SHARES)
    variables = int(generator.integers(1, 9))
    surfaces = round(power(generator, 1, np.log10(MOST_SURFACES)))
    kinds = tuple(generator.permutation(KINDS)) if entry == "best" else (one_of(generator, KINDS),)
    problem = Problem(
        number,
        seed,
        entry,
        contact,
        one_of(generator, LAWS),
        one_of(generator, RESPONSES),
        one_of(generator, COPIES, COPY_SHARES),
        variables,
        one_of(generator, (1, 1, 3)),
        surfaces,
        _degree(generator, variables),
        kinds,
        0.0,
        float(generator.uniform(0, 1)),
        one_of(generator, (0.0, 1e-3, 0.1, 0.3, 1.0)),
        power(generator, -9, 9),
        power(generator, -9, 9),
        power(generator, -0.5, 0.5),
        power(generator, -1.7, -0.3),
    )
    return replace(problem, plane=_plane(generator, problem))


def _degree(generator: np.random.Generator, variables: int) -> int:
    """Up to 15, of at most MOST_TERMS terms."""
    degree = int(generator.integers(1, 5)) if generator.random() < 0.8 else int(generator.integers(0, 16))
    while comb(variables + degree, degree) > MOST_TERMS:
        degree -= 1
    return degree


def _plane(generator: np.random.Generator, problem: Problem) -> float:
    """What the response is raised by, so that as many samples are in contact as its name says."""
    levels = np.unique(problem.responses(0, problem.surfaces)[1])
    match problem.contact:
        case "none":
            return float(-levels[-1] - 1)
        case "one":
            return float(-levels[-2:].mean()) if len(levels) > 1 else 0.0
        case "all":
            return float(1 - levels[0])
    low, high = {"few": (0.005, 0.1), "half": (0.2, 0.8), "most": (0.9, 0.99)}[problem.contact]
    return float(-np.quantile(levels, 1 - generator.uniform(low, high)))
