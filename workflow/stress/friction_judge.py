"""The judge of window statistics: textbook formulas in long doubles on the windows themselves, strips repeated as
often as a resampled row counts them.

A centred moment of windows whose scatter is s and whose mean is m has lost m / s of its digits; a replicate far from
the sample's mean loses more.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from roughslip.friction.resampling import CANCELLED, FEWEST_REPLICATES, NO_SCATTER
from roughslip.friction.statistics import PERCENTS, Combined, WindowStatistics
from roughslip.probability import TAILS, Estimate
from workflow.stress.friction_problem import Problem

EPS = float(np.finfo(float).eps)
Met = dict[str, tuple[float, float]]
MARGIN = 3.0  # about the least scatter, within which either answer is right


def counted(mu: np.ndarray, valid: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """(n,) windows with friction of a resampled row, in long doubles, strip by strip."""
    return np.repeat(mu, counts, axis=0)[np.repeat(valid, counts, axis=0)].astype(np.longdouble)


def rows_seen(problem: Problem, weights: np.ndarray) -> list[int]:
    """The sample, a replicate of the middle and the last one."""
    return [0, 1 + problem.number % (len(weights) - 1), len(weights) - 1]


def interval(estimate: Estimate) -> Met:
    """What every percentile interval must meet."""
    ends = np.quantile(estimate.replicates, TAILS, axis=-1)
    scale = np.max(np.abs(estimate.replicates), initial=0.0) or 1.0
    right = all(np.isfinite(part).all() for part in (estimate.value, estimate.low, estimate.high, estimate.replicates))
    return {
        "finite": (0.0 if right else math.inf, 0),
        "its interval": (
            max(np.max(np.abs(estimate.low - ends[0])), np.max(np.abs(estimate.high - ends[1]))) / scale,
            1e-12,
        ),
        "its ends": (np.max(estimate.low - estimate.high) / scale, 0),
        "replicates": (abs(FEWEST_REPLICATES - min(estimate.replicates.shape[-1], FEWEST_REPLICATES)), 0),
    }


def has_strips(valid: np.ndarray, weights: np.ndarray) -> bool:
    """Whether two strips and every replicate have a window with friction."""
    some = valid.any(axis=1)
    return bool(some.sum() >= 2 and (weights @ some > 0).all())


def scatter_over_least(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(1 + R,) standard deviation over the least that counts as one, beside the mean and its distance from all's."""
    centre = float(np.mean(mu[valid]))
    rows = [counted(mu, valid, row) for row in weights]
    return np.array([float(x.std() / max(NO_SCATTER * abs(centre), CANCELLED * abs(x.mean() - centre))) for x in rows])


