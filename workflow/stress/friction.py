"""Stress campaign of friction: random windows, fits to them, and friction paths, each answer judged.

`python -m workflow.stress.friction -j 2 --output results/stress/friction.json` runs the campaign; `--only 17` runs one
problem. One problem in four is of friction paths (`friction_paths`), the others of statistics of windows
(`friction_windows`), of autocorrelations, and of fits (`friction_fits`).
"""

from __future__ import annotations

import sys
from functools import partial

import numpy as np

from roughslip.errors import IllPosedError, RoughslipError
from roughslip.friction.correlation import autocorrelation, correlation_fit
from roughslip.friction.marginal import fit_beta
from roughslip.friction.resampling import NO_SCATTER, strip_weights
from roughslip.friction.statistics import window_statistics
from workflow.evidence.rows import Row
from workflow.stress import friction_fits, friction_paths, runner
from workflow.stress.friction_windows import MARGIN, WindowProblem, judge_statistics, random_problem, scatters
from workflow.stress.runner import Conditions, Verdict, has_advice, verdict_of

STAGE = "friction"
PROBLEMS = 2000
PATHS = 4  # One problem in so many is of paths.


def row_of(seed: int, number: int) -> Row:
    """Return the row of the problem of this number."""
    if number % PATHS == 0:
        path = friction_paths.random_problem(seed, number)
        judged_path, answers = partial(friction_paths.judged, path), partial(friction_paths.is_answer, path)
        return runner.problem_row(STAGE, runner.case_of(path), judged_path, answers)
    problem = random_problem(seed, number)
    return runner.problem_row(STAGE, runner.case_of(problem), partial(judged, problem), partial(is_answer, problem))


def weights_of(problem: WindowProblem) -> np.ndarray:
    """Return (1 + R, S) counts of the strips."""
    return strip_weights(len(problem.mu), problem.replicates, np.random.default_rng(problem.seed))


def judged(problem: WindowProblem) -> Verdict:
    """Compute the entry of a problem and judge it."""
    return verdict_of(_conditions(problem, weights_of(problem)))


def _conditions(problem: WindowProblem, weights: np.ndarray) -> Conditions:
    windows = problem.mu, problem.valid
    match problem.entry:
        case "statistics":
            return judge_statistics(problem, window_statistics(*windows, weights), weights)
        case "beta":
            return friction_fits.judge_beta(problem, fit_beta(*windows, weights), weights)
    curve = autocorrelation(*windows, problem.lags, weights)
    lags = problem.spacing * np.arange(problem.lags)
    window = problem.spacing * 10 ** np.random.default_rng(problem.seed).uniform(0.4, 2)
    return friction_fits.judge_autocorrelation(problem, curve, weights) | friction_fits.judge_lengths(
        lags, curve, window, correlation_fit(lags, curve, window)
    )


def is_answer(problem: WindowProblem, error: RoughslipError) -> bool:
    """Whether an error answers a problem: it has advice, and windows are too few or do not scatter."""
    if not (isinstance(error, IllPosedError) and has_advice(error)):
        return False
    if len(problem.mu) < 2:
        return True
    weights = weights_of(problem)
    if not scatters(problem.mu, problem.valid, weights):
        return True
    match problem.entry:
        case "autocorrelation":
            return not friction_fits.has_pairs(problem, weights)
        case "beta":
            return not friction_fits.quantiles_scatter(problem, weights, MARGIN * NO_SCATTER)
    return False


if __name__ == "__main__":
    sys.exit(runner.command(__doc__, STAGE, row_of, PROBLEMS))
