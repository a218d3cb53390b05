"""What an expansion leaves unsaid: the law of a target given its predicted value.

An expansion in 8 of 101 variables predicts a conditional mean. Where the true response bends, at first contact above
all, a polynomial errs in a way that depends on the prediction s itself; and around it the target scatters, more at some
s than at others. Both are read off predictions of samples that the fit has not seen:

    target given s = m(s) + e,   m a cubic regression spline, e distributed as residuals of predictions near s.

Drawn so, the distribution keeps its width and its contact probability though most variables are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from roughslip.errors import IllPosedError, ParameterError
from roughslip.validation import finite

SPLINE_PIECES = 5  # of m(s), as many samples in each; 4 to 12 give distributions equal within their scatter
PLACES = 50  # s at which the law of e is taken, as many samples from one to the next
NEIGHBOURS = 0.04  # share of the samples that serve at each, and no fewer than LEAST_NEIGHBOURS
LEAST_NEIGHBOURS = 40
QUANTILES = 201  # of e that are kept, from its least to its largest value
LEAST_SAMPLES = 100


@dataclass(frozen=True)
class ResidualScatter:
    """The law of a target given its prediction.

    mean : m(s); a straight line beyond the predictions that it was fitted to
    low, high : the least and the largest of these
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
        """A target : (...) for each prediction : (...), at the quantile uniform : (...) in [0, 1) of its law.

        Quantiles are linear from place to place and constant beyond. Continuous in both arguments and in the samples,
        so that the same draws tell two laws apart without noise.
        """
        place, far = self._place(predicted)
        rank, share = np.divmod(uniform * (QUANTILES - 1), 1.0)
        below = rank.astype(np.int64)
        e = (1 - share) * self._between(place, far, below) + share * self._between(place, far, below + 1)
        return self.centre(predicted) + e

    def _between(self, place: np.ndarray, far: np.ndarray, rank: np.ndarray) -> np.ndarray:
        return (1 - far) * self.quantiles[place - 1, rank] + far * self.quantiles[place, rank]

    def cumulative(self, predicted: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Law of the target given its prediction, the inverse of `draw`.

        predicted : (n,)
        target : (m,)

        Returns F : (n, m) [-] probability that the target is at most so much.
        """
        place, far = self._place(predicted)
        e = target - self.centre(predicted)[:, None]
        probabilities, found = np.linspace(0, 1, QUANTILES), np.empty(e.shape)
        for row in range(len(predicted)):
            quantiles = (1 - far[row]) * self.quantiles[place[row] - 1] + far[row] * self.quantiles[place[row]]
            found[row] = np.interp(e[row], quantiles, probabilities, left=0.0, right=1.0)
        return found

    def _place(self, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The place above each prediction, and how far it lies from the one below, as a share."""
        inside = np.clip(predicted, self.places[0], self.places[-1])
        place = np.minimum(np.searchsorted(self.places, inside, side="right"), PLACES - 1)
        low, high = self.places[place - 1], self.places[place]
        return place, np.divide(inside - low, high - low, out=np.zeros_like(low), where=high > low)


def residual_scatter(predicted: np.ndarray, target: np.ndarray) -> ResidualScatter:
    """The law of a target given its prediction, from samples.

    predicted : (n,) predictions, each made without its own sample
    target : (n,) what came

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
            f"{len(predicted)} samples in or near contact are too few to tell how the target scatters; {LEAST_SAMPLES} "
            "are needed: take more samples or a deeper penetration"
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
