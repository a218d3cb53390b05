"""Random friction of windows, and bad input: every answer is judged, every failure is told by its number.

`python -m workflow.stress.friction -j 2 --output results/stress/friction.json` runs the campaign, `--only 17` one of
it. Of four problems one is of friction paths, the others of windows, of their statistics and of the laws fitted to
them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial

import numpy as np

from roughslip.errors import IllPosedError, RoughslipError
from roughslip.friction.bowden_tabor import friction_coefficient, window_sums
from roughslip.friction.correlation import autocorrelation, correlation_fit
from roughslip.friction.distribution_families import fit_candidates
from roughslip.friction.marginal import distance_to_beta, fit_beta, scaled_beta
from roughslip.friction.resampling import NO_SCATTER, strip_weights
from roughslip.friction.statistics import combine, window_statistics
from workflow.benchmarks.measure import case
from workflow.stress import friction_lengths, friction_paths, friction_penetration, outcomes
from workflow.stress.friction_judge import (
    MARGIN,
    Met,
    combined,
    has_pairs,
    has_strips,
    judge_autocorrelation,
    judge_combined,
    judge_statistics,
    judge_sums,
    scatters,
)
from workflow.stress.friction_problem import Problem, random_problem
from workflow.stress.friction_refusals import REFUSED
from workflow.stress.friction_shapes import (
    judge_beta,
    judge_candidates,
    judge_distance,
    judge_scaled,
    quantiles_scatter,
    two_values,
)
from workflow.stress.outcomes import Row, Verdict, advised, verdict_of

STAGE = "friction"
CLASSES = ("entry", "kind")
PROBLEMS = 2000
SHARE = 4


def rows_of(seed: int, number: int) -> list[Row]:
    """The row of the problem of this number."""
    if number % SHARE == 0:
        path = friction_paths.random_problem(seed, number)
        return [
            outcomes.problem_row(
                STAGE,
                friction_paths.case_of(path),
                partial(friction_paths.judged, path),
                partial(friction_paths.honest, path),
            )
        ]
    problem = random_problem(seed, number)
    return [outcomes.problem_row(STAGE, case_of(problem), partial(judged, problem), partial(honest, problem))]


def refused() -> list[Row]:
    """A row for each kind of bad input."""
    return [
        outcomes.refusal_row(STAGE, case(entry="refused", input=name.replace(" ", "-")), call)
        for name, call in REFUSED.items()
    ]


def case_of(problem: Problem) -> str:
    strips, columns = problem.area.shape
    return case(
        number=problem.number,
        entry=problem.entry,
        kind="none" if problem.entry == "law" else problem.kind,
        strips=strips,
        columns=columns,
        window=problem.window,
        stride=problem.stride,
        windows=problem.mu.shape[1],
        missing=int((~problem.valid).sum()),
        lags=problem.lags,
        size=f"{np.max(np.abs(problem.mu), initial=0.0):.3g}",
        tolerance=1,
    )


def weights_of(problem: Problem) -> np.ndarray:
    """(1 + R, S) counts of the strips."""
    return strip_weights(len(problem.mu), problem.replicates, np.random.default_rng(problem.seed))


def judged(problem: Problem) -> Verdict:
    """What is asked of the windows, and its judge."""
    return verdict_of(JUDGED[problem.entry](problem))


def _sums(problem: Problem) -> Met:
    area, force = (window_sums(part, problem.window, problem.stride) for part in (problem.area, problem.force))
    mu, valid = friction_coefficient(area, force, problem.strength, problem.least_area)
    return judge_sums(problem, area, force, mu, valid)


def _statistics(problem: Problem) -> Met:
    weights = weights_of(problem)
    return judge_statistics(problem, window_statistics(problem.mu, problem.valid, weights), weights)


def _autocorrelation(problem: Problem) -> Met:
    weights = weights_of(problem)
    curve = autocorrelation(problem.mu, problem.valid, problem.lags, weights)
    met = judge_autocorrelation(problem, curve, weights)
    lags = problem.spacing * np.arange(problem.lags)
    window = problem.spacing * 10 ** np.random.default_rng(problem.seed).uniform(0.4, 2)
    return met | friction_lengths.judge(lags, curve, window, correlation_fit(lags, curve, window))


def _beta(problem: Problem) -> Met:
    weights = weights_of(problem)
    return judge_beta(problem, fit_beta(problem.mu, problem.valid, weights), weights)


def _candidates(problem: Problem) -> Met:
    weights = weights_of(problem)
    return judge_candidates(problem, fit_candidates(problem.mu, problem.valid, weights), weights)


def _scaled(problem: Problem) -> Met:
    weights = weights_of(problem)
    return judge_scaled(problem, scaled_beta(problem.mu, problem.valid, weights), weights)


def _distance(problem: Problem) -> Met:
    weights = weights_of(problem)
    a, b = 10 ** np.random.default_rng(problem.seed).uniform(-0.3, 1.5, 2)
    return judge_distance(problem, distance_to_beta(problem.mu, problem.valid, weights, a, b), weights, a, b)


def _combine(problem: Problem) -> Met:
    strips, weights = len(problem.mu), weights_of(problem)
    many = strip_weights(len(problem.control) - strips, problem.replicates, np.random.default_rng(problem.seed))
    found = combine(
        (problem.mu, problem.valid),
        (problem.control[:strips], problem.control_valid[:strips]),
        (problem.control[strips:], problem.control_valid[strips:]),
        weights,
        many,
    )
    return judge_combined(problem, found, weights, many)


def _law(problem: Problem) -> Met:
    return friction_penetration.judged(problem.seed)


JUDGED: dict[str, Callable[[Problem], Met]] = {
    "sums": _sums,
    "statistics": _statistics,
    "autocorrelation": _autocorrelation,
    "beta": _beta,
    "candidates": _candidates,
    "scaled": _scaled,
    "distance": _distance,
    "combine": _combine,
    "law": _law,
}


def honest(problem: Problem, error: RoughslipError) -> bool:
    """Whether an error answers a problem: windows too few or without scatter, and advice."""
    if not (isinstance(error, IllPosedError) and advised(error)):
        return False
    if problem.entry in ("sums", "law"):
        return False
    if len(problem.mu) < 2:
        return True
    weights = weights_of(problem)
    if not scatters(problem.mu, problem.valid, weights):
        return True
    match problem.entry:
        case "autocorrelation":
            return not has_pairs(problem, weights)
        case "beta" | "candidates":
            return not quantiles_scatter(problem, weights, MARGIN * NO_SCATTER)
        case "scaled":
            return two_values(problem, weights)
        case "combine":
            return not _combines(problem, weights)
    return False


def _combines(problem: Problem, weights: np.ndarray) -> bool:
    """Whether a control may be told to be of use: it and the windows scatter within and between strips."""
    strips = len(problem.mu)
    many = strip_weights(len(problem.control) - strips, problem.replicates, np.random.default_rng(problem.seed))
    parts = (
        (problem.control[:strips], problem.control_valid[:strips], weights),
        (problem.control[strips:], problem.control_valid[strips:], many),
    )
    if not all(has_strips(valid, rows) and scatters(control, valid, rows) for control, valid, rows in parts):
        return False
    rows = [combined(problem, weights, many, row) for row in range(len(weights))]
    return all(rows[0][k] is not None for k in range(2)) and all(row[0] is None or row[0].theta > 0 for row in rows)


def main() -> int:
    return outcomes.command(__doc__, STAGE, rows_of, refused, CLASSES, PROBLEMS)


if __name__ == "__main__":
    sys.exit(main())
