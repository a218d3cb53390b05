"""Fit of scatter, instrument and noise by restricted maximum likelihood, and the errors of what is fitted.

Restricted: the likelihood of what no regressor explains, so that a curve of ten parameters takes no scatter with it
(H. D. Patterson & R. Thompson, Biometrika 58 (1971) 545).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from roughslip.errors import IllPosedError
from roughslip.record.process import Course, Scatter, samples_a_window, whitened

STEP = 0.02  # of a logarithm, for second differences of the likelihood
NOISE = (-9.0, 4.0)  # bounds of the logarithm of the variance of the noise over that of the scatter
OPTIONS = {"eps": 1e-4, "ftol": 1e-8}  # of the search, whose parameters are logarithms
LENGTHS, SLOWER = (-1.2, 1.2), 1.1  # of logarithms: starts of a search without one
RANGE, SCANS = (-1.2, 0.4), (0.1, 0.02)  # of the logarithm of the length of a triangle over that of an exponential
AS_PARAMETERS = 2  # for which a triangle counts: by its kinks, records without one gain a factor of up to e^4
MOST_A_WINDOW = 400  # samples, of a triangle: a wider band takes minutes
AT_BOUND = 0.05  # of a logarithm: nearer to a bound a parameter is not identified, and is kept there


@dataclass(frozen=True, eq=False)
class Samples:
    """All records, one after another.

    friction : (n,) [-] as measured; speed : (n,) [m/s] of sliding
    step : (n,) [m] slipped since the sample before, negative at the first sample of a record
    seconds : (n,) [s] since the sample before
    change : (n,) [m/s^2] of the speed of the belt
    """

    friction: np.ndarray
    speed: np.ndarray
    step: np.ndarray
    seconds: np.ndarray
    change: np.ndarray

    @property
    def slipped(self) -> np.ndarray:
        """(n,) [m] in all."""
        return np.cumsum(np.maximum(self.step, 0.0))

    @property
    def elapsed(self) -> np.ndarray:
        """(n,) [s] in all."""
        return np.cumsum(np.where(self.step < 0.0, 0.0, self.seconds))

    def course(self, time_constant_s: float, weight: np.ndarray) -> Course:
        """What the samples went through with an instrument of this time constant [s]."""
        memory = np.exp(-self.seconds / time_constant_s) if time_constant_s > 0.0 else np.zeros(self.seconds.size)
        return Course(self.step, memory, weight)


@dataclass(frozen=True, eq=False)
class ProcessFit:
    """The most likely scatter of one shape about given regressors.

    scatter : shape and correlation length
    deviation : [-] of the scatter; noise : [-] deviation of the white noise
    time_constant : [s] of the instrument
    log_covariance : (2, 2) of log deviation and log length
    log_likelihood : restricted, comparable where the regressors are the same
    """

    scatter: Scatter
    deviation: float
    noise: float
    time_constant: float
    log_covariance: np.ndarray
    log_likelihood: float
    weight: np.ndarray

    @property
    def criterion(self) -> float:
        """Bayesian criterion: less is better."""
        count = AS_PARAMETERS if self.scatter.shape == "triangle" else 0
        return count * float(np.log(self.weight.size)) - 2.0 * self.log_likelihood

    def whiten(self, samples: Samples, columns: np.ndarray) -> np.ndarray:
        """Columns : (n, k) as independent unit normals."""
        course = samples.course(self.time_constant, self.weight)
        return whitened(self.scatter, course, (self.noise / self.deviation) ** 2, columns)[0] / self.deviation


def fitted_process(
    samples: Samples,
    regressors: np.ndarray,
    shape: str,
    time_constant_s: float | None,
    weight: np.ndarray,
    start: ProcessFit | None = None,
) -> ProcessFit:
    """The most likely scatter of a shape.

    regressors : (n, k) of the mean, of full rank
    time_constant_s : [s] of the instrument; None to fit it
    weight : (n,) of the scatter: ones, or the mean friction over its average
    start : a fit to begin with

    A triangle needs a start. Raises IllPosedError where the likelihood has no maximum within its bounds, or a triangle
    would hold more samples than MOST_A_WINDOW.
    """
    columns = np.column_stack([samples.friction, regressors])
    n, k = len(regressors), len(regressors.T)
    first, bounds = _search_space(samples, shape, time_constant_s, start)

    def parts(theta: np.ndarray) -> tuple[float, float]:
        """Sum of squares that no regressor explains, and twice the other terms of the likelihood."""
        course = samples.course(_seconds(theta, time_constant_s), weight)
        white, log_det = whitened(Scatter(shape, float(np.exp(theta[0]))), course, np.exp(theta[1]), columns)
        upper = np.asarray(np.linalg.qr(np.column_stack([white[:, 1:], white[:, 0]]), mode="r"))
        return float(upper[-1, -1] ** 2), log_det + 2.0 * float(np.sum(np.log(np.abs(np.diag(upper))[:-1])))

    def profile(theta: np.ndarray) -> float:
        squares, others = parts(theta)
        return (n - k) * np.log(squares) + others

    starts = [first] if start is not None else [[first[0] + a, *first[1:]] for a in LENGTHS]
    if start is None and time_constant_s is None:  # noise and low-pass hide each other, so the likelihood has two tops
        starts += [[*one[:2], one[2] + SLOWER] for one in starts]
    theta = _most_likely_average(profile, first, bounds) if shape == "triangle" else _best(profile, starts, bounds)
    variance = parts(theta)[0] / (n - k)
    deviation = float(np.sqrt(variance))

    def minus_twice(full: np.ndarray) -> float:
        squares, others = parts(full[1:])
        return 2.0 * (n - k) * full[0] + squares * np.exp(-2.0 * full[0]) + others

    free = [0, *(i + 1 for i, (low, high) in enumerate(bounds) if low + AT_BOUND < theta[i] < high - AT_BOUND)]
    found = np.append(np.log(deviation), theta)
    if 1 not in free or (covariance := _covariance(minus_twice, found, free)) is None:
        shortest, longest = np.exp(bounds[0])
        raise IllPosedError(
            f"the record cannot tell its scatter: no correlation length from {shortest:.2g} m, a third of a sample, "
            f"to {longest:.2g} m, the record, is the most likely one; record longer, or with more samples a second"
        )
    return ProcessFit(
        Scatter(shape, float(np.exp(theta[0]))),
        deviation,
        deviation * float(np.exp(0.5 * theta[1])),
        _seconds(theta, time_constant_s),
        covariance,
        -0.5 * minus_twice(found),
        weight,
    )


def _best(
    profile: Callable[[np.ndarray], float],
    starts: list[list[float]],
    bounds: list[tuple[float, float]],
    method: str = "L-BFGS-B",
    options: dict[str, float] = OPTIONS,
) -> np.ndarray:
    """The least of the minima that searches from these starts find."""
    tried = [
        scipy.optimize.minimize(
            profile, np.clip(at, *np.transpose(bounds)), method=method, bounds=bounds, options=options
        )
        for at in starts
    ]
    return np.asarray(min(tried, key=lambda one: float(one.fun)).x)


def _most_likely_average(
    profile: Callable[[np.ndarray], float], first: list[float], bounds: list[tuple[float, float]]
) -> np.ndarray:
    """The minimum for a triangle, with a kink wherever the window is the distance of two samples: lengths are scanned.

    The search after it needs no slope (J. A. Nelder & R. Mead, The Computer Journal 7 (1965) 308).
    """
    (low, high), start = bounds[0], first
    for step in SCANS:
        lengths = [[float(at), *first[1:]] for at in np.arange(low, high, step)]
        start = min(lengths, key=lambda one: profile(np.array(one)))
        low, high = start[0] - step, start[0] + step
    return _best(profile, [start], bounds, "Nelder-Mead", {"xatol": 2e-3, "fatol": 1e-2})


def _search_space(
    samples: Samples, shape: str, time_constant_s: float | None, start: ProcessFit | None
) -> tuple[list[float], list[tuple[float, float]]]:
    """Start and bounds of the logarithms of length, noise and time constant."""
    total, dt = float(np.sum(np.maximum(samples.step, 0.0))), float(np.median(samples.seconds))
    ds = float(np.median(samples.step[samples.step > 0.0]))
    first, bounds = [np.log(10.0 * ds), np.log(0.02)], [(np.log(0.3 * ds), np.log(total)), NOISE]
    if start is not None:
        at = np.log(start.scatter.length)
        if shape == "triangle":
            bounds[0] = (max(bounds[0][0], at + RANGE[0]), min(bounds[0][1], at + RANGE[1]))
            length = start.scatter.length
            if (most := samples_a_window(length, samples.step)) > MOST_A_WINDOW:
                raise IllPosedError(f"a window of {length:.2g} m holds {most} samples, more than {MOST_A_WINDOW}")
        first = [at, 2.0 * np.log(max(start.noise / start.deviation, 0.05))]
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
