"""Random windows of friction on strips, and the judge of their statistics.

Problems include one strip, one window, strips without contact, friction without scatter or of two values, and outliers.

The judge uses textbook formulas in long doubles on the windows themselves, and repeats strips as often as a resampled
row counts them. A centred moment of windows with scatter s and mean m has lost m / s of its digits. A replicate far
from the sample's mean loses more.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from roughslip.friction.resampling import CANCELLED, FEWEST_REPLICATES, NO_SCATTER
from roughslip.friction.statistics import PERCENTS, WindowStatistics
from roughslip.probability import TAILS, Estimate
from workflow.stress.runner import Conditions, choose, log_uniform

ENTRIES = ("statistics", "autocorrelation", "beta")
ENTRY_SHARES = (0.4, 0.35, 0.25)
KINDS = ("rough", "dilute", "shaped", "outlier", "two-values", "constant", "nearly-constant", "none", "long")
KIND_SHARES = (0.3, 0.12, 0.2, 0.06, 0.05, 0.06, 0.06, 0.03, 0.12)
MOST_STRIPS, MOST_WINDOWS = 25, 150

EPS = float(np.finfo(float).eps)
MARGIN = 3.0  # about the least scatter, within which either answer is right


@dataclass(frozen=True)
class WindowProblem:
    """Windows of strips.

    number, entry, kind : of the problem, of ENTRIES and KINDS
    mu, valid : (S, W) friction of the windows, and which windows have contact
    lags, spacing : number of lags, and distance of windows [m]
    seed : of the resampling
    """

    number: int
    entry: str
    kind: str
    mu: np.ndarray
    valid: np.ndarray
    lags: int
    spacing: float
    seed: tuple[int, ...]

    @property
    def replicates(self) -> int:
        return FEWEST_REPLICATES + self.number % 20


def random_problem(seed: int, number: int) -> WindowProblem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number])
    entry, kind = choose(generator, ENTRIES, ENTRY_SHARES), choose(generator, KINDS, KIND_SHARES)
    strips = int(generator.integers(1, 4)) if generator.random() < 0.12 else int(generator.integers(2, MOST_STRIPS + 1))
    windows = round(MOST_WINDOWS ** generator.random())
    mu, valid = _friction(generator, kind, strips, windows)
    lags = int(generator.integers(2, windows + 1)) if windows > 1 and generator.random() < 0.9 else windows
    return WindowProblem(number, entry, kind, mu, valid, lags, log_uniform(generator, -9, 2), (seed, number, 1))


def _friction(generator: np.random.Generator, kind: str, strips: int, windows: int) -> tuple[np.ndarray, np.ndarray]:
    """Draw friction of windows, correlated along the strip, and which windows have contact."""
    shape = (strips, windows)
    length = log_uniform(generator, -1, 1) * (windows if kind == "long" else max(1.0, windows / 10))
    decay = np.exp(-1 / length)
    z = np.empty(shape)
    z[:, 0] = generator.standard_normal(strips)
    for k in range(1, windows):
        z[:, k] = decay * z[:, k - 1] + np.sqrt(1 - decay**2) * generator.standard_normal(strips)
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


def counted(mu: np.ndarray, valid: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return (n,) windows with contact of a resampled row, in long doubles, strip by strip."""
    return np.repeat(mu, counts, axis=0)[np.repeat(valid, counts, axis=0)].astype(np.longdouble)


def judged_rows(problem: WindowProblem, weights: np.ndarray) -> dict[str, int]:
    """Return the rows that a judge looks at: the sample, a replicate, and the last replicate."""
    return {"sample": 0, "replicate": 1 + problem.number % (len(weights) - 1), "last replicate": len(weights) - 1}


