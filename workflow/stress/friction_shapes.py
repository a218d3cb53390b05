"""The judge of laws fitted to windows: quantiles by sorting, scipy's distributions, and shapes nearby that must not fit
better.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from scipy import stats

from roughslip.friction.distribution_families import Candidate
from roughslip.friction.marginal import PROBABILITIES, SHAPES, BetaDistance, BetaFit, ScaledBeta
from workflow.stress.friction_judge import EPS, Met, counted, interval, lost, rows_seen
from workflow.stress.friction_problem import Problem

SAMPLE_FIT, TABLE_FIT = 1e-7, 3e-3  # of the squared distance: least squares for the sample, a table for replicates
GRID = 25
FINE = 1e-3  # of a distance on 1001 points
TABLE_STEP = 0.01  # of skewness


def quantiles_of(mu: np.ndarray, valid: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """(nodes,) least windows of which a share of (2 k + 1) / (2 nodes) lies at or below."""
    x = np.sort(counted(mu, valid, counts))
    nodes = len(PROBABILITIES)
    ranks = [max(-(-(2 * k + 1) * len(x) // (2 * nodes)), 1) - 1 for k in range(nodes)]
    return x[ranks]


def quantiles_scatter(problem: Problem, weights: np.ndarray, least: float) -> bool:
    """Whether the quantiles scatter beyond doubt in every replicate; an outlier alone is not among them."""
    centre = abs(float(np.mean(problem.mu[problem.valid])))
    return all(float(np.std(quantiles_of(problem.mu, problem.valid, row))) > least * centre for row in weights)


def _standard(x: np.ndarray) -> np.ndarray:
    return (x - x.mean()) / x.std()


def _misfit(standard: np.ndarray, model: np.ndarray) -> float:
    """1 - correlation^2, without cancellation."""
    z = _standard(model)
    r = float(np.mean(standard * z))
    return float(np.mean((standard - r * z) ** 2))


@lru_cache(maxsize=1)
def _beta_grid() -> list[np.ndarray]:
    shapes = np.geomspace(*SHAPES, GRID)
    return [stats.beta.ppf(PROBABILITIES, a, b) for a in shapes for b in shapes]


def judge_beta(problem: Problem, found: BetaFit, weights: np.ndarray) -> Met:
    """Ends from the mean of the quantiles, the distance as told, and no shape of a grid or nearby with a lesser one."""
    met: Met = {}
    for name in ("a", "b", "lower", "upper"):
        met |= {f"{name}: {what}": limits for what, limits in interval(getattr(found, name)).items()}
    for row in rows_seen(problem, weights)[:2]:
        q = quantiles_of(problem.mu, problem.valid, weights[row])
        standard, a, b = _standard(q).astype(float), float(found.a.rows[row]), float(found.b.rows[row])
        lower, upper = float(found.lower.rows[row]), float(found.upper.rows[row])
        model = stats.beta.ppf(PROBABILITIES, a, b)
        misfit = _misfit(standard, model)
        slack = 1e-9 + 64 * EPS * float(np.abs(q).max() / q.std())
        spread = float(q.std())
        near = [
            stats.beta.ppf(PROBABILITIES, *np.clip((a * s, b * t), *SHAPES))
            for s in (0.95, 1.0, 1.05)
            for t in (0.95, 1.0, 1.05)
        ]
        least = min(_misfit(standard, other) for other in (*near, *_beta_grid()))
        which = "sample" if row == 0 else "replicate"
        fitted = lower + (upper - lower) * model
        met |= {
            f"distance, {which}": (abs(float(found.distance.rows[row]) ** 2 - misfit), 1e-9 + slack),
            f"no nearer Beta, {which}": (misfit - least, (SAMPLE_FIT if row == 0 else TABLE_FIT) + slack),
            f"its mean, {which}": (abs(fitted.mean() - float(q.mean())) / spread, slack),
            f"its ends, {which}": (
                abs(np.mean(standard * (fitted - float(q.mean()))) / spread - 1 + misfit),
                1e-6 + slack,
            ),
            f"shapes, {which}": (max(a, b) - SHAPES[1], 1e-9 * SHAPES[1]),
            f"shapes, {which}, least": (SHAPES[0] - min(a, b), 1e-9),
        }
        if row == 0:
            at_end = min(a / SHAPES[0], b / SHAPES[0], SHAPES[1] / a, SHAPES[1] / b) < 1.0005
            met["told at a bound"] = (float(at_end and not found.at_bound), 0)
    return met


def judge_candidates(problem: Problem, found: dict[str, Candidate], weights: np.ndarray) -> Met:
    """Distances as told, and no member of the family a step away that is nearer."""
    met: Met = {}
    for row in rows_seen(problem, weights)[:2]:
        q = quantiles_of(problem.mu, problem.valid, weights[row])
        standard = _standard(q).astype(float)
        slack = 1e-9 + 64 * EPS * float(np.abs(q).max() / q.std())
        for family, candidate in found.items():
            skewness = float(candidate.skewness.rows[row])
            misfit = _misfit(standard, _member(family, skewness))
            steps = () if family == "normal" else (-TABLE_STEP, TABLE_STEP, -skewness, 1 - skewness, -1 - skewness)
            others = [_member(family, skewness + step) for step in steps if abs(skewness + step) <= 2 + 1e-9]
            least = min((_misfit(standard, other) for other in others), default=math.inf)
            met |= {
                f"{family}: distance, row {row}": (
                    abs(float(candidate.distance.rows[row]) ** 2 - misfit),
                    1e-9 + slack,
                ),
                f"{family}: no nearer, row {row}": (misfit - least, slack),
            }
    return met


def _member(family: str, skewness: float) -> np.ndarray:
    """Quantiles of the member of this skewness."""
    sign, size = math.copysign(1.0, skewness), abs(skewness)
    p = PROBABILITIES if sign > 0 else 1 - PROBABILITIES
    if family == "normal" or size < 1e-9:
        return stats.norm.ppf(PROBABILITIES)
    if family == "gamma":
        return sign * stats.gamma.ppf(p, 4 / size**2)
    u = 2 * math.sinh(math.asinh(0.5 * size) / 3)  # u^3 + 3 u = skewness
    return sign * stats.lognorm.ppf(p, math.sqrt(math.log1p(u**2)))


def judge_scaled(problem: Problem, found: ScaledBeta, weights: np.ndarray) -> Met:
    """Shapes from mean and variance of what is scaled by its least and its largest."""
    met: Met = {}
    centre = float(np.mean(problem.mu[problem.valid]))
    for row in rows_seen(problem, weights):
        x = counted(problem.mu, problem.valid, weights[row])
        low, high = x.min(), x.max()
        mean, variance = (x.mean() - low) / (high - low), x.var() / (high - low) ** 2
        total = mean * (1 - mean) / variance - 1
        slack = 1e-11 + 16 * lost(x, centre) * float((total + 1) / total)
        met |= {
            f"a, row {row}": (abs(found.a.rows[row] - mean * total), slack * (1 + total)),
            f"b, row {row}": (abs(found.b.rows[row] - (1 - mean) * total), slack * (1 + total)),
            f"its ends, row {row}": (abs(found.lower.rows[row] - low) + abs(found.upper.rows[row] - high), 0),
        }
    return met


def two_values(problem: Problem, weights: np.ndarray) -> bool:
    """Whether some row has the same two values alone."""
    return any(len(np.unique(problem.mu[problem.valid & (row > 0)[:, None]])) <= 2 for row in weights)


def judge_distance(problem: Problem, found: BetaDistance, weights: np.ndarray, a: float, b: float) -> Met:
    """Kolmogorov distances from both sides of every step, which 1001 points may miss by a thousandth."""
    met: Met = {}
    law = stats.beta(a, b)
    for row in rows_seen(problem, weights)[:2]:
        x = np.sort(counted(problem.mu, problem.valid, weights[row]))
        for name, scaled in (
            ("standardised", law.mean() + law.std() * (x - x.mean()) / x.std()),
            ("scaled", (x - x[0]) / (x[-1] - x[0])),
        ):
            # a point of the law within rounding of a step falls to either side
            near = 64 * lost(x, float(np.mean(problem.mu[problem.valid])))
            below, above = (law.cdf((scaled + step).astype(float)) for step in (-near, near))
            n = len(x)
            after = np.searchsorted(x, x, side="right") / n
            before = np.searchsorted(x, x, side="left") / n
            largest = max(np.max(after - below), np.max(above - before), 0.0)
            least = max(np.max(after - above), np.max(below - before), 0.0)
            told = float(getattr(found, name).rows[row])
            met |= {
                f"{name}, row {row}, too large": (told - largest, 1e-9),
                f"{name}, row {row}, too small": (least - told, FINE + 1e-9),
            }
    return met
