"""From the statistics of a scan to a model of its autocorrelation and of its heights."""

from __future__ import annotations

import math
from collections.abc import Sequence

from scipy.special import stdtrit

from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.surface.autocorrelation import Autocorrelation
from roughslip.surface.covariance import Kind
from roughslip.surface.covariance_fit import CovarianceFit, Estimates, estimates, fit_covariance
from roughslip.surface.empirical import EmpiricalMarginal, empirical_marginal
from roughslip.surface.marginal import Marginal, fit
from roughslip.surface.sub_areas import CONFIDENCE
from roughslip.surface.topography import Topography

MOST_LAGS = 4000  # of both signs: more say the same again, at a cost


def lags_to_fit(found: Autocorrelation) -> Estimates:
    """Estimates at every lag, or every second, third ... on each axis where these are too many."""
    step = math.ceil(math.sqrt(found.rows[0].size / MOST_LAGS))
    kept = tuple(slice(n // 2 % step, None, step) for n in found.rows[0].shape)
    parts = len(found.rows) - 1
    reach = found.correlation.high - found.correlation.low
    error = reach / (2 * stdtrit(parts - 1, 0.5 + 0.5 * CONFIDENCE))
    lag_x, lag_y = found.lag_x[kept[0]], found.lag_y[kept[1]]
    rows = found.rows[(slice(None), *kept)]
    return estimates(lag_x[:, None], lag_y[None, :], rows[0], error[kept], rows[1:])


def fitted_covariances(
    kinds: Sequence[Kind], scan: Topography, found: Autocorrelation, rms_height_m: float
) -> tuple[list[CovarianceFit], list[str]]:
    """Fits of the kinds that can be fitted, the best first, and why the others cannot.

    A self_affine spectrum goes on to the highest wavenumber of the scan. Raises IllPosedError where none can be.
    """
    data, fits, refused = lags_to_fit(found), [], []
    for kind in kinds:
        cutoff = 2.0 * math.sqrt(scan.dx * scan.dy) if kind == "self_affine" else None
        try:
            fits.append(fit_covariance(kind, data, rms_height_m, cutoff_wavelength_m=cutoff))
        except (IllPosedError, ConvergenceError) as error:
            refused.append(f"{kind}: {error}")
    if not fits:
        raise IllPosedError(f"no model fits the autocorrelation; take the measured one ({'; '.join(refused)})")
    return sorted(fits, key=lambda one: one.criterion), refused


def fitted_marginal(family: str, scan: Topography, rms_height_m: float) -> Marginal | EmpiricalMarginal | None:
    """The law of the measured heights: of a family, "empirical", or None for "gaussian"."""
    heights = scan.heights[scan.measured]
    if family == "gaussian":
        return None
    if family == "empirical":
        return empirical_marginal(heights, rms_height_m)
    return fit(heights, family).marginal
