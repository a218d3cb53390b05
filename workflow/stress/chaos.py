"""Stress campaign of polynomial chaos: random contact pressures at a node, expanded from random surfaces.

No contact is solved: the pressure is the positive part of a known response to Gaussian variables, the gap its negative
part. The response is linear, quadratic, bent or exponential, and scatters. The plane is set so that none, one, few,
half, nearly all or all samples are in contact. Pressures and gaps have units of 1e-9 to 1e9.

The judge compares with other surfaces of the same distribution. The distribution of n distinct surfaces is within
sqrt(log(2 / RISK) / 2 n) of the true one except with a probability of RISK (Massart, Ann. Probab. 18 (1990) 1269). No
expansion of them may be further away. Every other problem is one of expansions along a strip (`chaos_strip`).
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, replace
from math import comb

import numpy as np
from scipy.stats import ks_2samp

from roughslip.chaos.local import LocalExpansion, Samples, fit_local
from roughslip.chaos.pressure import KINDS, Kind, PressureTarget
from roughslip.errors import ConvergenceError, IllPosedError, RoughslipError
from workflow.evidence.rows import Row
from workflow.stress import chaos_strip, runner
from workflow.stress.chaos_strip import RISK, StripProblem
from workflow.stress.runner import Conditions, Verdict, choose, has_advice, log_uniform, verdict_of

STAGE = "chaos"
PROBLEMS = 2000

CONTACTS = ("none", "one", "few", "half", "most", "all")
CONTACT_SHARES = (0.05, 0.05, 0.2, 0.45, 0.15, 0.1)
SHAPES = ("root", "linear")  # of pressure over response: of Hertz contact, and of a single cell
RESPONSES = ("linear", "quadratic", "kink", "exponential")
COPIES, COPY_SHARES = (1, 3, 1000), (0.85, 0.1, 0.05)  # how often each surface occurs

MOST_SURFACES, MOST_TERMS = 1000, 60
FRESH = 20_000
FAR = 30.0  # times the largest pressure of as many other surfaces


@dataclass(frozen=True)
class PressureProblem:
    """Surfaces, and how their pressure follows from their variables.

    number, seed : of the problem
    kind : of the target
    contact, shape, response : one of the names of this module
    copies : how often each surface occurs
    variables, nodes, surfaces, degree : of the fit
    plane : of the response, in its standard deviation
    drift : of the response over a unit of squared distance
    scatter : standard deviation of the response given the variables
    pressure_unit, gap_unit : [Pa], [m]
    guess : stiffness of the gap that is given, over the true one
    """

    number: int
    seed: int
    kind: Kind
    contact: str
    shape: str
    response: str
    copies: int
    variables: int
    nodes: int
    surfaces: int
    degree: int
    plane: float
    drift: float
    scatter: float
    pressure_unit: float
    gap_unit: float
    guess: float

    @property
    def is_well_posed(self) -> bool:
        """Whether a problem has a solution beyond doubt, so that no error answers it."""
        clear = self.contact == "half" and self.copies == 1 and self.scatter >= 0.1
        enough = self.surfaces >= max(25 * comb(self.variables + self.degree, self.degree), 200)
        return clear and enough

    @property
    def target(self) -> PressureTarget:
        """The target, with the guessed stiffness."""
        trial = self.guess * self.pressure_unit / self.gap_unit
        squared = self.guess * self.pressure_unit**2 / self.gap_unit
        cell = 0.3 * self.pressure_unit if self.shape == "linear" else 0.0
        trial_is_asked = self.kind == "trial_pressure"
        return PressureTarget(self.kind, trial) if trial_is_asked else PressureTarget(self.kind, squared, cell)

    def samples(self) -> Samples:
        """Return the surfaces, some of which may be copies."""
        generator = np.random.default_rng([self.seed, self.number, 2])
        distinct = math.ceil(self.surfaces / self.copies)
        u = generator.standard_normal((distinct, self.nodes, self.variables))
        u[:, 1:] = np.sqrt(0.5) * (u[:, :1] + u[:, 1:])  # Neighbours are like the node in the centre.
        distance2 = np.linspace(0.0, 1.0, self.nodes) if self.nodes > 1 else np.zeros(1)
        scatter = self.scatter * generator.standard_normal((distinct, 1))
        parts = (u, *self._split(self._response(u) + scatter - self.drift * distance2))
        variables, pressure, gap = (np.repeat(part, self.copies, axis=0)[: self.surfaces] for part in parts)
        return Samples(variables, distance2, pressure, gap)

    def fresh(self) -> tuple[np.ndarray, np.ndarray]:
        """Return variables : (FRESH, v) of other surfaces and their pressure : (FRESH,) [Pa] at the centre."""
        generator = np.random.default_rng([self.seed, self.number, 3])
        u = generator.standard_normal((FRESH, self.variables))
        return u, self._split(self._response(u) + self.scatter * generator.standard_normal(FRESH))[0]

    def _response(self, u: np.ndarray) -> np.ndarray:
        """Return the response : (...) at variables : (..., v), of order one about the plane."""
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
        """Return pressure [Pa] and gap [m]."""
        pressed = np.maximum(response, 0.0)
        pressure = np.sqrt(pressed) if self.shape == "root" else pressed
        return self.pressure_unit * pressure, self.gap_unit * np.maximum(-response, 0.0)


def row_of(seed: int, number: int) -> Row:
    """Return the row of the problem of this number."""
    if number % 2:
        return runner.problem_row(STAGE, chaos_strip.random_problem(seed, number), chaos_strip.judged, is_answer)
    return runner.problem_row(STAGE, random_problem(seed, number), judged, is_answer)


def is_answer(problem: PressureProblem | StripProblem, error: RoughslipError) -> bool:
    """Whether an error answers a problem: of the right type, with advice, and the problem is not well posed."""
    return isinstance(error, IllPosedError | ConvergenceError) and has_advice(error) and not problem.is_well_posed


def random_problem(seed: int, number: int) -> PressureProblem:
    """Return the problem of this number, of at most MOST_TERMS terms."""
    generator = np.random.default_rng([seed, number, 0])
    contact = choose(generator, CONTACTS, CONTACT_SHARES)
    variables, degree = int(generator.integers(1, 9)), int(generator.integers(1, 5))
    while comb(variables + degree, degree) > MOST_TERMS:
        degree -= 1
    problem = PressureProblem(
        number=number,
        seed=seed,
        kind=choose(generator, KINDS),
        contact=contact,
        shape=choose(generator, SHAPES),
        response=choose(generator, RESPONSES),
        copies=choose(generator, COPIES, COPY_SHARES),
        variables=variables,
        nodes=choose(generator, (1, 1, 3)),
        surfaces=round(log_uniform(generator, 1, np.log10(MOST_SURFACES))),
        degree=degree,
        plane=1e6,  # All samples are in contact, so that their pressures show the response.
        drift=float(generator.uniform(0, 1)),
        scatter=choose(generator, (0.0, 1e-3, 0.1, 0.3, 1.0)),
        pressure_unit=log_uniform(generator, -9, 9),
        gap_unit=log_uniform(generator, -9, 9),
        guess=log_uniform(generator, -0.5, 0.5),
    )
    return replace(problem, plane=_plane(generator, problem))


def _plane(generator: np.random.Generator, problem: PressureProblem) -> float:
    """Return what the response is raised by, so that the named share of samples is in contact."""
    high = replace(problem, shape="linear", pressure_unit=1.0)
    levels = np.unique(high.samples().pressure) - high.plane
    match problem.contact:
        case "none":
            return float(-levels[-1] - 1)
        case "one":
            return float(-levels[-2:].mean())
        case "all":
            return float(1 - levels[0])
    least, most = {"few": (0.005, 0.1), "half": (0.2, 0.8), "most": (0.9, 0.99)}[problem.contact]
    return float(-np.quantile(levels, 1 - generator.uniform(least, most)))


def judged(problem: PressureProblem) -> Verdict:
    """Expand the pressures and judge the expansion, which must be that of the best score."""
    samples = problem.samples()
    expansion = fit_local(samples, problem.degree, problem.target)
    return judge(problem, expansion, samples, sampling_error(math.ceil(problem.surfaces / problem.copies)))


def sampling_error(count: int) -> float:
    """Return the bound of sup |F_n - F| for so many samples, exceeded with a probability of RISK."""
    return math.sqrt(math.log(2 / RISK) / (2 * count))


def judge(problem: PressureProblem, expansion: LocalExpansion, samples: Samples, allowed: float) -> Verdict:
    """Return whether pressures of an expansion have the distribution of those of other surfaces.

    allowed : the largest distance of the two distributions, without the sampling errors of the comparison
    """
    u, true = problem.fresh()
    drawn = expansion.draw(np.random.default_rng([problem.number, 4]), FRESH)
    means = expansion.mean_pressure_at(u)
    if not all(np.isfinite(part).all() for part in (drawn, means, expansion.score, expansion.cross_validated)):
        return Verdict(math.inf, ("pressures are not finite",))
    distance, limit = float(ks_2samp(drawn, true, method="asymp").statistic), allowed + 2 * sampling_error(FRESH)
    conditions: Conditions = {
        "the distribution": (distance, limit),
        "p >= 0": (-min(drawn.min(), means.min()), 0),
        "the largest pressure": (drawn.max(), FAR * max(float(true.max()), float(samples.pressure.max()))),
        "errors are not negative": (-min(expansion.score, expansion.cross_validated), 0),
    }
    return verdict_of(conditions, distance / limit)


if __name__ == "__main__":
    sys.exit(runner.command(__doc__, STAGE, row_of, PROBLEMS))
