"""How friction changes with penetration: mu_fit(d) between the solved levels, and the trend over all of them.

mu_fit(d) is a cubic through the levels and monotone between two levels, so it shows no trend that the statistics do
not show (Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238; Fritsch and Butland, SIAM J. Sci.
Stat. Comput. 5 (1984) 300). Each resampled set of levels gives one curve, and these curves give the band.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from roughslip.errors import IllPosedError, ParameterError
from roughslip.probability import Estimate
from roughslip.validation import finite


def curve_over_penetration(percentiles: np.ndarray, estimates: Sequence[Estimate], points: np.ndarray) -> Estimate:
    """A statistic at penetrations : (n,) [%] between the first and the last level, with its band.

    percentiles : (L,) [%] of the levels, increasing
    estimates : L of (), which share their replicates

    Raises IllPosedError for fewer than two levels, ParameterError for percentiles that do not increase or match, and
    for points beyond them.
    """
    q = _levels(percentiles, len(estimates))
    return Estimate.from_rows(_curve(q, np.stack([estimate.rows for estimate in estimates], axis=1), points))


def between(percentiles: np.ndarray, values: np.ndarray, percentile: float) -> float:
    """The curve through values : (L,) at percentiles : (L,) [%], increasing, at one penetration; at a level its value.

    Raises ParameterError for a penetration that is neither a level nor between two.
    """
    level = np.flatnonzero(percentiles == percentile)
    if level.size:
        return float(values[level[0]])
    return float(_curve(np.asarray(percentiles, dtype=np.float64), np.asarray(values)[None], percentile)[0])


def trend(percentiles: np.ndarray, estimates: Sequence[Estimate]) -> tuple[Estimate, Estimate]:
    """Change of a statistic from the first to the last level: along the straight line through all, and last - first.

    percentiles : (L,) [%] of the levels, increasing
    estimates : L of (), all levels resampled with the same weights

    The line is that of least squares. Raises as `curve_over_penetration`.
    """
    q, rows = _levels(percentiles, len(estimates)), np.stack([estimate.rows for estimate in estimates])
    finite("values and replicates of a trend", rows)
    about = q - q.mean()
    line = np.einsum("l,lr->r", (q[-1] - q[0]) * about / np.sum(about**2), rows)
    return Estimate.from_rows(line), Estimate.from_rows(rows[-1] - rows[0])


def _curve(percentiles: np.ndarray, rows: np.ndarray, points: float | np.ndarray) -> np.ndarray:
    """(rows, points) of the curves through rows : (n, L)."""
    at, first, last = finite("penetrations", points), percentiles[0], percentiles[-1]
    if not ((at >= first) & (at <= last)).all():
        raise ParameterError(f"penetrations must lie between the levels {first:g} and {last:g} %: solve others too")
    return np.asarray(scipy.interpolate.PchipInterpolator(percentiles, rows, axis=1)(at))


def _levels(percentiles: np.ndarray, count: int) -> np.ndarray:
    """The percentiles as floats; refuses all but `count` increasing ones, at least two."""
    q = finite("percentiles", percentiles, 1)
    if len(q) != count or not (np.diff(q) > 0.0).all():
        raise ParameterError("statistics over penetration need increasing, finite percentiles, one for each value")
    if len(q) < 2:
        raise IllPosedError("a curve or trend over penetration needs at least two levels")
    return q
