"""Scatter along the slipped distance, seen through an instrument: its most likely numbers, and synthetic records.

The scatter x(s) has an exponential autocorrelation, so it is a first-order process in the distance s. The instrument is
a first-order low-pass in time, of the mean as of the scatter, and white noise is added to what it shows. A Kalman
filter whitens data and regressors alike, in O(n), so that generalised least squares is ordinary least squares.

The likelihood is restricted: that of what no regressor explains, so that a curve of ten parameters takes no scatter
with it (H. D. Patterson & R. Thompson, Biometrika 58 (1971) 545). The filter is that of J. Hartikainen & S. Särkkä,
IEEE Int. Workshop MLSP (2010) 379, for Gaussian processes as state-space models.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from scipy.optimize import minimize

from roughslip.compilation.cache import compiled
from roughslip.errors import IllPosedError

STEP = 0.02  # of a logarithm, for second differences of the likelihood
NOISE = (-9.0, 4.0)  # bounds of the logarithm of the variance of the noise over that of the scatter
SEARCH: Any = {"method": "L-BFGS-B", "options": {"eps": 1e-4, "ftol": 1e-8}}  # parameters are logarithms
LENGTHS, SLOWER = (-1.2, 1.2), 1.1  # of logarithms: starts of a search without one
AT_BOUND = 0.05  # of a logarithm: nearer to a bound a parameter is not identified, and is kept there


@dataclass(frozen=True, eq=False)
class SlidingSamples:
    """All records, one after another.

    friction : (n,) [-] as measured; speed : (n,) [m/s] of sliding
    step : (n,) [m] slipped since the sample before, negative at the first sample of a record
    seconds : (n,) [s] since the sample before
    change : (n,) [m/s^2] of the speed of the belt
    lag : whether the mean passes through the instrument; a symmetric smoothing, as of slips, shows it without lag
    """

    friction: np.ndarray
    speed: np.ndarray
    step: np.ndarray
    seconds: np.ndarray
    change: np.ndarray
    lag: bool = True

    @property
    def slipped(self) -> np.ndarray:
        """(n,) [m] in all."""
        return np.cumsum(np.maximum(self.step, 0.0))

    @property
    def records(self) -> list[np.ndarray]:
        """Numbers of the samples of each record."""
        return np.split(np.arange(self.step.size), np.flatnonzero(self.step < 0.0)[1:])

    @property
    def elapsed(self) -> np.ndarray:
        """(n,) [s] in all."""
        return np.cumsum(np.where(self.step < 0.0, 0.0, self.seconds))

    def response(self, time_constant_s: float, digital: bool) -> np.ndarray:
        """(n, 3) what an instrument shows of what it showed at the sample before, and of what was there and is here.

        It is a first-order low-pass of samples (digital), or of time, where values are a straight line between them.
        """
        first = self.step < 0.0
        if time_constant_s == 0.0:
            return np.tile([0.0, 0.0, 1.0], (first.size, 1))
        keep = np.exp(-self.seconds / time_constant_s)
        here = 1.0 - (keep if digital else (1.0 - keep) * time_constant_s / self.seconds)
        return np.where(first[:, None], [0.0, 0.0, 1.0], np.column_stack([keep, 1.0 - keep - here, here]))

    def shown(self, mean: np.ndarray, response: np.ndarray) -> np.ndarray:
        """Columns : (n, k), or (n,), of the mean as the instrument shows them. response : (n, 3)"""
        return through_instrument(mean, response) if self.lag else mean


def scatter_path(slipped_m: np.ndarray, length_m: float, generator: np.random.Generator) -> np.ndarray:
    """A Gaussian path of unit variance at slipped distances : (n,) [m], which do not fall: an exact recursion."""
    keep = np.exp(-np.diff(slipped_m, prepend=-np.inf) / length_m)
    path = np.sqrt(1.0 - keep**2) * generator.standard_normal(keep.size)
    for t in range(1, path.size):
        path[t] += keep[t] * path[t - 1]
    return path


def through_instrument(values: np.ndarray, response: np.ndarray) -> np.ndarray:
    """Columns : (n, k), or (n,), as an instrument shows them. response : (n, 3)"""
    keep, old, new = response.T
    shown = np.ascontiguousarray((old * np.roll(values, 1, axis=0).T + new * values.T).T)
    _remember(keep, shown.reshape(keep.size, -1))
    return shown


@compiled()
def _remember(keep: np.ndarray, columns: np.ndarray) -> None:
    """Add to columns : (n, k) what is kept of the sample before, in place."""
    for t in range(1, len(columns)):
        for c in range(columns.shape[1]):
            columns[t, c] += keep[t] * columns[t - 1, c]


def whitened(
    length_m: float, step: np.ndarray, response: np.ndarray, weight: np.ndarray, noise: float, columns: np.ndarray
) -> tuple[np.ndarray, float]:
    """Columns : (n, k) as independent unit normals, if they are the scatter of unit variance and noise; log det.

    step : (n,) [m] slipped since the sample before; negative at the first of a record, which forgets what was before
    response : (n, 3) [-] of the instrument
    weight : (n,) [-] factor of the scatter at the sample: 1, or the mean friction over its average
    noise : [-] variance of the white noise over that of the scatter
    """
    white = np.array(columns, dtype=float, order="C")
    return white, _filter(1.0 / length_m, step, response, weight, float(noise), white)


@compiled()
def _filter(
    rate: float, step: np.ndarray, response: np.ndarray, weight: np.ndarray, noise: float, columns: np.ndarray
) -> float:
    """Whiten the columns : (n, k) in place; the sum of the logarithms of the variances of the innovations.

    rate : [1/m] of decay of the scatter, whose variance is `within`; `shown` is that of what the instrument shows of
        it, and `cross` their covariance
    """
    n, k = columns.shape
    within, cross, shown, log_det = 0.0, 0.0, 0.0, 0.0
    state, level = np.zeros(k), np.zeros(k)
    for t in range(n):
        a, old, new = response[t]
        keep = np.exp(-rate * step[t]) if step[t] >= 0.0 else 0.0
        kick, old, new = 1.0 - keep * keep, old * weight[t - 1] + new * weight[t] * keep, new * weight[t]
        shown = a * a * shown + 2.0 * a * old * cross + old * old * within + new * new * kick
        cross = keep * (a * cross + old * within) + new * kick
        within = within * (keep * keep) + kick
        variance = shown + noise
        log_det += np.log(variance)
        scale = 1.0 / np.sqrt(variance)
        for c in range(k):
            level[c] = a * level[c] + old * state[c]
            state[c] *= keep
            innovation = columns[t, c] - level[c]
            state[c] += cross / variance * innovation
            level[c] += shown / variance * innovation
            columns[t, c] = innovation * scale
        within -= cross * cross / variance
        cross -= cross * shown / variance
        shown -= shown * shown / variance
    return log_det


@dataclass(frozen=True, eq=False)
class ProcessFit:
    """The most likely scatter about given regressors.

    length : [m] correlation length, the integral of the autocorrelation from zero on
    deviation : [-] of the scatter; noise : [-] deviation of the white noise
    time_constant : [s] of the instrument; digital : whether it is a low-pass of samples
    log_covariance : (2, 2) of log deviation and log length
    log_likelihood : restricted, comparable where the regressors are the same
    """

    length: float
    deviation: float
    noise: float
    time_constant: float
    digital: bool
    log_covariance: np.ndarray
    log_likelihood: float
    weight: np.ndarray

    def whiten(self, samples: SlidingSamples, regressors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Friction : (n,), and regressors : (n, k) of the mean after the instrument, as independent unit normals."""
        response, noise = samples.response(self.time_constant, self.digital), (self.noise / self.deviation) ** 2
        columns = np.column_stack([samples.friction, samples.shown(regressors, response)])
        white = whitened(self.length, samples.step, response, self.weight, noise, columns)[0] / self.deviation
        return white[:, 0], white[:, 1:]


