"""Friction: Beta distributions fitted to random windows, each judged by a plain search.

Problems include one strip, one window, strips without contact, friction without scatter or of two values, and outliers.
No Beta distribution of a grid or nearby, with scipy's quantiles, may be nearer to the windows than the fitted one.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy import stats

from roughslip.errors import IllPosedError
from roughslip.friction.marginal import PROBABILITIES, SHAPES, fit_beta
from tests.properties.campaign import Trial, choose, log_uniform

KINDS = ("rough", "dilute", "shaped", "outlier", "two-values", "constant", "nearly-constant", "none", "long")
KIND_SHARES = (0.3, 0.12, 0.2, 0.06, 0.05, 0.06, 0.06, 0.03, 0.12)
MOST_STRIPS, MOST_WINDOWS = 25, 150
EPS = float(np.finfo(float).eps)
GRID = 25  # Beta shapes on each axis


def attempt(trial: Trial) -> None:
    """Fit a Beta distribution. With full contact and eight windows of eight strips an error is no answer."""
    rng = trial.rng
    kind = choose(rng, KINDS, KIND_SHARES)
    strips = int(rng.integers(1, 4)) if rng.random() < 0.12 else int(rng.integers(2, MOST_STRIPS + 1))
    mu, valid = draw_windows(rng, kind, strips, round(MOST_WINDOWS ** rng.random()))
    trial.case["kind"] = kind
    well_posed = kind in ("rough", "shaped") and valid.all() and min(mu.shape) >= 8
    trial.answers = () if well_posed else (IllPosedError,)
    x = np.sort(mu[valid])
    fit, nodes = fit_beta(mu[valid]), len(PROBABILITIES)
    # The least window with a share of (2 k + 1) / (2 nodes) of all windows at or below it.
    q = x[[max(-(-(2 * k + 1) * len(x) // (2 * nodes)), 1) - 1 for k in range(nodes)]].astype(np.longdouble)
    z, mean, spread = standard(q), float(q.mean()), float(q.std())
    model = stats.beta.ppf(PROBABILITIES, fit.a, fit.b)
    misfit = misfit_of(z, model)
    steps = (0.95, 1.0, 1.05)
    near = [stats.beta.ppf(PROBABILITIES, *np.clip((fit.a * s, fit.b * t), *SHAPES)) for s in steps for t in steps]
    minimum = min(misfit_of(z, other) for other in (*near, *beta_grid()))
    fitted = fit.lower + (fit.upper - fit.lower) * model
    slack = 1e-9 + 64 * EPS * float(np.abs(q).max()) / spread
    trial.check("distance", abs(fit.distance**2 - misfit), 1e-9 + slack)
    trial.check("no nearer Beta", misfit - minimum, 1e-7 + slack)  # of the squared distance
    trial.check("its mean", abs(fitted.mean() - mean) / spread, slack)
    trial.check("its ends", abs(np.mean(z * (fitted - mean)) / spread - 1 + misfit), 1e-6 + slack)
    bounds = max(fit.a / SHAPES[1], fit.b / SHAPES[1], SHAPES[0] / fit.a, SHAPES[0] / fit.b)
    trial.check("its shapes", bounds - 1, 1e-9)


def draw_windows(rng: np.random.Generator, kind: str, strips: int, windows: int) -> tuple[np.ndarray, np.ndarray]:
    """Draw friction (S, W) of windows, correlated along the strip, and which windows have contact."""
    shape = (strips, windows)
    decay = np.exp(-1 / (log_uniform(rng, -1, 1) * (windows if kind == "long" else max(1.0, windows / 10))))
    z = rng.standard_normal(shape)
    for k in range(1, windows):
        z[:, k] = decay * z[:, k - 1] + np.sqrt(1 - decay**2) * z[:, k]
    scatter = log_uniform(rng, -4, -0.5)
    match kind:
        case "shaped":
            mu = 1 + scatter * np.exp(-np.logaddexp(0, -1.7 * z)) ** log_uniform(rng, -1, 1)
        case "outlier":
            mu = np.ones(shape)
            mu.flat[int(rng.integers(mu.size))] += log_uniform(rng, -6, 3)
        case "two-values":
            mu = np.where(z > 0, 1.5, 1.0)
        case "constant":
            mu = np.ones(shape)
        case "nearly-constant":
            mu = 1 + log_uniform(rng, -15, -8) * z
        case _:
            mu = np.exp(scatter * z)
    mu = mu * log_uniform(rng, -12, 6)
    valid = np.full(shape, kind != "none")
    if kind == "dilute" or (kind != "none" and rng.random() < 0.2):
        valid = rng.random(shape) > log_uniform(rng, -2, -0.05)
    return np.where(valid, mu, 0.0), valid


def standard(x: np.ndarray) -> np.ndarray:
    """Return values of mean 0 and standard deviation 1."""
    return ((x - x.mean()) / x.std()).astype(float)


def misfit_of(z: np.ndarray, model: np.ndarray) -> float:
    """Return 1 - correlation^2 of standard values with a model, without cancellation."""
    other = standard(model)
    return float(np.mean((z - np.mean(z * other) * other) ** 2))


@lru_cache(maxsize=1)
def beta_grid() -> list[np.ndarray]:
    """Return the quantiles of Beta distributions over the whole range of shapes."""
    shapes = np.geomspace(*SHAPES, GRID)
    return [stats.beta.ppf(PROBABILITIES, a, b) for a in shapes for b in shapes]
