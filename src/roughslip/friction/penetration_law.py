"""mu_fit(d), the mean friction coefficient at any penetration between those that were solved; eq. (13) takes it.

A cubic through the levels with slopes that keep it monotone between two levels wherever these are, so that it shows no
trend that the statistics do not show (Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238; Fritsch and Butland,
SIAM J. Sci. Stat. Comput. 5 (1984) 300). Every resampled set of levels gives a curve of its own, and these the band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from roughslip.errors import IllPosedError, ParameterError
from roughslip.probability import Estimate
from roughslip.validation import reals


@dataclass(frozen=True)
class PenetrationLaw:
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
    law = PenetrationLaw(np.asarray(percentiles, dtype=np.float64), np.asarray(values)[None])
    return float(law._curves()(law._inside(percentile))[0])


def penetration_law(percentiles: np.ndarray, estimates: list[Estimate]) -> PenetrationLaw:
    """The curve through estimates : L of () at percentiles : (L,) [%], increasing, that share their replicates.

    Raises IllPosedError for fewer than two levels, ParameterError for percentiles that do not increase or match.
    """
    q = reals("percentiles", percentiles)
    if q.ndim != 1 or not np.isfinite(q).all():
        raise ParameterError("percentiles of a curve must be a row of finite numbers")
    if len(q) < 2:
        raise IllPosedError("a curve over penetration needs at least two levels")
    if len(estimates) != len(q) or not (np.diff(q) > 0.0).all():
        raise ParameterError("a curve over penetration needs increasing percentiles with an estimate each")
    return PenetrationLaw(q, np.stack([estimate.rows for estimate in estimates], axis=1))
