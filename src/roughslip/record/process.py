"""State-space model of scatter along the slipped distance, seen through an instrument: its likelihood in O(n).

The scatter x(s) is a sum of independent modes, each a first-order process in s. The instrument is a first-order
low-pass in time, and white noise is added to what it shows. A Kalman filter whitens data and regressors alike, so that
generalised least squares is ordinary least squares of the whitened columns.

An average over a window, whose autocorrelation is a triangle, has no state of finite size. Its covariance over the
slipped distance is zero beyond the window, so a banded Cholesky factor whitens it, in O(n b^2) for b samples a window.

Method: J. Hartikainen & S. Särkkä, IEEE Int. Workshop MLSP (2010) 379, for Gaussian processes as state-space models.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from roughslip.compilation.cache import compiled

# By shape, the start of its parameters after the correlation length, and their bounds: of two exponentials the logit
# of the share of the longer one and the logarithm of the ratio of their lengths.
SHAPES: dict[str, tuple[tuple[float, float, float], ...]] = {
    "exponential": (),
    "two_exponentials": ((0.0, -4.0, 4.0), (-1.5, -5.0, -0.4)),
    "triangle": (),
}


class Modes(NamedTuple):
    """rates : (p,) [1/m] of decay; variances : (p,) [-] of the modes, whose sum x has unit variance."""

    rates: np.ndarray
    variances: np.ndarray


class Window(NamedTuple):
    """An average of white noise over a window of this length [m], of unit variance."""

    length: float


class Course(NamedTuple):
    """What the samples of all records went through, one record after another.

    step : (n,) [m] slipped since the sample before; negative at the first of a record, which forgets what was before
    memory : (n,) [-] exp(-dt / time constant) of the instrument
    weight : (n,) [-] factor of the scatter at the sample: 1, or the mean friction over its average
    """

    step: np.ndarray
    memory: np.ndarray
    weight: np.ndarray


def modes(shape: str, length_m: float, parameters: tuple[float, ...] = ()) -> Modes | Window:
    """The modes of a shape of the given correlation length, the integral of the autocorrelation from zero on.

    Of a triangle it is half the window.
    """
    if shape == "triangle":
        return Window(2.0 * length_m)
    if shape == "exponential":
        return Modes(np.array([1.0 / length_m]), np.ones(1))
    share, ratio = 1.0 / (1.0 + np.exp(-parameters[0])), np.exp(parameters[1])
    longer = length_m / (share + (1.0 - share) * ratio)
    return Modes(np.array([1.0 / longer, 1.0 / (longer * ratio)]), np.array([share, 1.0 - share]))


def autocorrelation(found: Modes | Window, lags_m: np.ndarray) -> np.ndarray:
    """Autocorrelation : (as lags) [-] of the scatter at lags [m] >= 0."""
    if isinstance(found, Window):
        return np.maximum(1.0 - np.asarray(lags_m) / found.length, 0.0)
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


def samples_a_window(window_m: float, step: np.ndarray) -> int:
    """The most samples that one window of this length [m] holds. step : (n,) as of `Course`"""
    place = _places(window_m, step)
    return int(np.max(np.searchsorted(place, place + window_m) - np.arange(place.size)))


def _places(window_m: float, step: np.ndarray) -> np.ndarray:
    """(n,) [m] slipped distances, records a window apart."""
    return np.cumsum(np.where(step < 0.0, window_m, step))


def _whitened_average(window_m: float, course: Course, noise: float, columns: np.ndarray) -> tuple[np.ndarray, float]:
    """As `whitened`, of an average over a window.

    Without the memory of the instrument, z_i = (y_i - a_i y_(i-1)) / (1 - a_i) is the scatter itself, and its noise a
    moving average of two. So the covariance of z is banded.
    """
    step, weight = course.step, course.weight
    place, n = _places(window_m, step), step.size
    a = np.where(step < 0.0, 0.0, course.memory)
    width = max(samples_a_window(window_m, step), 2)
    bands = np.zeros((width, n))  # row d: the covariances of samples d apart
    for d, band in enumerate(bands):
        shown = np.maximum(1.0 - (place[d:] - place[: n - d]) / window_m, 0.0)
        band[: n - d] = weight[d:] * weight[: n - d] * shown
    own = 1.0 / (1.0 - a)
    bands[0] += noise * own**2 * (1.0 + a**2)
    bands[1, : n - 1] -= noise * own[1:] * a[1:] * own[:-1]
    factor = scipy.linalg.cholesky_banded(bands, lower=True, overwrite_ab=True, check_finite=False)
    free = own[:, None] * columns
    free[1:] -= (own * a)[1:, None] * columns[:-1]
    white = scipy.linalg.lapack.dtbtrs(factor, free, uplo="L")[0]
    return white, 2.0 * float(np.sum(np.log(factor[0]) - np.log(own)))


def whitened(found: Modes | Window, course: Course, noise: float, columns: np.ndarray) -> tuple[np.ndarray, float]:
    """Columns : (n, k) as independent unit normals, if they are the scatter of unit variance and noise; log det.

    noise : [-] variance of the white noise over that of the scatter
    """
    if isinstance(found, Window):
        return _whitened_average(found.length, course, float(noise), columns)
    white = np.array(columns, dtype=float, order="C")
    return white, _filter(*found, *course, float(noise), white)
