"""The distribution of a target given its prediction, estimated from samples that the fit has not seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy  # its parts when they are used

from roughslip.chaos.regression import KEYS, MORE_CONTACT
from roughslip.errors import IllPosedError

SPLINE_PIECES = 5  # of m(s), with equal numbers of samples; 4 to 12 give distributions equal within their scatter
PLACES = 50  # values of s with a distribution of e, with equal numbers of samples between them
NEIGHBOURS = 0.04  # share of the samples whose residuals are used at each place, at least LEAST_NEIGHBOURS samples
LEAST_NEIGHBOURS = 40
QUANTILES = 201  # stored quantiles of e, from its least to its largest value
LEAST_SAMPLES = 100
REACH = 1.5  # times the mean target in contact: how far below zero a prediction may still be of a node in contact


def lowest_in_contact(predicted: np.ndarray, target: np.ndarray, contact: np.ndarray) -> float:
    """The prediction below which nodes count as out of contact, in the unit of the target.

    It is -REACH times the mean target in contact, or the least prediction of a sample in contact where that is lower; 0
    without any contact. Samples further below would only distort the scatter near contact.
    """
    if not contact.any():
        return 0.0
    return min(-REACH * float(target[contact].mean()), float(predicted[contact].min()))


@dataclass(frozen=True)
class ResidualScatter:
    """The distribution of a target given its prediction s: m(s) + e, both estimated from left-out samples.

    A polynomial in few variables errs most at first contact, by a bias m(s) - s and a scatter e that depend on s.
    Draws from this distribution keep the width and the contact probability of the pressure. The positive part of the
    prediction alone would not: some nodes predicted apart from the plane touch it, and the reverse.

    mean : m(s), a cubic regression spline
    low, high : range of the fitted predictions, outside which m(s) is a straight line
    places : (PLACES,) s, ascending
    quantiles : (PLACES, QUANTILES) of e at each
    """

    mean: scipy.interpolate.BSpline
    low: float
    high: float
    places: np.ndarray
    quantiles: np.ndarray

    def centre(self, predicted: np.ndarray) -> np.ndarray:
        """m(s) : (...) at predictions : (...)."""
        inside, ends = np.clip(predicted, self.low, self.high), self.mean.derivative()([self.low, self.high])
        return np.asarray(self.mean(inside) + ends[1 * (predicted > self.low)] * (predicted - inside))

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

    def draw_evenly(self, predicted: np.ndarray, count: int) -> np.ndarray:
        """A target : (n, count) for each prediction : (n,), at evenly spaced quantiles of its distribution."""
        place, far = self._place(predicted)
        ranks = (np.arange(count) + 0.5) / count * (QUANTILES - 1)
        e = np.stack([np.interp(ranks, np.arange(QUANTILES), quantiles) for quantiles in self.quantiles])
        return self.centre(predicted)[:, None] + (1 - far)[:, None] * e[place - 1] + far[:, None] * e[place]

    def _between(self, place: np.ndarray, far: np.ndarray, rank: np.ndarray) -> np.ndarray:
        return (1 - far) * self.quantiles[place - 1, rank] + far * self.quantiles[place, rank]

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

    Raises IllPosedError for fewer than LEAST_SAMPLES samples, or predictions that are all alike.

    Method: least-squares cubic spline with knots at quantiles of s; residuals of nearest neighbours in s, as in the
    local bootstrap of Shi (J. Stat. Comput. Simul. 39 (1991) 1).
    """
    if len(predicted) < LEAST_SAMPLES:
        raise IllPosedError(
            f"{len(predicted)} samples in or near contact give no scatter, {LEAST_SAMPLES} do: {MORE_CONTACT}",
            KEYS,
        )
    order = np.argsort(predicted, kind="stable")
    s, t = predicted[order], target[order]
    knots = np.quantile(s, np.linspace(0, 1, SPLINE_PIECES + 1))
    if not np.all(np.diff(knots) > 0):
        raise IllPosedError(
            f"one in {SPLINE_PIECES} predictions or more are alike: take more variables or a higher degree",
            scene_keys="expansion.degree",
        )
    mean = scipy.interpolate.make_lsq_spline(s, t, np.concatenate([knots[:1].repeat(3), knots, knots[-1:].repeat(3)]))
    residual = t - mean(s)
    n = len(s)
    window = min(n, max(LEAST_NEIGHBOURS, round(NEIGHBOURS * n)))
    middle = (np.arange(PLACES) + 0.5) / PLACES * n
    first = np.clip(middle.astype(np.int64) - window // 2, 0, n - window)
    windows = residual[first[:, None] + np.arange(window)]
    quantiles = np.quantile(windows, np.linspace(0, 1, QUANTILES), axis=1).T
    return ResidualScatter(mean, float(s[0]), float(s[-1]), s[middle.astype(np.int64)], quantiles)
