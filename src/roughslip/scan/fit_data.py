"""What covariance models are fitted to: autocorrelations at lags, and powers over rings of the spectrum.

Both come with the same estimated without each part of the scan, since neighbours err together. Of n estimates whose
errors have the correlation R only n' = (tr R)^2 / tr R^2 are independent in effect.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from roughslip.scan.autocorrelation import Autocorrelation
from roughslip.scan.jackknife import CONFIDENCE
from roughslip.scan.spectrum import HIGHEST, LEAKAGE, ROLL_OFF, rings
from roughslip.scan.statistics import ScanStatistics
from roughslip.scan.topography import Topography
from roughslip.surface.covariance import Covariance

MOST_LAGS = 4000  # of both signs: more say the same again, at a cost
DIRECTIONS = 4  # in which the lags across an endless lay are taken, so that fits find them isotropic


@dataclass(frozen=True)
class Estimates:
    """An estimated autocorrelation at the lags of one half plane, without lag zero, whose correlation is exactly 1.

    x, y : (n,) [m] lags
    correlation : (n,) [-]
    standard_error : (n,) [-] positive
    number : n' that are independent in effect
    """

    x: np.ndarray
    y: np.ndarray
    correlation: np.ndarray
    standard_error: np.ndarray
    number: float


@dataclass(frozen=True)
class RingPowers:
    """An estimated spectrum, averaged over rings of wave vectors.

    power : (m,) [m^4] positive
    standard_error : (m,) [-] of its logarithm, positive
    number : m' that are independent in effect
    expected : the powers (m,) [m^4] of a model on the same rings
    """

    power: np.ndarray
    standard_error: np.ndarray
    number: float
    expected: Callable[[Covariance], np.ndarray]

    def distance(self, covariance: Covariance) -> np.ndarray:
        """(m,) logarithm of the power of a model over the estimated one, in standard errors."""
        model = np.maximum(self.expected(covariance), np.finfo(float).tiny)  # a gaussian may underflow
        return np.asarray(np.log(model / self.power) / self.standard_error)


def estimates(lag_x: np.ndarray, lag_y: np.ndarray, rows: np.ndarray, standard_error: np.ndarray) -> Estimates:
    """Estimates at the lags of one half plane.

    lag_x, lag_y : (...) [m] lags of both signs, broadcast to the shape of the correlation
    rows : (1 + B, ...) [-] estimates C / C(0), then the same without each of B parts of the scan
    standard_error : (...) [-] of each
    """
    x, y = np.broadcast_arrays(lag_x, lag_y)
    kept = (x > 0) | ((x == 0) & (y > 0))
    rows, error = rows[:, kept], standard_error[kept]
    return Estimates(x[kept], y[kept], rows[0], error, effective_number(rows[1:], error))


def lags_to_fit(estimate: Autocorrelation) -> Estimates:
    """Estimates at every lag, or every second, third ... on each axis where these are too many."""
    return estimates(*_thinned(estimate))


def _thinned(estimate: Autocorrelation) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Arguments of `estimates` about lag zero."""
    step = math.ceil(math.sqrt(estimate.rows[0].size / MOST_LAGS))
    kept = tuple(slice(n // 2 % step, None, step) for n in estimate.rows[0].shape)
    reach = estimate.correlation.high - estimate.correlation.low
    error = reach / (2 * stdtrit(len(estimate.rows) - 2, 0.5 + 0.5 * CONFIDENCE))
    lag_x, lag_y = estimate.lag_x[kept[0]], estimate.lag_y[kept[1]]
    return lag_x[:, None], lag_y[None, :], estimate.rows[(slice(None), *kept)], error[kept]


def profile_to_fit(estimate: Autocorrelation, endless: int) -> Estimates:
    """Estimates at lags across an endless lay, each in several directions, so that fits take them for isotropic.

    The effective number of estimates does not change, since copies err together.
    """
    lag_x, lag_y, rows, error = _thinned(estimate)
    i, j = (n // 2 for n in error.shape)
    if endless:
        across, rows, error = lag_x[i + 1 :, 0], rows[:, i + 1 :, j], error[i + 1 :, j]
    else:
        across, rows, error = lag_y[0, j + 1 :], rows[:, i, j + 1 :], error[i, j + 1 :]
    angles = np.arange(DIRECTIONS) * math.pi / DIRECTIONS
    x, y = (np.outer(part, across).ravel() for part in (np.cos(angles), np.sin(angles)))
    rows, error = np.tile(rows, DIRECTIONS), np.tile(error, DIRECTIONS)
    return Estimates(x, y, rows[0], error, effective_number(rows[1:], error))


def rings_to_fit(scan: Topography, statistics: ScanStatistics) -> RingPowers | None:
    """Powers of the rings to which lags are not sensitive; None where the scan has fewer than two of them.

    The band starts at ROLL_OFF over the shorter length and ends at HIGHEST of the highest wavenumber. Rings below the
    side lobes of the window are left out.
    """
    parts, power = statistics.sub_areas, statistics.spectrum.power
    q = statistics.spectrum.wavenumber
    kept = (q >= ROLL_OFF / min(parts.extent)) & (q <= HIGHEST * math.pi / max(scan.dx, scan.dy))
    kept &= power.value > LEAKAGE * power.value.max()
    if kept.sum() < 2:
        return None
    over = rings(scan.grid, parts)
    error = np.log(power.high / power.low)[kept] / (2 * stdtrit(parts.number - 1, 0.5 + 0.5 * CONFIDENCE))
    number = effective_number(np.log(statistics.spectrum.rows[1:, kept]), error)
    return RingPowers(power.value[kept], error, number, lambda model: over.expected(model.spectrum)[kept])


def effective_number(without_part: np.ndarray, standard_error: np.ndarray) -> float:
    """n' of the module's heading; n where no parts are given.

    without_part : (B, n) estimates without each part of the scan
    """
    parts = len(without_part)
    if not parts:
        return float(standard_error.size)
    errors = math.sqrt((parts - 1) / parts) * (without_part - without_part.mean(axis=0)) / standard_error
    gram = errors @ errors.T
    return float(max(np.trace(gram) ** 2 / np.sum(gram**2), 1.0 + 1e-9))
