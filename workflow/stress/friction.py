"""Campaign of friction: Beta distributions fitted to random windows, each judged by a plain search.

Problems include one strip, one window, strips without contact, friction without scatter or of two values, and outliers.
No Beta distribution of a grid or nearby, with scipy's quantiles, may be nearer to the windows than the fitted one.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy import stats

from roughslip.errors import IllPosedError
from roughslip.friction.marginal import PROBABILITIES, SHAPES, BetaFit, fit_beta
from roughslip.friction.statistics import FEWEST_REPLICATES, strip_weights
from workflow.stress.runner import Conditions, Problem, Verdict, choose, log_uniform, unless, verdict_of

KINDS = ("rough", "dilute", "shaped", "outlier", "two-values", "constant", "nearly-constant", "none", "long")
KIND_SHARES = (0.3, 0.12, 0.2, 0.06, 0.05, 0.06, 0.06, 0.03, 0.12)
MOST_STRIPS, MOST_WINDOWS = 25, 150

EPS = float(np.finfo(float).eps)
GRID = 25  # Beta shapes on each axis
SAMPLE_FIT, TABLE_FIT = 1e-7, 3e-3  # of the squared distance: least squares for the sample, a table for replicates


def problem(seed: int, number: int) -> Problem:
    """Return the problem of this number. With full contact and eight windows of eight strips an error is no answer."""
    generator = np.random.default_rng([seed, number])
    kind = choose(generator, KINDS, KIND_SHARES)
    strips = int(generator.integers(1, 4)) if generator.random() < 0.12 else int(generator.integers(2, MOST_STRIPS + 1))
    mu, valid = windows_of(generator, kind, strips, round(MOST_WINDOWS ** generator.random()))

    def weights() -> np.ndarray:
        return strip_weights(strips, FEWEST_REPLICATES + number % 20, np.random.default_rng(number))

    return Problem(
        {"kind": kind},
        lambda: fit_beta(mu, valid, weights()),
        lambda fit: judge(fit, mu, valid, weights()),
        unless(kind in ("rough", "shaped") and bool(valid.all()) and min(mu.shape) >= 8, IllPosedError),
    )


def windows_of(generator: np.random.Generator, kind: str, strips: int, windows: int) -> tuple[np.ndarray, np.ndarray]:
    """Draw friction (S, W) of windows, correlated along the strip, and which windows have contact."""
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


def judge(fit: BetaFit, mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> Verdict:
    """Return the verdict on the fit to the sample and to the last replicate; no shape nearby may fit better."""
    ends = [end for estimate in (fit.a, fit.b, fit.lower, fit.upper) for end in (estimate.low, estimate.high)]
    conditions: Conditions = {"finite intervals": (float(not np.isfinite(ends).all()), 0)}
    nodes = len(PROBABILITIES)
    for row in (0, len(weights) - 1):
        x = np.sort(np.repeat(mu, weights[row], axis=0)[np.repeat(valid, weights[row], axis=0)])
        # The least window with a share of (2 k + 1) / (2 nodes) of all windows at or below it.
        q = x[[max(-(-(2 * k + 1) * len(x) // (2 * nodes)), 1) - 1 for k in range(nodes)]].astype(np.longdouble)
        standard, spread, a, b = _standard(q), float(q.std()), fit.a.rows[row], fit.b.rows[row]
        model = stats.beta.ppf(PROBABILITIES, a, b)
        misfit = _misfit(standard, model)
        steps = (0.95, 1.0, 1.05)
        near = [stats.beta.ppf(PROBABILITIES, *np.clip((a * s, b * t), *SHAPES)) for s in steps for t in steps]
        least = min(_misfit(standard, other) for other in (*near, *_beta_grid()))
        lower, upper = float(fit.lower.rows[row]), float(fit.upper.rows[row])
        fitted = lower + (upper - lower) * model
        regression = np.mean(standard * (fitted - float(q.mean()))) / spread
        slack = 1e-9 + 64 * EPS * float(np.abs(q).max()) / spread
        conditions |= {
            f"distance, row {row}": (abs(float(fit.distance.rows[row]) ** 2 - misfit), 1e-9 + slack),
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
