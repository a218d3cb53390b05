"""Random expansions along a strip, fitted to the nodes of many short strips and judged on one long strip.

The response is a known function of height, slope and mean of the heights, computed here by plain differences.

The judge does not ask for what K independent samples cannot show. They miss an event with a probability of RISK if its
own probability is at most 1 - RISK^(1/K). The mean square error therefore leaves out the worst points of that share.

The stated error is an estimate from N - A degrees of freedom, with N points and A terms. For normal residuals it is too
low by a factor of (N - A) over the RISK quantile of chi-squared with a probability of RISK. The judge allows TWICE
that, since residuals of bent functions are not normal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from roughslip.chaos.functionals import Stencil, local_functionals
from roughslip.chaos.pressure import Kind, PressureTarget
from roughslip.chaos.strip import StripExpansion, fit_strip
from workflow.stress.runner import Verdict, choose, log_uniform

KINDS: tuple[Kind, ...] = ("trial_pressure", "squared_pressure")
STENCIL = Stencil(near=(1, 1), far=(4, 2))
REACH = 5  # nodes from a node to the ends of its strip, beyond all differences and means
TERMS = (1, 9, 45, 165)  # of degree 0 to 3 in the eight functionals
LONG = 2000
RISK, TWICE = 1e-6, 2.0


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


def random_problem(seed: int, number: int) -> StripProblem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number, 9])
    degree = int(generator.integers(0, 4))
    samples = min(math.ceil(TERMS[degree] * log_uniform(generator, -0.3, 2)) + int(generator.integers(0, 6)), 3000)
    return StripProblem(
        number,
        seed,
        choose(generator, KINDS),
        int(generator.integers(1, 9)),
        samples,
        degree,
        choose(generator, (0.0, 0.0, 0.1, 1.0)),
        tuple(generator.choice([-30.0, -2.0, -0.8, 0.0, 0.8, 30.0], int(generator.integers(1, 4)))),
        log_uniform(generator, -9, 9),
        log_uniform(generator, -9, 9),
        choose(generator, (1, 2, 3), (0.8, 0.15, 0.05)),
    )


def judged(problem: StripProblem) -> Verdict:
    """Expand the strip and judge all its rows and penetrations."""
    distinct = max(problem.samples // problem.copies, 1)
    heights = problem.heights(1, distinct, 2 * REACH + 1)
    functionals = local_functionals(heights, STENCIL)[:, :, REACH].transpose(1, 2, 0)
    values = problem.values(heights)[:, 0]
    functionals, values = (np.repeat(part, problem.copies, axis=0) for part in (functionals, values))
    expansion, quality = fit_strip(functionals, values, problem.degree, STENCIL, problem.target)
    return judge(problem, expansion, quality["leave_one_out"], values, distinct)


def judge(
    problem: StripProblem, expansion: StripExpansion, stated: np.ndarray, values: np.ndarray, distinct: int
) -> Verdict:
    """Compare positive parts of the target along a long strip, with the weights of the fit.

    stated : (rows, levels) [-] leave-one-out errors of the expansion
    distinct : number of different samples
    """
    heights = problem.heights(2, 1, LONG)
    pressure = expansion.pressure(heights[0])[:, REACH:-REACH]
    if not (np.isfinite(pressure).all() and (pressure >= 0).all()):
        return Verdict(math.inf, ("pressures are negative or not finite",))
    found = (pressure if problem.kind == "trial_pressure" else pressure**2).transpose(1, 2, 0)
    true = problem.values(heights)[0]
    squares = (found - np.maximum(true, 0.0)) ** 2
    seen = math.ceil(RISK ** (1 / distinct) * len(squares))  # A share of the worst may be unknown to the samples.
    freedom = distinct - TERMS[problem.degree]
    factor = TWICE * freedom / float(chi2.ppf(RISK, freedom)) if freedom > 0 else math.inf
    worst, broken = 0.0, []
    for row in range(problem.rows):
        for level in range(len(problem.planes)):
            known = values[:, row, level]
            weights, fresh = (_weights(problem, part, known) for part in (known, true[:, row, level]))
            mean = np.average(known, weights=weights)
            variance = float(np.average((known - mean) ** 2, weights=weights))
            error = float(np.sort(squares[:, row, level] * fresh)[:seen].sum() / fresh.sum())
            allowed = factor * stated[row, level] * variance + (1e-11 * np.max(np.abs(known))) ** 2
            worst = max(worst, error / allowed)
            if not error <= allowed:
                broken.append(f"row {row}, penetration {level}: error {error:.3e} for {allowed:.3e}")
    return Verdict(worst, tuple(broken))


def _weights(problem: StripProblem, target: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return weights: 1 in contact, 1 / (1 + (w / w_0)^2) out of it with w_0 = 0.3 of the mean in contact.

    For a trial pressure all are 1.
    """
    if problem.kind == "trial_pressure":
        return np.ones(len(target))
    scale = 0.3 * known[known > 0].mean()
    return np.where(target > 0, 1.0, 1 / (1 + (target / scale) ** 2))
