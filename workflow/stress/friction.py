"""Stress campaign of friction: lengths and Beta distributions fitted to random windows, each judged by plain searches.

Problems include one strip, one window, strips without contact, friction without scatter or of two values, and outliers.
No length of a table may be nearer to the autocorrelation than the fitted one, and no Beta distribution of a grid or
nearby, with scipy's quantiles, nearer to the windows.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import stats

from roughslip.errors import IllPosedError, RoughslipError
from roughslip.friction.correlation import CorrelationFit, autocorrelation, correlation_fit
from roughslip.friction.marginal import PROBABILITIES, SHAPES, BetaFit, fit_beta
from roughslip.friction.resampling import FEWEST_REPLICATES, strip_weights
from roughslip.probability import Estimate
from workflow.evidence.rows import Row
from workflow.stress import runner
from workflow.stress.runner import Conditions, Verdict, choose, has_advice, log_uniform, verdict_of

STAGE = "friction"
PROBLEMS = 2000

ENTRIES = ("lengths", "beta")
KINDS = ("rough", "dilute", "shaped", "outlier", "two-values", "constant", "nearly-constant", "none", "long")
KIND_SHARES = (0.3, 0.12, 0.2, 0.06, 0.05, 0.06, 0.06, 0.03, 0.12)
MOST_STRIPS, MOST_WINDOWS = 25, 150

EPS = float(np.finfo(float).eps)
TRIALS, GRID = 4001, 25  # lengths, and Beta shapes on each axis
THREE, HALF = 3.0, 0.5  # windows, up to which lags enter
SAMPLE_FIT, TABLE_FIT = 1e-7, 3e-3  # of the squared distance: least squares for the sample, a table for replicates


@dataclass(frozen=True)
class WindowProblem:
    """Windows of strips.

    number, entry, kind : of the problem, of ENTRIES and KINDS
    mu, valid : (S, W) friction of the windows, and which windows have contact
    lags, spacing, window : number of lags, their distance [m] and the length of a window [m]
    """

    number: int
    entry: str
    kind: str
    mu: np.ndarray
    valid: np.ndarray
    lags: int
    spacing: float
    window: float

    @property
    def weights(self) -> np.ndarray:
        """(1 + R, S) counts of the strips."""
        replicates = FEWEST_REPLICATES + self.number % 20
        return strip_weights(len(self.mu), replicates, np.random.default_rng(self.number))

    @property
    def is_well_posed(self) -> bool:
        """Whether a problem has a solution beyond doubt, so that no error answers it."""
        scatters = self.kind in ("rough", "shaped") and bool(self.valid.all())
        return scatters and min(self.mu.shape) >= 8 and self.lags >= 2


def random_problem(seed: int, number: int) -> WindowProblem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number])
    entry, kind = choose(generator, ENTRIES), choose(generator, KINDS, KIND_SHARES)
    strips = int(generator.integers(1, 4)) if generator.random() < 0.12 else int(generator.integers(2, MOST_STRIPS + 1))
    windows = round(MOST_WINDOWS ** generator.random())
    mu, valid = _friction(generator, kind, strips, windows)
    lags = int(generator.integers(2, windows + 1)) if windows > 1 and generator.random() < 0.9 else windows
    spacing = log_uniform(generator, -9, 2)
    window = spacing * log_uniform(generator, 0.4, 2)
    return WindowProblem(number, entry, kind, mu, valid, lags, spacing, window)


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
    """Fit the entry of a problem and judge the fit to the sample and to the last replicate."""
    if problem.entry == "beta":
        return judge_beta(problem, fit_beta(problem.mu, problem.valid, problem.weights))
    curve = autocorrelation(problem.mu, problem.valid, problem.lags, problem.weights)
    return judge_lengths(problem, curve, correlation_fit(_lags(problem), curve, problem.window))


def _lags(problem: WindowProblem) -> np.ndarray:
    return problem.spacing * np.arange(problem.lags)


def _finite(found: object, names: tuple[str, ...]) -> Conditions:
    estimates: list[Estimate] = [getattr(found, name) for name in names]
    parts = [part for one in estimates for part in (one.value, one.low, one.high, one.replicates)]
    return {"finite": (0.0 if all(np.isfinite(part).all() for part in parts) else math.inf, 0)}


def judge_lengths(problem: WindowProblem, curve: Estimate, found: CorrelationFit) -> Verdict:
    """Return the verdict on fitted lengths, on the first crossing of 1/e, and on whether a length is at its bound."""
    lags = _lags(problem)
    used, near = (int(np.sum(lags <= share * problem.window * (1 + 1e-9))) for share in (THREE, HALF))
    lags = lags[:used]
    conditions = _finite(found, ("least_squares", "half_window", "one_over_e", "integral", "misfit_difference"))
    for row in (0, len(curve.rows) - 1):
        r = curve.rows[row, :used]
        slack = 1e-9 * (1 + float(np.sum(r**2)))
        for name, count in (("least_squares", used), ("half_window", near)):
            length = float(getattr(found, name).rows[row])
            conditions[f"no better {name}, row {row}"] = (_excess(lags[:count], r[:count], length), slack)
        below = np.append(np.flatnonzero(r < math.exp(-1)), used - 1)[0]
        share = (r[below - 1] - math.exp(-1)) / (r[below - 1] - r[below]) if r[below] < math.exp(-1) else 1.0
        crossing = lags[below - 1] + share * (lags[below] - lags[below - 1])
        conditions[f"1/e, row {row}"] = (abs(float(found.one_over_e.rows[row]) - crossing) / lags[-1], 1e-12)
    ends = float(found.least_squares.value) / (100 * lags[-1]), lags[1] / 20 / float(found.least_squares.value)
    conditions["stated at a bound"] = (float((max(ends) > 1 - 1e-9) != found.at_bound), 0)
    return verdict_of(conditions)


def _excess(lags: np.ndarray, r: np.ndarray, length: float) -> float:
    """Return the squares of a length beyond the least of lengths from a 20th of the first lag to 100 times the last."""
    lengths = np.append(length, np.geomspace(lags[1] / 20, 100 * lags[-1], TRIALS))
    squares = np.sum((np.exp(-lags / lengths[:, None]) - r) ** 2, axis=1)
    return float(squares[0] - squares.min())


def judge_beta(problem: WindowProblem, found: BetaFit) -> Verdict:
    """Return the verdict on ends and distance of a Beta fit; no shape of a grid or nearby may fit better."""
    conditions = _finite(found, ("a", "b", "lower", "upper"))
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