def scatters(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> bool:
    """Whether windows scatter beyond doubt in every replicate."""
    return has_strips(valid, weights) and bool((scatter_over_least(mu, valid, weights) > MARGIN).all())


def lost(x: np.ndarray, centre: float) -> float:
    """What rounding may change of moments of windows x : (n,) about a centre, over their scatter."""
    std, mean = float(np.std(x)), float(np.mean(x))
    shift = 1 + ((mean - centre) / std) ** 2
    largest = float(np.max(np.abs(x - mean))) / std
    return 64 * EPS * (abs(mean) / std + (shift * largest) ** 2 + shift**2 + len(x))


def judge_statistics(problem: Problem, found: WindowStatistics, weights: np.ndarray) -> Met:
    """Moments, quantiles, effective and missing windows of the sample and of replicates."""
    mu, valid = problem.mu, problem.valid
    centre = float(np.mean(mu[valid]))
    met: Met = {
        "windows": (abs(found.windows - mu.size), 0),
        "missing": (abs(found.missing - int((~valid).sum())), 0),
    }
    for name in ("mean", "std", "variation", "skewness", "kurtosis", "quantiles", "effective_windows", "missing_share"):
        met |= {f"{name}: {what}": limits for what, limits in interval(getattr(found, name)).items()}
    for row in rows_seen(problem, weights):
        counts = weights[row]
        x = counted(mu, valid, counts)
        mean, std, n = x.mean(), x.std(), len(x)
        score = (x - mean) / std
        slack, tails = lost(x, centre), float(np.mean(score**4))
        per_strip = np.array([float(np.sum(mu[s][valid[s]].astype(np.longdouble) - mean)) for s in range(len(mu))])
        of_mean = len(mu) / (len(mu) - 1) * float(np.sum(counts * per_strip**2)) / n**2
        effective = float(std**2) / max(of_mean, float(std**2) / n)
        ranked = np.sort(x)[[max(math.ceil(p * n / 100), 1) - 1 for p in PERCENTS]]

        def at(name: str, row: int = row) -> np.ndarray:
            return getattr(found, name).rows[row]

        which = "sample" if row == 0 else "replicate"
        met |= {
            f"mean, {which}": (abs(at("mean") / mean - 1), 1e-13 + n * EPS),
            f"std, {which}": (abs(at("std") / std - 1), 1e-13 + slack),
            f"variation, {which}": (abs(at("variation") * mean / std - 1), 1e-12 + slack),
            f"skewness, {which}": (abs(at("skewness") - np.mean(score**3)), (1 + tails) * (1e-12 + 4 * slack)),
            f"kurtosis, {which}": (abs(at("kurtosis") - tails + 3), (1 + tails) * (1e-12 + 4 * slack)),
            f"quantiles, {which}": (np.max(np.abs(at("quantiles") - ranked)), 0),
            f"effective windows, {which}": (abs(at("effective_windows") / effective - 1), 1e-10 + 8 * slack * n),
            f"missing share, {which}": (abs(at("missing_share") - 1 + n / (mu.shape[1] * counts.sum())), 1e-12),
        }
    return met


def judge_autocorrelation(problem: Problem, found: Estimate, weights: np.ndarray) -> Met:
    """Means over pairs, lag by lag, as a loop over windows would have them."""
    mu, valid = problem.mu, problem.valid
    met = interval(found) | {"r(0)": (np.max(np.abs(found.rows[:, 0] - 1)), 0)}
    centre = float(np.mean(mu[valid]))
    for row in rows_seen(problem, weights):
        exact = own_autocorrelation(
            np.repeat(mu, weights[row], axis=0), np.repeat(valid, weights[row], axis=0), problem.lags
        )
        slack = lost(counted(mu, valid, weights[row]), centre)
        met[f"r, {'sample' if row == 0 else 'replicate'}"] = (
            np.max(np.abs(found.rows[row] - exact)),
            (1 + float(np.max(np.abs(exact)))) * (1e-12 + 8 * slack),
        )
    return met


def own_autocorrelation(mu: np.ndarray, valid: np.ndarray, lags: int) -> np.ndarray:
    """(lags,) in long doubles."""
    x = np.where(valid, mu.astype(np.longdouble) - mu[valid].astype(np.longdouble).mean(), 0)
    found = []
    for k in range(lags):
        pairs = valid[:, : x.shape[1] - k] & valid[:, k:]
        found.append(np.sum(np.where(pairs, x[:, : x.shape[1] - k] * x[:, k:], 0)) / pairs.sum())
    return np.array(found) / found[0]


def has_pairs(problem: Problem, weights: np.ndarray) -> bool:
    """Whether every lag has a pair in every replicate."""
    valid, lags = problem.valid, problem.lags
    windows = valid.shape[1]
    if not 2 <= lags <= windows:
        return False
    pairs = np.stack([(valid[:, : windows - k] & valid[:, k:]).sum(axis=1) for k in range(lags)], axis=1)
    return bool((weights @ pairs > 0).all())


def judge_sums(problem: Problem, area: np.ndarray, force: np.ndarray, mu: np.ndarray, valid: np.ndarray) -> Met:
    """Sums of windows within the rounding that is told, and mu = tau A / N."""
    met: Met = {}
    starts = range(0, problem.area.shape[1] - problem.window + 1, problem.stride)
    for name, columns, found in (("area", problem.area, area), ("force", problem.force, force)):
        exact = np.stack([columns[:, s : s + problem.window].astype(np.longdouble).sum(axis=1) for s in starts], axis=1)
        if found.shape != exact.shape:
            return {f"{name}: its shape": (math.inf, 0)}
        limit = (problem.window + 1) * 0.5 * EPS * columns.sum(axis=1)[:, None]
        met |= {
            f"{name} of windows": (float(np.max(np.abs(found - exact) - limit)), float(limit.max()) * 1e-3),
            f"{name} is not negative": (-found.min(), 0),
            f"{name} of open windows": (np.max(found[exact == 0], initial=0.0), 0),
        }
    contact = area >= problem.least_area
    exact = problem.strength * area[contact] / force[contact]
    return met | {
        "which have friction": (int(np.sum(valid != contact)), 0),
        "friction": (np.max(np.abs(mu[contact] / exact - 1), initial=0.0), 4 * EPS),
        "no friction": (np.max(np.abs(mu[~contact]), initial=0.0), 0),
    }


class Influences(NamedTuple):
    """Mean and log std of windows, the influence (S,) of each strip on them, and the units in which these count."""

    value: tuple[float, float]
    influence: tuple[np.ndarray, np.ndarray]
    unit: tuple[float, float]


def influences(mu: np.ndarray, valid: np.ndarray, counts: np.ndarray) -> Influences:
    """Of a resampled row."""
    x = counted(mu, valid, counts)
    mean, variance, n = x.mean(), x.var(), len(x)
    deviation = np.where(valid, mu - mean, 0)
    spread = np.where(valid, deviation**2 - variance, 0) / (2 * variance)
    by_strip = deviation.sum(axis=1) / n, spread.sum(axis=1) / n
    return Influences((mean, 0.5 * np.log(variance)), by_strip, (float(variance), 1.0))


class Corrected(NamedTuple):
    """A control-variate estimate: theta, its alpha and variance ratio, and how many of its digits may be rounding."""

    theta: float
    alpha: float
    ratio: float
    digits: float
    limit_of_alpha: float


def combined(
    problem: Problem, weights: np.ndarray, many: np.ndarray, row: int
) -> tuple[Corrected | None, Corrected | None]:
    """Mean and log std: theta - alpha (theta_same - theta_many), alpha = cov / (var (1 + S / S2)), strip by strip.

    None where windows or control hardly scatter between strips: near that limit either answer is right.
    """
    strips = len(problem.mu)
    excess = 1 + strips / (len(problem.control) - strips)
    sets = (
        (problem.mu, problem.valid, weights[row]),
        (problem.control[:strips], problem.control_valid[:strips], weights[row]),
        (problem.control[strips:], problem.control_valid[strips:], many[row]),
    )
    solved, same, other = (influences(*one) for one in sets)
    slack = sum(lost(counted(*one), float(np.mean(one[0][one[1]]))) for one in sets)
    return tuple(_corrected(solved, same, other, k, excess, weights[row], slack) for k in range(2))  # type: ignore[return-value]


def _corrected(
    solved: Influences, same: Influences, other: Influences, k: int, excess: float, counts: np.ndarray, slack: float
) -> Corrected | None:
    first, second = solved.influence[k], same.influence[k]
    cross, own, control = (
        float(np.sum(counts * a * b)) for a, b in ((first, second), (first, first), (second, second))
    )
    shares = own / solved.unit[k], control / same.unit[k]
    if min(shares) <= MARGIN * NO_SCATTER**2:
        return None
    alpha = cross / (control * excess)
    theta = float(solved.value[k] - alpha * (same.value[k] - other.value[k]))
    size = float(abs(alpha) * (abs(same.value[k]) + abs(other.value[k])) + abs(solved.value[k]))
    digits = 1e-9 + 1e3 * slack * sum(1 / math.sqrt(share) for share in shares)
    return Corrected(
        theta, alpha, 1 - alpha * cross / own, digits * size, digits * (abs(alpha) + math.sqrt(own / control))
    )


def judge_combined(problem: Problem, found: Combined, weights: np.ndarray, many: np.ndarray) -> Met:
    """Estimates, coefficients and variance ratios of the sample and of replicates."""
    met: Met = {}
    for name in ("mean", "std", "variation", "mean_variance_ratio", "std_variance_ratio"):
        met |= {f"{name}: {what}": limits for what, limits in interval(getattr(found, name)).items()}
    for row in rows_seen(problem, weights):
        for which, exact in zip(("mean", "std"), combined(problem, weights, many, row), strict=True):
            if exact is None:
                continue
            value, alpha, ratio = (
                float(getattr(found, which + part).rows[row]) for part in ("", "_coefficient", "_variance_ratio")
            )
            told = math.log(value) if which == "std" else value
            met |= {
                f"{which}, row {row}": (abs(told - exact.theta), exact.digits),
                f"alpha of {which}, row {row}": (abs(alpha - exact.alpha), exact.limit_of_alpha),
                f"ratio of {which}, row {row}": (
                    abs(ratio - exact.ratio),
                    4 * exact.limit_of_alpha / (abs(exact.alpha) or 1),
                ),
            }
    return met
