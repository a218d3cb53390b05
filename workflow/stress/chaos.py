"""Campaign of polynomial chaos: random pressures at a node, expanded from random surfaces or along a strip.

No contact is solved: the pressure is the positive part of a known response to Gaussian variables, the gap its negative
part. Pressures and gaps have units of 1e-9 to 1e9.

At a node the response is linear, quadratic, bent or exponential, and scatters. The plane is set so that none, one, few,
half, nearly all or all samples are in contact. The judge compares with other surfaces of the same distribution. The
distribution of n distinct surfaces is within sqrt(log(2 / RISK) / 2 n) of the true one except with a probability of
RISK (Massart, Ann. Probab. 18 (1990) 1269). No expansion of them may be further away.

Every other problem is an expansion along a strip, fitted to the nodes of many short strips and judged on one long
strip. The response is a known function of height, slope and mean of the heights, computed here by plain differences.
The judge does not ask for what K independent samples cannot show. They miss an event with a probability of RISK if its
own probability is at most 1 - RISK^(1/K). The mean square error therefore leaves out the worst points of that share.
The stated error is an estimate from N - A degrees of freedom, with N points and A terms. For normal residuals it is too
low by a factor of (N - A) over the RISK quantile of chi-squared with a probability of RISK. The judge allows TWICE
that, since residuals of bent functions are not normal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from math import comb

import numpy as np
from scipy.stats import chi2, ks_2samp

from roughslip.chaos.functionals import Stencil, local_functionals
from roughslip.chaos.local import LocalExpansion, Samples, fit_best
from roughslip.chaos.pressure import KINDS, Kind, PressureTarget
from roughslip.chaos.strip import StripExpansion, fit_strip
from roughslip.errors import ConvergenceError, IllPosedError
from workflow.stress.runner import Conditions, Problem, Verdict, choose, log_uniform, unless, verdict_of

RISK, TWICE = 1e-6, 2.0

TARGETS: tuple[tuple[Kind, ...], ...] = (*((kind,) for kind in KINDS), KINDS)
CONTACTS = ("none", "one", "few", "half", "most", "all")
CONTACT_SHARES = (0.05, 0.05, 0.2, 0.45, 0.15, 0.1)
SHAPES = ("root", "linear")  # of pressure over response: of Hertz contact, and of a single cell
RESPONSES = ("linear", "quadratic", "kink", "exponential")
COPIES, COPY_SHARES = (1, 3, 1000), (0.85, 0.1, 0.05)  # how often each surface occurs

MOST_SURFACES, MOST_TERMS = 1000, 60
FRESH = 20_000
FAR = 30.0  # times the largest pressure of as many other surfaces

STRIP_KINDS: tuple[Kind, ...] = ("trial_pressure", "squared_pressure")
STENCIL = Stencil(near=(1, 1), far=(4, 2))
REACH = 5  # nodes from a node to the ends of its strip, beyond all differences and means
TERMS = (1, 9, 45, 165)  # of degree 0 to 3 in the eight functionals
LONG = 2000


def problem(seed: int, number: int) -> Problem:
    """Return the problem of this number."""
    if number % 2:
        strip = random_strip(seed, number)
        case = {"kind": strip.kind, "rows": strip.rows, "samples": strip.samples, "degree": strip.degree}
        case |= {"bend": strip.bend, "planes": ",".join(map(str, strip.planes)), "copies": strip.copies}
        return Problem(case, strip.solve, strip.judge, unless(strip.is_well_posed, IllPosedError, ConvergenceError))
    node = random_pressure(seed, number)
    names = ("contact", "shape", "response", "copies", "variables", "surfaces", "degree", "scatter")
    case = {"kinds": ",".join(node.kinds)} | {name: getattr(node, name) for name in names}
    return Problem(case, node.solve, node.judge, unless(node.is_well_posed, IllPosedError, ConvergenceError))


@dataclass(frozen=True)
class PressureProblem:
    """Surfaces, and how their pressure follows from their variables.

    number, seed : of the problem
    kinds : of the targets that may be taken
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
    kinds: tuple[Kind, ...]
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
    def targets(self) -> list[PressureTarget]:
        """The targets, with the guessed stiffness."""
        trial = self.guess * self.pressure_unit / self.gap_unit
        squared = self.guess * self.pressure_unit**2 / self.gap_unit
        cell = 0.3 * self.pressure_unit if self.shape == "linear" else 0.0
        return [
            PressureTarget(kind, trial) if kind == "trial_pressure" else PressureTarget(kind, squared, cell)
            for kind in self.kinds
        ]

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

    def solve(self) -> tuple[LocalExpansion, dict]:
        """Return the expansion of the best score, and all scores."""
        return fit_best(self.samples(), self.degree, self.targets)

    def judge(self, answer: tuple[LocalExpansion, dict], allowed: float | None = None) -> Verdict:
        """Return whether pressures of an expansion have the distribution of those of other surfaces.

        allowed : the largest distance of the two distributions, without the sampling errors of the comparison
        """
        expansion, scores = answer
        if expansion.score != np.nanmin(list(scores.values())):
            return Verdict(math.inf, ("not the best score",))
        if allowed is None:
            allowed = sampling_error(math.ceil(self.surfaces / self.copies))
        u, true = self.fresh()
        drawn = expansion.draw(np.random.default_rng([self.number, 4]), FRESH)
        means = expansion.mean_pressure_at(u)
        if not all(np.isfinite(part).all() for part in (drawn, means, expansion.score, expansion.cross_validated)):
            return Verdict(math.inf, ("pressures are not finite",))
        distance, limit = float(ks_2samp(drawn, true, method="asymp").statistic), allowed + 2 * sampling_error(FRESH)
        conditions: Conditions = {
            "the distribution": (distance, limit),
            "p >= 0": (-min(drawn.min(), means.min()), 0),
            "the largest pressure": (drawn.max(), FAR * max(float(true.max()), float(self.samples().pressure.max()))),
            "errors are not negative": (-min(expansion.score, expansion.cross_validated), 0),
        }
        return verdict_of(conditions, distance / limit)

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