def interval_conditions(found: object, names: tuple[str, ...]) -> Conditions:
    """Return what every percentile interval must meet, for these estimates of a result."""
    conditions: Conditions = {}
    for name in names:
        estimate: Estimate = getattr(found, name)
        ends = np.quantile(estimate.replicates, TAILS, axis=-1)
        scale = np.max(np.abs(estimate.replicates), initial=0.0) or 1.0
        parts = (estimate.value, estimate.low, estimate.high, estimate.replicates)
        off = max(np.max(np.abs(estimate.low - ends[0])), np.max(np.abs(estimate.high - ends[1])))
        conditions |= {
            f"{name}: finite": (0.0 if all(np.isfinite(part).all() for part in parts) else math.inf, 0),
            f"{name}: its interval": (off / scale, 1e-12),
            f"{name}: replicates": (FEWEST_REPLICATES - estimate.replicates.shape[-1], 0),
        }
    return conditions


def has_strips(valid: np.ndarray, weights: np.ndarray) -> bool:
    """Whether two strips and every replicate have a window with contact."""
    some = valid.any(axis=1)
    return bool(some.sum() >= 2 and (weights @ some > 0).all())


def scatters(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> bool:
    """Whether windows scatter beyond doubt in every replicate, compared with their mean and its distance from all's."""
    if not has_strips(valid, weights):
        return False
    centre = float(np.mean(mu[valid]))
    rows = [counted(mu, valid, row) for row in weights]
    return all(x.std() > MARGIN * max(NO_SCATTER * abs(centre), CANCELLED * abs(x.mean() - centre)) for x in rows)


def lost(x: np.ndarray, centre: float) -> float:
    """Return what rounding may change of moments of windows x : (n,) about a centre, over their scatter."""
    std, mean = float(np.std(x)), float(np.mean(x))
    shift = 1 + ((mean - centre) / std) ** 2
    largest = float(np.max(np.abs(x - mean))) / std
    return 64 * EPS * (abs(mean) / std + (shift * largest) ** 2 + shift**2 + len(x))


def judge_statistics(problem: WindowProblem, found: WindowStatistics, weights: np.ndarray) -> Conditions:
    """Return conditions on moments, quantiles, effective and missing windows of the sample and of replicates."""
    mu, valid = problem.mu, problem.valid
    centre = float(np.mean(mu[valid]))
    names = ("mean", "std", "variation", "skewness", "kurtosis", "quantiles", "effective_windows", "missing_share")
    conditions = interval_conditions(found, names) | {
        "windows": (abs(found.windows - mu.size), 0),
        "missing": (abs(found.missing - int((~valid).sum())), 0),
    }
    for which, row in judged_rows(problem, weights).items():
        counts = weights[row]
        x = counted(mu, valid, counts)
        mean, std, n = x.mean(), x.std(), len(x)
        score = (x - mean) / std
        slack, tails = lost(x, centre), float(np.mean(score**4))
        per_strip = np.array([float(np.sum(mu[s][valid[s]].astype(np.longdouble) - mean)) for s in range(len(mu))])
        of_mean = len(mu) / (len(mu) - 1) * float(np.sum(counts * per_strip**2)) / n**2
        effective = float(std**2) / max(of_mean, float(std**2) / n)
        ranked = np.sort(x)[[max(math.ceil(p * n / 100), 1) - 1 for p in PERCENTS]]
        at = {name: getattr(found, name).rows[row] for name in names}
        conditions |= {
            f"mean, {which}": (abs(at["mean"] / mean - 1), 1e-13 + n * EPS),
            f"std, {which}": (abs(at["std"] / std - 1), 1e-13 + slack),
            f"variation, {which}": (abs(at["variation"] * mean / std - 1), 1e-12 + slack),
            f"skewness, {which}": (abs(at["skewness"] - np.mean(score**3)), (1 + tails) * (1e-12 + 4 * slack)),
            f"kurtosis, {which}": (abs(at["kurtosis"] - tails + 3), (1 + tails) * (1e-12 + 4 * slack)),
            f"quantiles, {which}": (np.max(np.abs(at["quantiles"] - ranked)), 0),
            f"effective windows, {which}": (abs(at["effective_windows"] / effective - 1), 1e-10 + 8 * slack * n),
            f"missing share, {which}": (abs(at["missing_share"] - 1 + n / (mu.shape[1] * counts.sum())), 1e-12),
        }
    return conditions
