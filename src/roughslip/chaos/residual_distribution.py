"""The distribution of a target given its predicted value, and the expectations that follow from it.

An expansion in 8 of 101 variables predicts a conditional mean. Where the true response bends, above all at first
contact, a polynomial has an error that depends on the prediction s. Around the prediction the target also scatters, by
an amount that depends on s. Both are estimated from predictions of samples that the fit has not seen:

    target given s = m(s) + e,   m a cubic regression spline, e distributed as the residuals of predictions near s.

With this distribution the drawn pressures keep their width and their contact probability although most variables are
left out. The positive part of a predicted target alone would not: some nodes predicted apart from the plane touch it,
and the reverse. Contact probability and mean pressure given the prediction,

    P(contact | s) = P(target > 0 | s),   E[p | s] = E[pressure(target) | s],

are smooth functions of s, stored as tables. For vanishing scatter both become those of the prediction itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from roughslip.chaos.pressure import PressureTarget
from roughslip.compilation.cache import compiled
from roughslip.errors import IllPosedError, ParameterError
from roughslip.validation import finite

SPLINE_PIECES = 5  # of m(s), with equal numbers of samples; 4 to 12 give distributions equal within their scatter
PLACES = 50  # values of s with a distribution of e, with equal numbers of samples between them
NEIGHBOURS = 0.04  # share of the samples whose residuals are used at each place, at least LEAST_NEIGHBOURS samples
LEAST_NEIGHBOURS = 40
QUANTILES = 201  # stored quantiles of e, from its least to its largest value
LEAST_SAMPLES = 100

REACH = 1.5  # times the mean target in contact; lower predictions are out of contact, unless a sample was not
TABLE_PLACES = 2000  # evenly spaced up to the largest target, which near a border is some 40 times the mean
DRAWS = 200  # quantiles of the scatter over which a mean is taken


@dataclass(frozen=True)
class ResidualScatter:
    """The distribution of a target given its prediction.

    mean : m(s); a straight line outside the range of the fitted predictions
    low, high : ends of that range
    places : (PLACES,) s, ascending
    quantiles : (PLACES, QUANTILES) of e at each
    """

    mean: BSpline
    low: float
    high: float
    places: np.ndarray
    quantiles: np.ndarray

    def centre(self, predicted: np.ndarray) -> np.ndarray:
        """m(s) : (...) at predictions : (...)."""
        inside = np.clip(predicted, self.low, self.high)
        slope = self.mean.derivative()
        ends = np.where(predicted < self.low, slope(self.low), slope(self.high))
        return np.asarray(self.mean(inside) + ends * (predicted - inside))

    def draw(self, predicted: np.ndarray, uniform: np.ndarray) -> np.ndarray:
        """A target : (...) for each prediction : (...), at the quantile uniform : (...) in [0, 1).

        Quantiles are linear between places and constant outside. They are continuous in both arguments and in the
        samples, so two distributions can be compared by the same draws without noise.
        """
        place, far = self._place(predicted)
        rank, share = np.divmod(uniform * (QUANTILES - 1), 1.0)
        below = rank.astype(np.int64)
        e = (1 - share) * self._between(place, far, below) + share * self._between(place, far, below + 1)
        return self.centre(predicted) + e

    def _between(self, place: np.ndarray, far: np.ndarray, rank: np.ndarray) -> np.ndarray:
        return (1 - far) * self.quantiles[place - 1, rank] + far * self.quantiles[place, rank]

    def cumulative(self, predicted: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Cumulative distribution of the target given its prediction, the inverse of `draw`.

        predicted : (n,)
        target : (m,)

        Returns F : (n, m) [-].
        """
        place, far = self._place(predicted)
        e = target - self.centre(predicted)[:, None]
        probabilities, found = np.linspace(0, 1, QUANTILES), np.empty(e.shape)
        for row in range(len(predicted)):
            quantiles = (1 - far[row]) * self.quantiles[place[row] - 1] + far[row] * self.quantiles[place[row]]
            found[row] = np.interp(e[row], quantiles, probabilities, left=0.0, right=1.0)
        return found

    def _place(self, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Index of the place above each prediction, and the relative distance [-] from the place below."""
        inside = np.clip(predicted, self.places[0], self.places[-1])
        place = np.minimum(np.searchsorted(self.places, inside, side="right"), PLACES - 1)
        low, high = self.places[place - 1], self.places[place]
        return place, np.divide(inside - low, high - low, out=np.zeros_like(low), where=high > low)


def residual_scatter(predicted: np.ndarray, target: np.ndarray) -> ResidualScatter:
    """Estimate the distribution of a target given its prediction.

    predicted : (n,) predictions, each made without its own sample
    target : (n,) true values

    Raises ParameterError for arrays that do not match or are not finite; IllPosedError for fewer than LEAST_SAMPLES
    samples, or predictions that are all alike.

    Method: least-squares cubic spline with knots at quantiles of s; residuals of nearest neighbours in s, as in the
    local bootstrap of Shi (J. Stat. Comput. Simul. 39 (1991) 1).
    """
    predicted, target = finite("predictions", predicted, 1), finite("targets", target, 1)
    if predicted.shape != target.shape:
        raise ParameterError(f"a target for each prediction is needed, not {target.shape} for {predicted.shape}")
    if len(predicted) < LEAST_SAMPLES:
        raise IllPosedError(
            f"{len(predicted)} samples in or near contact are too few to estimate the scatter of the target; "
            f"{LEAST_SAMPLES} are needed: take more samples or a deeper penetration"
        )
    order = np.argsort(predicted, kind="stable")
    s, t = predicted[order], target[order]
    knots = np.quantile(s, np.linspace(0, 1, SPLINE_PIECES + 1))
    if not np.all(np.diff(knots) > 0):
        raise IllPosedError("predictions are all alike: the expansion explains nothing; take other variables")
    padded = np.concatenate([[knots[0]] * 3, knots, [knots[-1]] * 3])
    design = BSpline.design_matrix(s, padded, 3).toarray()
    coefficients = np.linalg.lstsq(design, t, rcond=None)[0]
    mean = BSpline(padded, coefficients, 3)
    residual = t - mean(s)
    n = len(s)
    window = min(n, max(LEAST_NEIGHBOURS, round(NEIGHBOURS * n)))
    middle = (np.arange(PLACES) + 0.5) / PLACES * n
    first = np.clip(middle.astype(np.int64) - window // 2, 0, n - window)
    windows = residual[first[:, None] + np.arange(window)]
    quantiles = np.quantile(windows, np.linspace(0, 1, QUANTILES), axis=1).T
    return ResidualScatter(mean, float(s[0]), float(s[-1]), s[middle.astype(np.int64)], quantiles)


@dataclass(frozen=True)
class ConditionalMeans:
    """Contact probability and mean pressure as tables over the prediction, one for each penetration.

    target : how a target gives the pressure
    low, step : (levels,) [target] first place of each table, and distance between places
    scatter : (levels,) [target] root mean square of the target around m(s)
    contact : (levels, TABLE_PLACES) [-] P(contact | s)
    pressure : (levels, TABLE_PLACES) [Pa] E[p | s]
    """

    target: PressureTarget
    low: np.ndarray
    step: np.ndarray
    scatter: np.ndarray
    contact: np.ndarray
    pressure: np.ndarray

    def at(self, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Contact probability [-] and mean pressure [Pa] : (levels, ...) at predictions : (levels, ...).

        Linear between places, zero below the first, and constant above the last, the largest true target, because
        polynomials grow without bound. A scatter narrower than two places is not resolved and is neglected.
        """
        if len(predicted) != len(self.low):
            raise ParameterError(f"{len(predicted)} levels of predictions for tables of {len(self.low)}")
        contact, pressure = np.empty(predicted.shape), np.empty(predicted.shape)
        for level, s in enumerate(predicted):
            if self.scatter[level] <= 2 * self.step[level]:
                contact[level], pressure[level] = s > 0, self.target.pressure(s)
                continue
            scale = self.low[level], self.step[level]
            _interpolate(s.ravel(), *scale, self.contact[level], contact[level].reshape(-1))
            _interpolate(s.ravel(), *scale, self.pressure[level], pressure[level].reshape(-1))
        return contact, pressure


def conditional_means(predicted: np.ndarray, values: np.ndarray, target: PressureTarget) -> ConditionalMeans:
    """Tabulate contact probability and mean pressure from predictions of samples that the fit has not seen.

    predicted, values : (levels, n) [target] predictions and true values, at n nodes of all rows
    target : how a target gives the pressure

    Returns the tables. Raises ParameterError for arrays that do not match, and IllPosedError as `residual_scatter` for
    too few samples near contact.
    """
    if predicted.shape != values.shape or predicted.ndim != 2:
        raise ParameterError(f"predictions {predicted.shape} and values {values.shape} must match, a row a penetration")
    levels = len(predicted)
    low, step, scatter = np.empty((3, levels))
    contact, pressure = np.empty((2, levels, TABLE_PLACES))
    uniform = (np.arange(DRAWS) + 0.5) / DRAWS
    for level, (s, value) in enumerate(zip(predicted, values, strict=True)):
        touching = value > 0
        lowest = -REACH * float(value[touching].mean()) if touching.any() else 0.0
        near = s >= min(lowest, float(s[touching].min(initial=lowest)))
        distribution = residual_scatter(s[near], value[near])
        places = np.linspace(distribution.low, min(distribution.high, float(value.max())), TABLE_PLACES)
        drawn = distribution.draw(places[:, None], uniform)
        low[level], step[level] = places[0], places[1] - places[0]
        scatter[level] = np.sqrt(np.mean((value[near] - distribution.centre(s[near])) ** 2))
        contact[level], pressure[level] = (drawn > 0).mean(axis=1), target.pressure(drawn).mean(axis=1)
    return ConditionalMeans(target, low, step, scatter, contact, pressure)


@compiled()
def _interpolate(s: np.ndarray, low: float, step: float, table: np.ndarray, found: np.ndarray) -> None:
    """Write the table at s : (n,), zero below its first place and constant above its last; NaN where s is NaN."""
    last = len(table) - 1
    for k in range(len(s)):
        place = min((s[k] - low) / step, float(last))
        if place > 0:
            below = min(int(place), last - 1)
            found[k] = table[below] + (place - below) * (table[below + 1] - table[below])
        else:
            found[k] = 0.0 * place
