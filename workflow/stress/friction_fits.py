"""The judge of autocorrelations, of lengths fitted to them, and of Beta distributions fitted to windows.

Autocorrelations are means over pairs, lag by lag, in long doubles. Lengths are compared with a table of lengths and
with plain searches along lags. Beta distributions are compared with scipy's and with shapes nearby, which must not fit
better.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from scipy import stats

from roughslip.friction.correlation import CorrelationFit
from roughslip.friction.marginal import PROBABILITIES, SHAPES, BetaFit
from roughslip.probability import Estimate
from workflow.stress.friction_windows import EPS, WindowProblem, counted, interval_conditions, judged_rows, lost
from workflow.stress.runner import Conditions

TRIALS = 4001
THREE, HALF = 3.0, 0.5  # windows, up to which lags enter
SAMPLE_FIT, TABLE_FIT = 1e-7, 3e-3  # of the squared distance: least squares for the sample, a table for replicates
GRID = 25


def judge_autocorrelation(problem: WindowProblem, found: Estimate, weights: np.ndarray) -> Conditions:
    """Return conditions on the autocorrelation of the sample and of replicates."""
    mu, valid = problem.mu, problem.valid
    conditions: Conditions = {"r(0)": (np.max(np.abs(found.rows[:, 0] - 1)), 0)}
    centre = float(np.mean(mu[valid]))
    for which, row in judged_rows(problem, weights).items():
        rows = np.repeat(np.arange(len(mu)), weights[row])
        exact = _mean_over_pairs(mu[rows], valid[rows], problem.lags)
        slack = lost(counted(mu, valid, weights[row]), centre)
        largest = 1 + float(np.max(np.abs(exact)))
        conditions[f"r, {which}"] = (np.max(np.abs(found.rows[row] - exact)), largest * (1e-12 + 8 * slack))
    return conditions


def _mean_over_pairs(mu: np.ndarray, valid: np.ndarray, lags: int) -> np.ndarray:
    """Return the autocorrelation (lags,) in long doubles."""
    x = np.where(valid, mu.astype(np.longdouble) - mu[valid].astype(np.longdouble).mean(), 0)
    found = []
    for k in range(lags):
        pairs = valid[:, : x.shape[1] - k] & valid[:, k:]
        found.append(np.sum(np.where(pairs, x[:, : x.shape[1] - k] * x[:, k:], 0)) / pairs.sum())
    return np.array(found) / found[0]


def has_pairs(problem: WindowProblem, weights: np.ndarray) -> bool:
    """Whether every lag has a pair in every replicate."""
    valid, lags = problem.valid, problem.lags
    windows = valid.shape[1]
    if not 2 <= lags <= windows:
        return False
    pairs = np.stack([(valid[:, : windows - k] & valid[:, k:]).sum(axis=1) for k in range(lags)], axis=1)
    return bool((weights @ pairs > 0).all())


def judge_lengths(lags: np.ndarray, curve: Estimate, window: float, found: CorrelationFit) -> Conditions:
    """Return conditions on fitted lengths, on the first crossing of 1/e, and on whether a length is at its bound.

    lags : (K,) [m] of the autocorrelation; window [m]
    """
    used, near = (int(np.sum(lags <= share * window * (1 + 1e-9))) for share in (THREE, HALF))
    lags = lags[:used]
    conditions = interval_conditions(
        found, ("least_squares", "half_window", "one_over_e", "integral", "misfit_difference")
    )
    for row in (0, len(curve.rows) - 1):
        r = curve.rows[row, :used]
        whole, half = float(found.least_squares.rows[row]), float(found.half_window.rows[row])
        slack = 1e-9 * (1 + float(np.sum(r**2)))
        excess = _loss(lags[:near], r[:near], half) - _least(lags[:near], r[:near])
        conditions |= {
            f"no better length, row {row}": (_loss(lags, r, whole) - _least(lags, r), slack),
            f"half a window, row {row}": (excess, slack),
            f"1/e, row {row}": (abs(float(found.one_over_e.rows[row]) - _one_over_e(lags, r)) / lags[-1], 1e-12),
        }
    ends = float(found.least_squares.value) / (100 * lags[-1]), lags[1] / 20 / float(found.least_squares.value)
    conditions["stated at a bound"] = (float((max(ends) > 1 - 1e-9) != found.at_bound), 0)
    return conditions


def _loss(lags: np.ndarray, r: np.ndarray, length: float) -> float:
    return float(np.sum((np.exp(-lags / length) - r) ** 2))


def _least(lags: np.ndarray, r: np.ndarray) -> float:
    """Return the least loss on a table of lengths from a 20th of the first lag to 100 times the last."""
    lengths = np.geomspace(lags[1] / 20, 100 * lags[-1], TRIALS)
    return float(np.min(np.sum((np.exp(-lags / lengths[:, None]) - r) ** 2, axis=1)))


def _one_over_e(lags: np.ndarray, r: np.ndarray) -> float:
    """Return the first crossing of 1/e, from lag to lag; the last lag without one."""
    for k in range(1, len(r)):
        if r[k] < math.exp(-1):
            share = (r[k - 1] - math.exp(-1)) / (r[k - 1] - r[k])
            return float(lags[k - 1] + share * (lags[k] - lags[k - 1]))
    return float(lags[-1])


def quantiles_of(mu: np.ndarray, valid: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return (nodes,) the least window with a share of (2 k + 1) / (2 nodes) of all windows at or below it."""
    x = np.sort(counted(mu, valid, counts))
    nodes = len(PROBABILITIES)
    return x[[max(-(-(2 * k + 1) * len(x) // (2 * nodes)), 1) - 1 for k in range(nodes)]]


def quantiles_scatter(problem: WindowProblem, weights: np.ndarray, least: float) -> bool:
    """Whether the quantiles scatter beyond doubt in every replicate; a single outlier is not among them."""
    centre = abs(float(np.mean(problem.mu[problem.valid])))
    return all(float(np.std(quantiles_of(problem.mu, problem.valid, row))) > least * centre for row in weights)


def _standard(x: np.ndarray) -> np.ndarray:
    return (x - x.mean()) / x.std()


def _misfit(standard: np.ndarray, model: np.ndarray) -> float:
    """Return 1 - correlation^2, without cancellation."""
    z = _standard(model)
    r = float(np.mean(standard * z))
    return float(np.mean((standard - r * z) ** 2))


@lru_cache(maxsize=1)
def _beta_grid() -> list[np.ndarray]:
    shapes = np.geomspace(*SHAPES, GRID)
    return [stats.beta.ppf(PROBABILITIES, a, b) for a in shapes for b in shapes]


def judge_beta(problem: WindowProblem, found: BetaFit, weights: np.ndarray) -> Conditions:
    """Return conditions on ends and distance of a Beta fit; no shape of a grid or nearby may fit better."""
    conditions = interval_conditions(found, ("a", "b", "lower", "upper"))
    for which, row in list(judged_rows(problem, weights).items())[:2]:
        q = quantiles_of(problem.mu, problem.valid, weights[row])
        standard, a, b = _standard(q).astype(float), float(found.a.rows[row]), float(found.b.rows[row])
        lower, upper = float(found.lower.rows[row]), float(found.upper.rows[row])
        model = stats.beta.ppf(PROBABILITIES, a, b)
        misfit, spread = _misfit(standard, model), float(q.std())
        slack = 1e-9 + 64 * EPS * float(np.abs(q).max()) / spread
        steps = (0.95, 1.0, 1.05)
        near = [stats.beta.ppf(PROBABILITIES, *np.clip((a * s, b * t), *SHAPES)) for s in steps for t in steps]
        least = min(_misfit(standard, other) for other in (*near, *_beta_grid()))
        fitted = lower + (upper - lower) * model
        regression = np.mean(standard * (fitted - float(q.mean()))) / spread
        conditions |= {
            f"distance, {which}": (abs(float(found.distance.rows[row]) ** 2 - misfit), 1e-9 + slack),
            f"no nearer Beta, {which}": (misfit - least, (SAMPLE_FIT if row == 0 else TABLE_FIT) + slack),
            f"its mean, {which}": (abs(fitted.mean() - float(q.mean())) / spread, slack),
            f"its ends, {which}": (abs(regression - 1 + misfit), 1e-6 + slack),
            f"largest shape, {which}": (max(a, b) - SHAPES[1], 1e-9 * SHAPES[1]),
            f"least shape, {which}": (SHAPES[0] - min(a, b), 1e-9),
        }
        if row == 0:
            at_end = min(a / SHAPES[0], b / SHAPES[0], SHAPES[1] / a, SHAPES[1] / b) < 1.0005
            conditions["stated at a bound"] = (float(at_end and not found.at_bound), 0)
    return conditions
