"""Stress campaign of friction: Beta distributions fitted to random windows, each judged by a plain search.

Problems include one strip, one window, strips without contact, friction without scatter or of two values, and outliers.
No Beta distribution of a grid or nearby, with scipy's quantiles, may be nearer to the windows than the fitted one.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import stats

from roughslip.errors import IllPosedError, RoughslipError
from roughslip.friction.marginal import PROBABILITIES, SHAPES, BetaFit, fit_beta
from roughslip.friction.statistics import FEWEST_REPLICATES, strip_weights
from workflow.evidence.rows import Row
from workflow.stress import runner
from workflow.stress.runner import Conditions, Verdict, choose, has_advice, log_uniform, verdict_of

STAGE = "friction"
PROBLEMS = 2000

KINDS = ("rough", "dilute", "shaped", "outlier", "two-values", "constant", "nearly-constant", "none", "long")
KIND_SHARES = (0.3, 0.12, 0.2, 0.06, 0.05, 0.06, 0.06, 0.03, 0.12)
MOST_STRIPS, MOST_WINDOWS = 25, 150

EPS = float(np.finfo(float).eps)
GRID = 25  # Beta shapes on each axis
SAMPLE_FIT, TABLE_FIT = 1e-7, 3e-3  # of the squared distance: least squares for the sample, a table for replicates


@dataclass(frozen=True)
class WindowProblem:
    """Windows of strips.

    number, kind : of the problem, of KINDS
    mu, valid : (S, W) friction of the windows, and which windows have contact
    """

    number: int
    kind: str
    mu: np.ndarray
    valid: np.ndarray

    @property
    def weights(self) -> np.ndarray:
        """(1 + R, S) counts of the strips."""
        replicates = FEWEST_REPLICATES + self.number % 20
        return strip_weights(len(self.mu), replicates, np.random.default_rng(self.number))

    @property
    def is_well_posed(self) -> bool:
        """Whether a problem has a solution beyond doubt, so that no error answers it."""
        return self.kind in ("rough", "shaped") and bool(self.valid.all()) and min(self.mu.shape) >= 8


def random_problem(seed: int, number: int) -> WindowProblem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number])
    kind = choose(generator, KINDS, KIND_SHARES)
    strips = int(generator.integers(1, 4)) if generator.random() < 0.12 else int(generator.integers(2, MOST_STRIPS + 1))
    windows = round(MOST_WINDOWS ** generator.random())
    return WindowProblem(number, kind, *_friction(generator, kind, strips, windows))


def _friction(generator: np.random.Generator, kind: str, strips: int, windows: int) -> tuple[np.ndarray, np.ndarray]:
    """Draw friction of windows, correlated along the strip, and which windows have contact."""
    shape = (strips, windows)
    length = log_uniform(generator, -1, 1) * (windows if kind == "long" else max(1.0, windows / 10))
    decay = np.exp(-1 / length)
    z = generator.standard_normal(shape)
    for k in range(1, windows):
        z[:, k] = decay * z[:, k - 1] + np.sqrt(1 - decay**2) * z[:, k]
    scatter = log_uniform(generator, -4, -0.5)
    match kind:
        case "shaped":
            mu = 1 + scatter * np.exp(-np.logaddexp(0, -1.7 * z)) ** log_uniform(generator, -1, 1)
        case "outlier":
            mu = np.ones(shape)
            mu.flat[int(generator.integers(mu.size))] += log_uniform(generator, -6, 3)
        case "two-values":
            mu = np.where(z > 0, 1.5, 1.0)
        case "constant":
            mu = np.ones(shape)
        case "nearly-constant":
            mu = 1 + log_uniform(generator, -15, -8) * z
        case _:
            mu = np.exp(scatter * z)
    mu = mu * log_uniform(generator, -12, 6)
    valid = np.full(shape, kind != "none")
    if kind == "dilute" or (kind != "none" and generator.random() < 0.2):
        valid = generator.random(shape) > log_uniform(generator, -2, -0.05)
    return np.where(valid, mu, 0.0), valid


def row_of(seed: int, number: int) -> Row:
    """Return the row of the problem of this number."""
    return runner.problem_row(STAGE, random_problem(seed, number), judged, is_answer)


def is_answer(problem: WindowProblem, error: RoughslipError) -> bool:
    """Whether an error answers a problem: it has advice, and windows are few, without contact or without scatter."""
    return isinstance(error, IllPosedError) and has_advice(error) and not problem.is_well_posed


def judged(problem: WindowProblem) -> Verdict:
    """Fit a Beta distribution and judge the fit."""
    return judge(problem, fit_beta(problem.mu, problem.valid, problem.weights))


def judge(problem: WindowProblem, found: BetaFit) -> Verdict:
    """Return the verdict on the fit to the sample and to the last replicate; no shape nearby may fit better."""
    ends = [end for one in (found.a, found.b, found.lower, found.upper) for end in (one.low, one.high)]
    conditions: Conditions = {"finite intervals": (float(not np.isfinite(ends).all()), 0)}
    nodes = len(PROBABILITIES)
    weights = problem.weights
    for row in (0, len(weights) - 1):
        x = np.sort(np.repeat(problem.mu, weights[row], axis=0)[np.repeat(problem.valid, weights[row], axis=0)])
        # The least window with a share of (2 k + 1) / (2 nodes) of all windows at or below it.
        q = x[[max(-(-(2 * k + 1) * len(x) // (2 * nodes)), 1) - 1 for k in range(nodes)]].astype(np.longdouble)
        standard, spread, a, b = _standard(q), float(q.std()), found.a.rows[row], found.b.rows[row]
        model = stats.beta.ppf(PROBABILITIES, a, b)
        misfit = _misfit(standard, model)
        steps = (0.95, 1.0, 1.05)
        near = [stats.beta.ppf(PROBABILITIES, *np.clip((a * s, b * t), *SHAPES)) for s in steps for t in steps]
        least = min(_misfit(standard, other) for other in (*near, *_beta_grid()))
        lower, upper = float(found.lower.rows[row]), float(found.upper.rows[row])
        fitted = lower + (upper - lower) * model
        regression = np.mean(standard * (fitted - float(q.mean()))) / spread
        slack = 1e-9 + 64 * EPS * float(np.abs(q).max()) / spread
        conditions |= {
            f"distance, row {row}": (abs(float(found.distance.rows[row]) ** 2 - misfit), 1e-9 + slack),
            f"no nearer Beta, row {row}": (misfit - least, (TABLE_FIT if row else SAMPLE_FIT) + slack),
            f"its mean, row {row}": (abs(fitted.mean() - float(q.mean())) / spread, slack),
            f"its ends, row {row}": (abs(regression - 1 + misfit), 1e-6 + slack),
            f"its shapes, row {row}": (max(a / SHAPES[1], b / SHAPES[1], SHAPES[0] / a, SHAPES[0] / b), 1 + 1e-9),
        }
    return verdict_of(conditions)


def _standard(x: np.ndarray) -> np.ndarray:
    return ((x - x.mean()) / x.std()).astype(float)


def _misfit(standard: np.ndarray, model: np.ndarray) -> float:
    """Return 1 - correlation^2, without cancellation."""
    z = _standard(model)
    return float(np.mean((standard - np.mean(standard * z) * z) ** 2))


@lru_cache(maxsize=1)
def _beta_grid() -> list[np.ndarray]:
    shapes = np.geomspace(*SHAPES, GRID)
    return [stats.beta.ppf(PROBABILITIES, a, b) for a in shapes for b in shapes]


if __name__ == "__main__":
    sys.exit(runner.command(__doc__, STAGE, row_of, PROBLEMS))