def random_pressure(seed: int, number: int) -> PressureProblem:
    """Return the problem of this number, of at most MOST_TERMS terms."""
    generator = np.random.default_rng([seed, number, 0])
    contact = choose(generator, CONTACTS, CONTACT_SHARES)
    variables, degree = int(generator.integers(1, 9)), int(generator.integers(1, 5))
    while comb(variables + degree, degree) > MOST_TERMS:
        degree -= 1
    problem = PressureProblem(
        number=number,
        seed=seed,
        kinds=choose(generator, TARGETS),
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


def sampling_error(count: int) -> float:
    """Return the bound of sup |F_n - F| for so many samples, exceeded with a probability of RISK."""
    return math.sqrt(math.log(2 / RISK) / (2 * count))


@dataclass(frozen=True)
class StripProblem:
    """Training nodes of a strip and the response that gives their pressure.

    number, seed : of the problem
    kind : of the target
    rows, samples, degree : of the fit
    bend : how far the response is from a polynomial of degree 2
    planes : of the response, one for each penetration
    height_unit, pressure_unit : [m], [Pa]
    copies : how often each sample occurs
    """

    number: int
    seed: int
    kind: Kind
    rows: int
    samples: int
    degree: int
    bend: float
    planes: tuple[float, ...]
    height_unit: float
    pressure_unit: float
    copies: int

    @property
    def is_well_posed(self) -> bool:
        """Whether a problem has a solution beyond doubt, so that no error answers it."""
        enough = self.samples >= 8 * TERMS[self.degree] and self.copies == 1
        return enough and self.rows >= 5 and max(np.abs(self.planes)) < 1.0

    @property
    def target(self) -> PressureTarget:
        power_ = 1 if self.kind == "trial_pressure" else 2
        return PressureTarget(self.kind, self.pressure_unit**power_ / self.height_unit)

    def heights(self, stream: int, count: int, nodes: int) -> np.ndarray:
        """Return (count, nodes, rows) [m] white noise averaged over three nodes along the strip."""
        white = np.random.default_rng([self.seed, self.number, stream]).standard_normal((count, nodes + 2, self.rows))
        return self.height_unit * (white[:, :-2] + white[:, 1:-1] + white[:, 2:]) / math.sqrt(3)

    def values(self, heights: np.ndarray) -> np.ndarray:
        """Return the target (count, nodes - 2 REACH, rows, levels) at the nodes away from both ends."""
        h = heights / self.height_unit
        inner = slice(REACH, heights.shape[1] - REACH)
        slope = np.gradient(h, axis=1)[:, inner]
        mean = sum(np.roll(h, k, axis=1) for k in (-1, 0, 1))[:, inner] / 3
        row = 1 + 0.2 * np.arange(self.rows)
        response = row * h[:, inner] + 0.5 * mean + 0.3 * slope**2 + self.bend * np.abs(slope)
        unit = self.pressure_unit if self.kind == "trial_pressure" else self.pressure_unit**2
        return unit * (response[..., None] + np.array(self.planes))

    def training(self) -> tuple[np.ndarray, np.ndarray]:
        """Return functionals and values of the target at the nodes of short strips, some of which may be copies."""
        heights = self.heights(1, max(self.samples // self.copies, 1), 2 * REACH + 1)
        parts = local_functionals(heights, STENCIL)[:, :, REACH].transpose(1, 2, 0), self.values(heights)[:, 0]
        functionals, values = (np.repeat(part, self.copies, axis=0) for part in parts)
        return functionals, values

    def solve(self) -> tuple[StripExpansion, dict[str, np.ndarray]]:
        """Return the expansion and its quality."""
        return fit_strip(*self.training(), self.degree, STENCIL, self.target)

    def judge(self, answer: tuple[StripExpansion, dict[str, np.ndarray]]) -> Verdict:
        """Compare positive parts of the target along a long strip, with the weights of the fit.

        The expansion states leave-one-out errors (rows, levels) [-].
        """
        expansion, stated = answer[0], answer[1]["leave_one_out"]
        distinct, (_, values) = max(self.samples // self.copies, 1), self.training()
        heights = self.heights(2, 1, LONG)
        pressure = expansion.pressure(heights[0])[:, REACH:-REACH]
        if not (np.isfinite(pressure).all() and (pressure >= 0).all()):
            return Verdict(math.inf, ("pressures are negative or not finite",))
        found = (pressure if self.kind == "trial_pressure" else pressure**2).transpose(1, 2, 0)
        true = self.values(heights)[0]
        squares = (found - np.maximum(true, 0.0)) ** 2
        seen = math.ceil(RISK ** (1 / distinct) * len(squares))  # A share of the worst may be unknown to the samples.
        freedom = distinct - TERMS[self.degree]
        factor = TWICE * freedom / float(chi2.ppf(RISK, freedom)) if freedom > 0 else math.inf
        worst, broken = 0.0, []
        for row in range(self.rows):
            for level in range(len(self.planes)):
                known = values[:, row, level]
                weights, fresh = (self._weights(part, known) for part in (known, true[:, row, level]))
                mean = np.average(known, weights=weights)
                variance = float(np.average((known - mean) ** 2, weights=weights))
                error = float(np.sort(squares[:, row, level] * fresh)[:seen].sum() / fresh.sum())
                allowed = factor * stated[row, level] * variance + (1e-11 * np.max(np.abs(known))) ** 2
                worst = max(worst, error / allowed)
                if not error <= allowed:
                    broken.append(f"row {row}, penetration {level}: error {error:.3e} for {allowed:.3e}")
        return Verdict(worst, tuple(broken))

    def _weights(self, target: np.ndarray, known: np.ndarray) -> np.ndarray:
        """Return weights: 1 in contact, 1 / (1 + (w / w_0)^2) out of it with w_0 = 0.3 of the mean in contact.

        For a trial pressure all are 1.
        """
        if self.kind == "trial_pressure":
            return np.ones(len(target))
        scale = 0.3 * known[known > 0].mean()
        return np.where(target > 0, 1.0, 1 / (1 + (target / scale) ** 2))


def random_strip(seed: int, number: int) -> StripProblem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number, 9])
    degree = int(generator.integers(0, 4))
    samples = min(math.ceil(TERMS[degree] * log_uniform(generator, -0.3, 2)) + int(generator.integers(0, 6)), 3000)
    return StripProblem(
        number,
        seed,
        choose(generator, STRIP_KINDS),
        int(generator.integers(1, 9)),
        samples,
        degree,
        choose(generator, (0.0, 0.0, 0.1, 1.0)),
        tuple(generator.choice([-30.0, -2.0, -0.8, 0.0, 0.8, 30.0], int(generator.integers(1, 4)))),
        log_uniform(generator, -9, 9),
        log_uniform(generator, -9, 9),
        choose(generator, (1, 2, 3), (0.8, 0.15, 0.05)),
    )