def fitted_process(
    samples: SlidingSamples,
    regressors: np.ndarray,
    time_constant_s: float | None,
    weight: np.ndarray,
    start: ProcessFit | None = None,
    needs_scatter: bool = True,
    shortest_m: float = 0.0,
) -> ProcessFit:
    """The most likely scatter, and instrument of the two kinds.

    regressors : (n, k) of the mean, of full rank
    time_constant_s : [s] of the instrument; None to fit it
    weight : (n,) of the scatter: ones, or the mean friction over its average
    start : a fit to begin with
    needs_scatter : whether scatter has to differ from noise; else its covariance is NaN
    shortest_m : [m] least correlation length

    Raises IllPosedError where the likelihood has no maximum within its bounds.
    """
    n, k = len(regressors), len(regressors.T)
    first, bounds = _search_space(samples, time_constant_s, start, shortest_m)

    def parts(theta: np.ndarray, digital: bool) -> tuple[float, float]:
        """Sum of squares that no regressor explains, and twice the other terms of the likelihood."""
        length, noise, *_ = np.exp(theta)
        response = samples.response(_seconds(theta, time_constant_s), digital)
        columns = np.column_stack([samples.friction, samples.shown(regressors, response)])
        white, log_det = whitened(float(length), samples.step, response, weight, noise, columns)
        upper = np.asarray(np.linalg.qr(np.column_stack([white[:, 1:], white[:, 0]]), mode="r"))
        return float(upper[-1, -1] ** 2), log_det + 2.0 * float(np.sum(np.log(np.abs(np.diag(upper))[:-1])))

    def profile(theta: np.ndarray, digital: bool) -> float:
        squares, others = parts(theta, digital)
        return (n - k) * np.log(squares) + others

    starts = [first] if start is not None else [[first[0] + a, *first[1:]] for a in LENGTHS]
    if start is None and time_constant_s is None:  # noise and low-pass hide each other, so the likelihood has two tops
        starts += [[*one[:2], one[2] + SLOWER] for one in starts]
    searches = [
        (minimize(profile, np.clip(at, *np.transpose(bounds)), (digital,), bounds=bounds, **SEARCH), digital)
        for at, digital in product(starts, [True, False] if start is None else [start.digital])
    ]
    best, digital = min(searches, key=lambda one: float(one[0].fun))
    theta = np.asarray(best.x)
    deviation = float(np.sqrt(parts(theta, digital)[0] / (n - k)))

    def minus_twice(full: np.ndarray) -> float:
        squares, others = parts(full[1:], digital)
        return 2.0 * (n - k) * full[0] + squares * np.exp(-2.0 * full[0]) + others

    free = [0, *(i + 1 for i, (low, high) in enumerate(bounds) if low + AT_BOUND < theta[i] < high - AT_BOUND)]
    found = np.append(np.log(deviation), theta)
    covariance = _covariance(minus_twice, found, free) if needs_scatter and 1 in free else None
    if covariance is None and needs_scatter:
        lengths = "no correlation length from {:.2g} m, a third of a sample, to {:.2g} m, the record"
        text = f"the record cannot tell its scatter: {lengths.format(*np.exp(bounds[0]))}, is the most likely one"
        raise IllPosedError(f"{text}; record longer, or with more samples a second")
    return ProcessFit(
        float(np.exp(theta[0])),
        deviation,
        deviation * float(np.exp(0.5 * theta[1])),
        _seconds(theta, time_constant_s),
        digital,
        np.full((2, 2), np.nan) if covariance is None else covariance,
        -0.5 * minus_twice(found),
        weight,
    )


