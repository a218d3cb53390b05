"""Random windows of friction on strips, and what is asked of them. A seed and a number make a problem again.

Nothing is spared: one strip, one window, strips without contact, friction without scatter or of two values, outliers,
areas of 1e-20 to 1e3 m^2 and forces of 1e-15 to 1e12 N.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roughslip.friction.resampling import FEWEST_REPLICATES
from workflow.stress.drawing import one_of, power

ENTRIES = ("sums", "statistics", "autocorrelation", "beta", "candidates", "scaled", "distance", "combine", "law")
ENTRY_SHARES = (0.12, 0.18, 0.16, 0.1, 0.08, 0.08, 0.08, 0.1, 0.1)
KINDS = ("rough", "dilute", "shaped", "outlier", "two-values", "constant", "nearly-constant", "none", "long")
KIND_SHARES = (0.3, 0.12, 0.2, 0.06, 0.05, 0.06, 0.06, 0.03, 0.12)
MOST_STRIPS, MOST_COLUMNS, MOST_VALUES = 25, 200, 1500


@dataclass(frozen=True)
class Problem:
    """Windows of strips.

    number, entry, kind : which one, of ENTRIES and KINDS
    area, force : (S, nx) [m^2], [N] of the columns of the strips
    window, stride : [columns]
    strength, least_area : [Pa], [m^2]
    mu, valid : (S, W) friction of the windows, and which have one
    control, control_valid : (S + S2, W) a cheap model of it on these strips and on others
    lags, spacing : number of lags, and [m] distance of windows
    seed : of the resampling
    """

    number: int
    entry: str
    kind: str
    area: np.ndarray
    force: np.ndarray
    window: int
    stride: int
    strength: float
    least_area: float
    mu: np.ndarray
    valid: np.ndarray
    control: np.ndarray
    control_valid: np.ndarray
    lags: int
    spacing: float
    seed: tuple[int, ...]

    @property
    def replicates(self) -> int:
        return FEWEST_REPLICATES + self.number % 20


def random_problem(seed: int, number: int) -> Problem:
    """The problem of this number."""
    generator = np.random.default_rng([seed, number])
    entry, kind = one_of(generator, ENTRIES, ENTRY_SHARES), one_of(generator, KINDS, KIND_SHARES)
    strips = int(generator.integers(1, 4)) if generator.random() < 0.12 else int(generator.integers(2, MOST_STRIPS + 1))
    columns = round(MOST_COLUMNS ** generator.random())
    window = int(generator.integers(1, columns + 1)) if generator.random() < 0.5 else max(1, columns // 8)
    stride = int(generator.integers(1, max(2, window // 3) + 1))
    force = np.abs(generator.standard_normal((strips, columns))) + 0.01
    area = force * generator.uniform(0.5, 1.5, force.shape)
    if kind in ("dilute", "none"):
        open_ = generator.random(force.shape) < (power(generator, -2, 0) if kind == "dilute" else 2.0)
        open_[: int(generator.integers(0, strips + 1))] |= kind == "dilute" and generator.random() < 0.3
        force, area = np.where(open_, 0.0, force), np.where(open_, 0.0, area)
    if kind == "constant":
        area = force.copy()
    area, force = area * power(generator, -20, 3), force * power(generator, -15, 12)
    windows = (columns - window) // stride + 1
    mu, valid = _friction(generator, kind, strips, windows)
    spacing = power(generator, -9, 2)
    more = int(generator.integers(2, 40))
    control, control_valid = _control(generator, kind, mu, valid, more)
    lags = int(generator.integers(2, windows + 1)) if windows > 1 and generator.random() < 0.9 else windows
    least = float(area.max()) * power(generator, -4, 0.5) or 1e-12
    return Problem(
        number, entry, kind, area, force, window, stride, power(generator, 0, 10), least, mu, valid, control,
        control_valid, lags, spacing, (seed, number, 1),
    )  # fmt: skip


def _friction(generator: np.random.Generator, kind: str, strips: int, windows: int) -> tuple[np.ndarray, np.ndarray]:
    """Friction of windows, correlated along the strip, and which have one."""
    shape = (strips, windows)
    length = power(generator, -1, 1) * (windows if kind == "long" else max(1.0, windows / 10))
    decay = np.exp(-1 / length)
    z = np.empty(shape)
    z[:, 0] = generator.standard_normal(strips)
    for k in range(1, windows):
        z[:, k] = decay * z[:, k - 1] + np.sqrt(1 - decay**2) * generator.standard_normal(strips)
    scatter = power(generator, -4, -0.5)
    match kind:
        case "shaped":
            uniform = np.exp(-np.logaddexp(0, -1.7 * z))
            mu = 1 + scatter * uniform ** power(generator, -1, 1)
        case "outlier":
            mu = np.ones(shape)
            mu.flat[int(generator.integers(mu.size))] += power(generator, -6, 3)
        case "two-values":
            mu = np.where(z > 0, 1.5, 1.0)
        case "constant":
            mu = np.ones(shape)
        case "nearly-constant":
            mu = 1 + power(generator, -15, -8) * z
        case _:
            mu = np.exp(scatter * z)
    mu = mu * power(generator, -12, 6)
    valid = np.ones(shape, dtype=bool)
    if kind == "none":
        valid[:] = False
    elif kind == "dilute" or generator.random() < 0.2:
        valid = generator.random(shape) > power(generator, -2, -0.05)
    return np.where(valid, mu, 0.0), valid


def _control(
    generator: np.random.Generator, kind: str, mu: np.ndarray, valid: np.ndarray, more: int
) -> tuple[np.ndarray, np.ndarray]:
    """A model that resembles the friction of these strips to some extent, and the same model on other strips."""
    strips = len(mu)
    others, others_valid = mu[generator.integers(0, strips, more)], valid[generator.integers(0, strips, more)]
    rows = np.concatenate((mu, np.where(others > 0, others, float(mu.max()) or 1.0)))
    like = generator.random() < 0.7
    noise = power(generator, -3, 0) * (float(np.std(mu[valid])) if valid.any() else 1.0)
    rows = rows + noise * generator.standard_normal(rows.shape) if like else 1 + generator.random(rows.shape)
    rows = 0.7 * rows + float(rows.max()) * power(generator, -3, 1)
    return rows, np.concatenate((valid, others_valid))
