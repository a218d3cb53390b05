"""How friction changes with penetration: mu_fit(d) between the solved levels, trends over them, and p-values.

mu_fit(d) is a cubic through the levels and monotone between two levels, so it shows no trend that the statistics do
not show (Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238; Fritsch and Butland, SIAM J. Sci.
Stat. Comput. 5 (1984) 300). Each resampled set of levels gives one curve, and these curves give the band.

Replicates scatter about the sample as the sample scatters about the truth. So the p-value of a number theta counts how
often its replicates lie as far from theta as the tested value does (the pivot; Hall and Wilson, Biometrics 47 (1991)
757: resample what the null hypothesis would give). p = (1 + number as far) / (1 + replicates) is never 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from roughslip.errors import IllPosedError, ParameterError
from roughslip.probability import Estimate
from roughslip.validation import reals


@dataclass(frozen=True)
class PenetrationCurve:
    """A statistic of friction as a function of penetration, continuous with its first derivative.

    percentiles : (L,) [%] penetrations, increasing; L >= 2
    rows : (1 + R, L) the statistic at each, and below it its replicates
    """

    percentiles: np.ndarray
    rows: np.ndarray

    def at(self, percentile: np.ndarray) -> Estimate:
        """The statistic at penetrations : (...) [%] between the first and the last level, with its band."""
        return Estimate.from_rows(self._curves()(self._inside(percentile)))

    def slope(self, percentile: np.ndarray) -> Estimate:
        """Its derivative : (...) [1/%] there; continuous, with kinks at the levels."""
        return Estimate.from_rows(self._curves().derivative()(self._inside(percentile)))

    def _curves(self) -> scipy.interpolate.PchipInterpolator:
        return scipy.interpolate.PchipInterpolator(self.percentiles, self.rows, axis=1, extrapolate=False)

    def _inside(self, percentile: float | np.ndarray) -> np.ndarray:
        points = reals("penetrations", percentile)
        first, last = self.percentiles[0], self.percentiles[-1]
        if not ((points >= first) & (points <= last)).all():
            raise ParameterError(f"penetrations must lie between the levels {first:g} and {last:g} %: solve others too")
        return points


def between(percentiles: np.ndarray, values: np.ndarray, percentile: float) -> float:
    """The curve through values : (L,) at percentiles : (L,) [%], increasing, at one penetration; at a level its value.

    Raises ParameterError for a penetration that is neither a level nor between two.
    """
    level = np.flatnonzero(percentiles == percentile)
    if level.size:
        return float(values[level[0]])
    curve = PenetrationCurve(np.asarray(percentiles, dtype=np.float64), np.asarray(values)[None])
    return float(curve._curves()(curve._inside(percentile))[0])


def penetration_curve(percentiles: np.ndarray, estimates: list[Estimate]) -> PenetrationCurve:
    """The curve through estimates : L of () at percentiles : (L,) [%], increasing, that share their replicates.

    Raises IllPosedError for fewer than two levels, ParameterError for percentiles that do not increase or match.
    """
    q = _levels(percentiles, len(estimates))
    return PenetrationCurve(q, np.stack([estimate.rows for estimate in estimates], axis=1))


def _levels(percentiles: np.ndarray, count: int) -> np.ndarray:
    """The percentiles as floats; refuses all but `count` increasing ones, at least two."""
    q = reals("percentiles", percentiles)
    if q.ndim != 1 or not np.isfinite(q).all() or len(q) != count or not (np.diff(q) > 0.0).all():
        raise ParameterError("statistics over penetration need increasing, finite percentiles, one for each value")
    if len(q) < 2:
        raise IllPosedError("a curve or trend over penetration needs at least two levels")
    return q


@dataclass(frozen=True)
class Trend:
    """Change of a statistic from the first to the last level.

    line : along the least-squares straight line through all levels
    change : last less first level
    """

    line: Estimate
    change: Estimate

    @property
    def direction(self) -> int:
        """-1 or 1 where both intervals lie on that side of 0, else 0: no direction is shown."""
        down = self.line.high < 0.0 and self.change.high < 0.0
        up = self.line.low > 0.0 and self.change.low > 0.0
        return int(up) - int(down)


def trend(percentiles: np.ndarray, values: np.ndarray, replicates: np.ndarray) -> Trend:
    """Does a statistic rise or fall with penetration?

    percentiles : (L,) [%] penetration, increasing
    values, replicates : (L,), (L, R) the statistic per level, all levels resampled with the same weights

    Rule: it falls if the 95 % intervals of the change along the line and of last - first both lie below 0.
    """
    values = reals("values of a trend", values)
    q = _levels(percentiles, values.size)
    if values.shape != q.shape or replicates.shape[:1] != q.shape:
        raise ParameterError("a trend needs a value and a row of replicates at each percentile")
    rows = np.concatenate((values[:, None], replicates), axis=1)
    if not np.isfinite(rows).all():
        raise ParameterError("values and replicates of a trend must be finite")
    about = q - q.mean()
    line = np.einsum("l,lr->r", (q[-1] - q[0]) * about / np.sum(about**2), rows)
    return Trend(Estimate.from_rows(line), Estimate.from_rows(rows[-1] - rows[0]))


def p_value(estimate: Estimate, value: float = 0.0) -> float:
    """Two-sided p-value of `estimate` : () being `value`."""
    return _share(np.abs(estimate.replicates - estimate.value), abs(float(estimate.value) - value))


def p_value_of_equality(curves: np.ndarray) -> float:
    """p-value of curves of several levels being one.

    curves : (levels, 1 + R, n) the curve of each level, and below it its replicates, which levels share

    The statistic is the mean square difference of the levels from the mean of all, in standard errors, so that noisy
    levels and points weigh no more than others. A test of the largest difference would reject too often at a level of 5
    %: 17 % of the time with 99 replicates, 9 % with 399. The reason is that the errors come from the replicates. Raises
    IllPosedError for fewer than two levels.
    """
    if curves.ndim != 3 or len(curves) < 2:
        raise IllPosedError("equality over penetration needs at least two levels")
    apart = curves - curves.mean(axis=0)
    noise = apart[:, 1:] - apart[:, :1]
    variance = np.mean(noise**2, axis=1)
    weight = np.divide(1.0, variance, out=np.zeros_like(variance), where=variance > 0.0)
    return _share(np.einsum("lrn,ln->r", noise**2, weight), float(np.sum(apart[:, 0] ** 2 * weight)))


def _share(noise: np.ndarray, seen: float) -> float:
    if noise.ndim != 1 or not noise.size or not (np.isfinite(noise).all() and np.isfinite(seen)):
        raise ParameterError("a p-value needs finite replicates of one number")
    return float((1 + np.count_nonzero(noise >= seen)) / (1 + len(noise)))
