"""Random contact pressures through every expansion of them, judged by other surfaces of the same law.

The distribution of n distinct surfaces is within sqrt(log(2 / RISK) / 2 n) of the true one but for a probability of
RISK (Massart, Ann. Probab. 18 (1990) 1269), and no expansion of them may be further away. One that was enriched until
its error is as asked may be BEYOND times that away, as its estimate is a quantile of 95 %.
"""

from __future__ import annotations

import math

import numpy as np

from roughslip.chaos import distribution
from roughslip.chaos.enrichment import cumulative, enrich
from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.chaos.local import LocalExpansion, Samples, fit_best, fit_local
from roughslip.chaos.pressure import fit_in_contact
from workflow.benchmarks.measure import case
from workflow.stress.chaos_contact_problem import Problem, random_problem
from workflow.stress.chaos_judge import RISK, beyond, product_terms, seen_error
from workflow.stress.outcomes import Verdict

__all__ = ["case_of", "judged", "random_problem"]

FRESH = 20_000
BEYOND = 2.5  # the error at a risk of RISK over that at 5 %, of a normal one: 4.9 / 1.96
MOST = 512  # surfaces that an enrichment may take
FAR = 30.0  # times the largest pressure of as many other surfaces


def case_of(problem: Problem) -> str:
    return case(
        number=problem.number,
        entry=problem.entry,
        function=problem.response,
        variables=problem.variables,
        degree=problem.degree,
        samples=problem.surfaces,
        nodes=problem.nodes,
        copies=problem.copies,
        contact=problem.contact,
        law=problem.law,
        target=",".join(problem.kinds),
        noise=f"{problem.scatter:g}",
        pressure=f"{problem.pressure_unit:.2g}",
        gap=f"{problem.gap_unit:.2g}",
        asked=f"{problem.asked:.2g}",
        tolerance=1,
    )


def judged(problem: Problem) -> Verdict:
    """The pressures expanded, and judged."""
    match problem.entry:
        case "in-contact":
            return _in_contact(problem)
        case "enriched":
            return _enriched(problem)
    samples = problem.surfaces_of(0, problem.surfaces)
    targets = [problem.target(kind) for kind in problem.kinds]
    if problem.entry == "local":
        expansion = fit_local(samples, problem.degree, targets[0])
    else:
        expansion, scores = fit_best(samples, problem.degree, targets)
        if expansion.score != np.nanmin(list(scores.values())):
            return Verdict(math.inf, ("not the best score",))
    count = len(np.unique(samples.variables[:, 0], axis=0))
    return _judge(problem, expansion, samples, sampling_error(count))


def sampling_error(count: int) -> float:
    """sup |F_n - F| of the distribution of so many samples, exceeded with a probability of RISK."""
    return math.sqrt(math.log(2 / RISK) / (2 * count))


def _judge(problem: Problem, expansion: LocalExpansion, samples: Samples, allowed: float) -> Verdict:
    """Whether pressures of an expansion are distributed as those of other surfaces, to within what is allowed."""
    u, true = problem.fresh(FRESH)
    drawn = expansion.draw(np.random.default_rng([problem.number, 4]), FRESH)
    means = expansion.mean_pressure_at(u)
    largest = max(float(true.max()), float(samples.pressure.max()))
    levels = np.concatenate([[0.0], np.geomspace(1e-3, 10, 30) * largest])
    curve = cumulative(expansion, 0, hermite_basis(u[:200], expansion.indices), levels)
    low, high = distribution.wilson_interval(np.count_nonzero(drawn > 0), FRESH)
    if not all(np.isfinite(part).all() for part in (drawn, means, curve, expansion.score, expansion.cross_validated)):
        return Verdict(math.inf, ("pressures are not finite",))
    distance, limit = _distance(drawn, true), allowed + 2 * sampling_error(FRESH)
    met = {
        "the distribution": (distance, limit),
        "distances are equal": (abs(distance - distribution.kolmogorov_distance(drawn, true)), 1e-12),
        "p >= 0": (-min(drawn.min(), means.min()), 0),
        "the largest pressure": (drawn.max(), FAR * largest),
        "F falls": (-np.diff(curve).min(), 1e-12),
        "F >= 0": (-curve.min(), 0),
        "F <= 1": (curve.max(), 1 + 1e-12),
        "F of all": (1 - curve[-1], 1 - np.mean(true <= levels[-1]) + limit),
        "the interval of a probability": (max(-low, high - 1, low - high), 0),
        "errors are not negative": (-min(expansion.score, expansion.cross_validated), 0),
    }
    broken = [f"{name}: {value:.3e} for {most:.3e}" for name, (value, most) in met.items() if not value <= most]
    return Verdict(distance / limit, tuple(broken))


def _distance(first: np.ndarray, second: np.ndarray) -> float:
    """sup |F1 - F2| over all values of both, the least of ties counting with its atom."""
    values = np.unique(np.concatenate([first, second]))
    return float(
        np.max(
            np.abs(
                np.searchsorted(np.sort(first), values, "right") / len(first)
                - np.searchsorted(np.sort(second), values, "right") / len(second)
            )
        )
    )


def _enriched(problem: Problem) -> Verdict:
    """Solves doubled until the error is as asked; none is asked for twice."""
    asked: list[tuple[int, int]] = []

    def solve(first: int, last: int) -> Samples:
        asked.append((first, last))
        return problem.surfaces_of(first, last)

    def fit(samples: Samples) -> tuple[LocalExpansion, Samples]:
        return fit_local(samples, problem.degree, problem.target(problem.kinds[0])), samples

    least = min(max(problem.surfaces, 20), MOST)
    found = enrich(solve, fit, problem.asked, least=least, most=MOST, seed=[problem.seed, problem.number])
    broken = []
    if not 0 <= found.error.total <= problem.asked:
        broken.append(f"the error: {found.error.total:.3e} for {problem.asked:.3e}")
    if [first for first, _ in asked] != [0, *(last for _, last in asked[:-1])] or asked[-1][1] > MOST:
        broken.append(f"solves: {asked}")
    verdict = _judge(problem, found.expansion, found.samples, BEYOND * problem.asked)
    return Verdict(verdict.residual, (*broken, *verdict.broken))


def _in_contact(problem: Problem) -> Verdict:
    """Eqs. (8) and (9) on the samples in contact, judged at other surfaces in contact."""
    logarithm = problem.number % 8 == 0
    samples = problem.surfaces_of(0, problem.surfaces)
    indices = multi_indices(problem.variables, problem.degree)
    families = ("hermite",) * problem.variables
    pressure, u = samples.pressure[:, 0], samples.variables[:, 0]
    fit = fit_in_contact(hermite_basis(u, indices), pressure, logarithm=logarithm)
    contact = pressure > 0
    known = np.log(pressure[contact]) if logarithm else pressure[contact]
    places, true = problem.fresh(FRESH)
    places, true = places[true > 0], true[true > 0]
    if len(true) < 100:
        return Verdict(0.0)
    squares = (product_terms(families, indices, places) @ fit.coefficients - (np.log(true) if logarithm else true)) ** 2
    count = len(np.unique(u[contact], axis=0))
    told = max(fit.corrected_leave_one_out, fit.error_bound) * float(np.var(known))
    error = seen_error(squares, count)
    allowed = beyond(count - len(indices)) * told + (1e-13 * float(np.max(np.abs(known)))) ** 2
    broken = () if error <= allowed else (f"the error at fresh surfaces: {error:.3e} for {allowed:.3e}",)
    return Verdict(error / allowed, broken)
