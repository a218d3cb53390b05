"""State-space model of scatter along the slipped distance, seen through an instrument: its likelihood in O(n).

The scatter x(s) is a sum of independent modes, each a first-order process in s. The instrument is a first-order
low-pass in time, and white noise is added to what it shows. A Kalman filter whitens data and regressors alike, so that
generalised least squares is ordinary least squares of the whitened columns.

Method: J. Hartikainen & S. Särkkä, IEEE Int. Workshop MLSP (2010) 379, for Gaussian processes as state-space models.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from roughslip.compilation.cache import compiled

# By shape, the start of its parameters after the correlation length, and their bounds: of two exponentials the logit
# of the share of the longer one and the logarithm of the ratio of their lengths.
SHAPES: dict[str, tuple[tuple[float, float, float], ...]] = {
    "exponential": (),
    "two_exponentials": ((0.0, -4.0, 4.0), (-1.5, -5.0, -0.4)),
}


class Modes(NamedTuple):
    """rates : (p,) [1/m] of decay; variances : (p,) [-] of the modes, whose sum x has unit variance."""

    rates: np.ndarray
    variances: np.ndarray


class Course(NamedTuple):
    """What the samples of all records went through, one record after another.

    step : (n,) [m] slipped since the sample before; negative at the first of a record, which forgets what was before
    memory : (n,) [-] exp(-dt / time constant) of the instrument
    weight : (n,) [-] factor of the scatter at the sample: 1, or the mean friction over its average
    """

    step: np.ndarray
    memory: np.ndarray
    weight: np.ndarray


def modes(shape: str, length_m: float, parameters: tuple[float, ...] = ()) -> Modes:
    """The modes of a shape of the given correlation length, the integral of the autocorrelation from zero on."""
    if shape == "exponential":
        return Modes(np.array([1.0 / length_m]), np.ones(1))
    share, ratio = 1.0 / (1.0 + np.exp(-parameters[0])), np.exp(parameters[1])
    longer = length_m / (share + (1.0 - share) * ratio)
    return Modes(np.array([1.0 / longer, 1.0 / (longer * ratio)]), np.array([share, 1.0 - share]))


def autocorrelation(found: Modes, lags_m: np.ndarray) -> np.ndarray:
    """Autocorrelation : (as lags) [-] of the sum of modes at lags [m] >= 0."""
    return np.asarray(np.exp(-found.rates * np.asarray(lags_m)[..., None]) @ found.variances)


@compiled()
def _filter(
    rates: np.ndarray,
    variances: np.ndarray,
    step: np.ndarray,
    memory: np.ndarray,
    weight: np.ndarray,
    noise: float,
    columns: np.ndarray,
) -> float:
    """Whiten the columns : (n, k) in place; the sum of the logarithms of the variances of the innovations."""
    p, (n, k) = rates.size, columns.shape
    within, cross, shown, log_det = np.zeros((p, p)), np.zeros(p), 0.0, 0.0
    state, level, keep = np.zeros((k, p)), np.zeros(k), np.ones(p)
    for t in range(n):
        fresh, a, w = step[t] < 0.0, memory[t], weight[t]
        if fresh:
            a, shown = 0.0, 0.0
            within[:, :], cross[:], state[:, :], level[:] = np.diag(variances), 0.0, 0.0, 0.0
        else:
            keep[:] = np.exp(-rates * step[t])
            for i in range(p):
                cross[i] *= keep[i]
                for j in range(p):
                    within[i, j] *= keep[i] * keep[j]
                within[i, i] += (1.0 - keep[i] * keep[i]) * variances[i]
        b = (1.0 - a) * w
        through, total = 0.0, 0.0
        for i in range(p):
            row_sum = 0.0
            for j in range(p):
                row_sum += within[i, j]
            through += cross[i]
            total += row_sum
            cross[i] = a * cross[i] + b * row_sum
        shown = a * a * shown + 2.0 * a * b * through + b * b * total
        variance = shown + noise
        log_det += np.log(variance)
        scale = 1.0 / np.sqrt(variance)
        for c in range(k):
            total = 0.0
            for i in range(p):
                state[c, i] *= keep[i]
                total += state[c, i]
            level[c] = a * level[c] + b * total
            innovation = columns[t, c] - level[c]
            for i in range(p):
                state[c, i] += cross[i] / variance * innovation
            level[c] += shown / variance * innovation
            columns[t, c] = innovation * scale
        for i in range(p):
            for j in range(p):
                within[i, j] -= cross[i] * cross[j] / variance
        for i in range(p):
            cross[i] -= cross[i] * shown / variance
        shown -= shown * shown / variance
    return log_det


def whitened(found: Modes, course: Course, noise: float, columns: np.ndarray) -> tuple[np.ndarray, float]:
    """Columns : (n, k) as independent unit normals, if they are the scatter of unit variance and noise; log det.

    noise : [-] variance of the white noise over that of the scatter
    """
    white = np.array(columns, dtype=float, order="C")
    return white, _filter(*found, *course, float(noise), white)
