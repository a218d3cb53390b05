"""Scatter along the slipped distance, seen through an instrument: its likelihood, and synthetic records.

The scatter x(s) of an exponential autocorrelation is a first-order process in the distance s. The instrument is a
first-order low-pass in time, and white noise is added to what it shows. A Kalman filter whitens data and regressors
alike, in O(n), so that generalised least squares is ordinary least squares of the whitened columns.

An average over a window, whose autocorrelation is a triangle, has no state of finite size. Its covariance over the
slipped distance is zero beyond the window, so a banded Cholesky factor whitens it, in O(n b^2) for b samples a window.

Method: J. Hartikainen & S. Särkkä, IEEE Int. Workshop MLSP (2010) 379, for Gaussian processes as state-space models.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from roughslip.compilation.cache import compiled

SHAPES = ("exponential", "triangle")


@dataclass(frozen=True)
class Scatter:
    """A process of unit variance.

    shape : of its autocorrelation, one of SHAPES; a triangle is that of an average over a window
    length : [m] integral of the autocorrelation from zero on
    """

    shape: str
    length: float

    @property
    def window(self) -> float:
        """[m] of an average: twice the length."""
        return 2.0 * self.length

    def autocorrelation(self, lags_m: np.ndarray) -> np.ndarray:
        """Autocorrelation : (as lags) [-] at lags [m] >= 0."""
        if self.shape == "triangle":
            return np.maximum(1.0 - np.asarray(lags_m) / self.window, 0.0)
        return np.asarray(np.exp(-np.asarray(lags_m) / self.length))

    def path(self, slipped_m: np.ndarray, generator: np.random.Generator) -> np.ndarray:
        """A Gaussian path at slipped distances : (n,) [m], which do not fall.

        An exponential is an exact recursion. An average over a window is the increment of Brownian motion over it.
        """
        if self.shape == "triangle":
            ends = np.concatenate([slipped_m, slipped_m + self.window])
            order = np.argsort(ends, kind="stable")
            motion = np.empty(ends.size)
            rises = np.sqrt(np.diff(ends[order], prepend=ends[order[0]]))
            motion[order] = np.cumsum(rises * generator.standard_normal(ends.size))
            return np.asarray((motion[slipped_m.size :] - motion[: slipped_m.size]) / np.sqrt(self.window))
        keep = np.exp(-np.diff(slipped_m, prepend=-np.inf) / self.length)
        path = np.sqrt(1.0 - keep**2) * generator.standard_normal(keep.size)
        for t in range(1, path.size):
            path[t] += keep[t] * path[t - 1]
        return path


def through_instrument(values: np.ndarray, memory: np.ndarray) -> np.ndarray:
    """values : (n,) after a first-order low-pass. memory : (n,) exp(-dt / time constant)"""
    shown, level = np.empty(values.size), values[0]
    for t, (value, a) in enumerate(zip(values, memory, strict=True)):
        level = a * level + (1.0 - a) * value
        shown[t] = level
    return shown


class Course(NamedTuple):
    """What the samples of all records went through, one record after another.

    step : (n,) [m] slipped since the sample before; negative at the first of a record, which forgets what was before
    memory : (n,) [-] exp(-dt / time constant) of the instrument
    weight : (n,) [-] factor of the scatter at the sample: 1, or the mean friction over its average
    """

    step: np.ndarray
    memory: np.ndarray
    weight: np.ndarray


@compiled()
def _filter(
    rate: float, step: np.ndarray, memory: np.ndarray, weight: np.ndarray, noise: float, columns: np.ndarray
) -> float:
    """Whiten the columns : (n, k) in place; the sum of the logarithms of the variances of the innovations.

    rate : [1/m] of decay of the scatter, whose variance is `within`; `shown` is that of what the instrument shows of
        it, and `cross` their covariance
    """
    n, k = columns.shape
    within, cross, shown, log_det = 0.0, 0.0, 0.0, 0.0
    state, level, keep = np.zeros(k), np.zeros(k), 1.0
    for t in range(n):
        a, w = memory[t], weight[t]
        if step[t] < 0.0:
            a, shown, within, cross = 0.0, 0.0, 1.0, 0.0
            state[:], level[:] = 0.0, 0.0
        else:
            keep = np.exp(-rate * step[t])
            cross *= keep
            within = within * (keep * keep) + (1.0 - keep * keep)
        b = (1.0 - a) * w
        shown = a * a * shown + 2.0 * a * b * cross + b * b * within
        cross = a * cross + b * within
        variance = shown + noise
        log_det += np.log(variance)
        scale = 1.0 / np.sqrt(variance)
        for c in range(k):
            state[c] *= keep
            level[c] = a * level[c] + b * state[c]
            innovation = columns[t, c] - level[c]
            state[c] += cross / variance * innovation
            level[c] += shown / variance * innovation
            columns[t, c] = innovation * scale
        within -= cross * cross / variance
        cross -= cross * shown / variance
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


def whitened(found: Scatter, course: Course, noise: float, columns: np.ndarray) -> tuple[np.ndarray, float]:
    """Columns : (n, k) as independent unit normals, if they are the scatter of unit variance and noise; log det.

    noise : [-] variance of the white noise over that of the scatter
    """
    if found.shape == "triangle":
        return _whitened_average(found.window, course, float(noise), columns)
    white = np.array(columns, dtype=float, order="C")
    return white, _filter(1.0 / found.length, *course, float(noise), white)
