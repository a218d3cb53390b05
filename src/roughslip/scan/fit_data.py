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

from roughslip.errors import ParameterError
from roughslip.scan.autocorrelation import Autocorrelation
from roughslip.scan.jackknife import CONFIDENCE
from roughslip.scan.spectrum import HIGHEST, LEAKAGE, ROLL_OFF, rings
from roughslip.scan.statistics import ScanStatistics
from roughslip.scan.topography import Topography
from roughslip.surface.covariance import Covariance
from roughslip.validation import reals

MOST_LAGS = 4000  # of both signs: more say the same again, at a cost


@dataclass(frozen=True)
class Estimates:
    """An estimated autocorrelation, a lag and its opposite once; made by `estimates`.

    x, y : (n,) [m] lags
    correlation : (n,) [-]
    standard_error : (n,) [-] positive
    without_part : (B, n) [-] the same estimated without each part of the scan; B = 0 if not known
    """

    x: np.ndarray
    y: np.ndarray
    correlation: np.ndarray
    standard_error: np.ndarray
    without_part: np.ndarray

    @property
    def errors(self) -> np.ndarray:
        """(B, n) what each part adds to the error of each lag, in standard errors; squares add up over the parts."""
        return _jackknife(self.without_part) / self.standard_error


@dataclass(frozen=True)
class RingPowers:
    """An estimated spectrum, averaged over rings of wave vectors.

    power : (m,) [m^4] positive
    standard_error : (m,) [-] of its logarithm, positive
    without_part : (B, m) [m^4] the same without each part of the scan
    expected : the powers (m,) [m^4] of a model on the same rings
    """

    power: np.ndarray
    standard_error: np.ndarray
    without_part: np.ndarray
    expected: Callable[[Covariance], np.ndarray]

    @property
    def errors(self) -> np.ndarray:
        """(B, m) as of Estimates, of the logarithms."""
        return _jackknife(np.log(self.without_part)) / self.standard_error

    def distance(self, covariance: Covariance) -> np.ndarray:
        """(m,) logarithm of the power of a model over the estimated one, in standard errors."""
        model = np.maximum(self.expected(covariance), np.finfo(float).tiny)  # a gaussian may underflow
        return np.asarray(np.log(model / self.power) / self.standard_error)


def estimates(
    lag_x_m: np.ndarray,
    lag_y_m: np.ndarray,
    correlation: np.ndarray,
    standard_error: np.ndarray,
    without_part: np.ndarray | None = None,
) -> Estimates:
    """Estimates at the lags of one half plane; lag zero, where the correlation is 1 without error, is left out.

    lag_x_m, lag_y_m : (...) [m] lags, broadcast to the shape of the correlation
    correlation : (...) [-] estimates C / C(0)
    standard_error : (...) [-] of each
    without_part : (B, ...) [-] estimates without each of B >= 2 parts of the scan

    Raises ParameterError for values that are not finite, errors that are not positive, and shapes that do not fit.
    """
    correlation, standard_error = reals("correlations", correlation), reals("standard errors", standard_error)
    shape = correlation.shape
    parts = np.empty((0, *shape)) if without_part is None else without_part
    if standard_error.shape != shape or parts.shape[1:] != shape or len(parts) == 1:
        raise ParameterError(f"errors {standard_error.shape} and parts {parts.shape} do not fit estimates {shape}")
    x, y = np.broadcast_to(lag_x_m, shape), np.broadcast_to(lag_y_m, shape)
    kept = (x > 0) | ((x == 0) & (y > 0))
    fields = x[kept], y[kept], correlation[kept], standard_error[kept], parts[:, kept]
    if not all(np.all(np.isfinite(field)) for field in fields):
        raise ParameterError("lags, correlations and their errors must be finite: leave out lags without pairs")
    if not np.all(fields[3] > 0):
        raise ParameterError("standard errors of correlations off lag zero must be positive")
    return Estimates(*fields)


def lags_to_fit(estimate: Autocorrelation) -> Estimates:
    """Estimates at every lag, or every second, third ... on each axis where these are too many."""
    step = math.ceil(math.sqrt(estimate.rows[0].size / MOST_LAGS))
    kept = tuple(slice(n // 2 % step, None, step) for n in estimate.rows[0].shape)
    parts = len(estimate.rows) - 1
    reach = estimate.correlation.high - estimate.correlation.low
    error = reach / (2 * stdtrit(parts - 1, 0.5 + 0.5 * CONFIDENCE))
    lag_x, lag_y = estimate.lag_x[kept[0]], estimate.lag_y[kept[1]]
    rows = estimate.rows[(slice(None), *kept)]
    return estimates(lag_x[:, None], lag_y[None, :], rows[0], error[kept], rows[1:])


def profile_to_fit(estimate: Autocorrelation, endless: int, directions: int) -> Estimates:
    """Estimates at lags across an endless lay, each in several directions, so that fits take them for isotropic.

    directions : 4 for models with a lay, 2 for those of the axes alone

    The effective number of estimates does not change, since copies err together.
    """
    whole = lags_to_fit(estimate)
    along, across = (whole.y, whole.x) if endless else (whole.x, whole.y)
    line = np.flatnonzero((along == 0.0) & (across > 0.0))
    angles = np.arange(directions) * math.pi / directions
    x, y = (np.outer(part, across[line]).ravel() for part in (np.cos(angles), np.sin(angles)))
    copies = np.tile(line, len(angles))
    return Estimates(x, y, whole.correlation[copies], whole.standard_error[copies], whole.without_part[:, copies])


def rings_to_fit(scan: Topography, statistics: ScanStatistics) -> RingPowers | None:
    """Powers of the rings to which lags are not sensitive; None where the scan has fewer than two of them.

    The band starts where a finite correlation no longer bends the spectrum and ends at a quarter of the highest
    wavenumber, as for the fractal dimension. Rings below the side lobes of the window are left out.
    """
    parts, power = statistics.sub_areas, statistics.spectrum.power
    q = statistics.spectrum.wavenumber
    kept = (q >= ROLL_OFF / min(parts.extent)) & (q <= HIGHEST * math.pi / max(scan.dx, scan.dy))
    kept &= power.value > LEAKAGE * power.value.max()
    if kept.sum() < 2:
        return None
    over = rings(scan.grid, parts)
    error = np.log(power.high / power.low)[kept] / (2 * stdtrit(parts.number - 1, 0.5 + 0.5 * CONFIDENCE))
    return RingPowers(
        power.value[kept],
        error,
        statistics.spectrum.rows[1:, kept],
        lambda covariance: over.expected(covariance.spectrum)[kept],
    )


def effective_number(errors: np.ndarray) -> float:
    """n' of the module's heading. errors : (B, n) as of Estimates; n where B = 0."""
    if not len(errors):
        return float(errors.shape[1])
    gram = errors @ errors.T
    return float(max(np.trace(gram) ** 2 / np.sum(gram**2), 1.0 + 1e-9))


def _jackknife(without_part: np.ndarray) -> np.ndarray:
    number = len(without_part)
    if number == 0:
        return without_part
    return np.asarray(math.sqrt((number - 1) / number) * (without_part - without_part.mean(axis=0)))