def _search_space(
    samples: SlidingSamples, time_constant_s: float | None, start: ProcessFit | None, shortest_m: float
) -> tuple[list[float], list[tuple[float, float]]]:
    """Start and bounds of the logarithms of length, noise and time constant."""
    total, dt = float(np.sum(np.maximum(samples.step, 0.0))), float(np.median(samples.seconds))
    ds = float(np.median(samples.step[samples.step > 0.0]))
    first, bounds = [np.log(10.0 * ds), np.log(0.02)], [(np.log(max(0.3 * ds, shortest_m)), np.log(total)), NOISE]
    if start is not None:
        first = [np.log(start.length), 2.0 * np.log(max(start.noise / start.deviation, 0.05))]
    if time_constant_s is None:
        bounds.append((np.log(0.1 * dt), np.log(30.0 * dt)))
        first.append(np.log(0.5 * dt if start is None else max(start.time_constant, 0.2 * dt)))
    return first, bounds


def _seconds(theta: np.ndarray, time_constant_s: float | None) -> float:
    """Time constant [s]: the one known, or the third of the parameters."""
    return float(np.exp(theta[2])) if time_constant_s is None else time_constant_s


def _covariance(minus_twice: Callable[[np.ndarray], float], at: np.ndarray, free: list[int]) -> np.ndarray | None:
    """(2, 2) covariance of the first two parameters: the inverse of the observed information of the free ones.

    The last of these is kept where it is, as long as the likelihood has no maximum in it. None without any maximum.
    """
    count = len(free)
    hessian = np.empty((count, count))
    steps = np.zeros((count, at.size))
    steps[np.arange(count), free] = STEP
    centre = minus_twice(at)
    one = [(minus_twice(at + step), minus_twice(at - step)) for step in steps]
    for i in range(count):
        hessian[i, i] = (one[i][0] + one[i][1] - 2.0 * centre) / STEP**2
        for j in range(i):
            corners = minus_twice(at + steps[i] + steps[j]) + minus_twice(at - steps[i] - steps[j])
            corners += 2.0 * centre - sum(one[i]) - sum(one[j])
            hessian[i, j] = hessian[j, i] = corners / (2.0 * STEP**2)
    for kept in range(count, 1, -1):
        values, vectors = np.linalg.eigh(0.5 * hessian[:kept, :kept])
        if values[0] > 0.0:
            return np.asarray((vectors / values @ vectors.T)[:2, :2])
    return None
