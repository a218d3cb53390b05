"""From the statistics of a scan to a model of its autocorrelation and of its heights."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import stdtrit

from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.probability import EmpiricalDistribution, FamilyDistribution, empirical_distribution, fit_distribution
from roughslip.scan.autocorrelation import Autocorrelation
from roughslip.scan.covariance_fit import CovarianceFit, fit_covariance
from roughslip.scan.fit_data import Estimates, RingPowers, estimates
from roughslip.scan.jackknife import CONFIDENCE
from roughslip.scan.spectrum import HIGHEST, LEAKAGE, ROLL_OFF, rings
from roughslip.scan.statistics import ScanStatistics
from roughslip.scan.topography import Topography
from roughslip.surface.models import MODELS

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


def rings_to_fit(scan: Topography, found: ScanStatistics) -> RingPowers | None:
    """Powers of the rings to which lags are not sensitive; None where the scan has fewer than two of them.

    The band starts where a finite correlation no longer bends the spectrum and ends at a quarter of the highest
    wavenumber, as for the fractal dimension. Rings below the side lobes of the window are left out.
    """
    parts, power = found.sub_areas, found.spectrum.power
    q = found.spectrum.wavenumber
    kept = (q >= ROLL_OFF / min(parts.extent)) & (q <= HIGHEST * math.pi / max(scan.dx, scan.dy))
    kept &= power.value > LEAKAGE * power.value.max()
    if kept.sum() < 2:
        return None
    over = rings(scan.grid, parts)
    error = np.log(power.high / power.low)[kept] / (2 * stdtrit(parts.number - 1, 0.5 + 0.5 * CONFIDENCE))
    return RingPowers(
        power.value[kept],
        error,
        found.spectrum.rows[1:, kept],
        lambda covariance: over.expected(covariance.spectrum)[kept],
    )


def fitted_covariances(
    kinds: Sequence[str], scan: Topography, found: ScanStatistics
) -> tuple[list[CovarianceFit], list[str]]:
    """Fits of the kinds that can be fitted, the best first, and why the others cannot.

    A self_affine spectrum goes on to the highest wavenumber of the scan. Raises IllPosedError where none can be.
    """
    data, powers = lags_to_fit(found.autocorrelation), rings_to_fit(scan, found)
    fits: list[CovarianceFit] = []
    refused: dict[str, list[str]] = {}  # kinds by the reason
    for kind in kinds:
        cutoff = 2.0 * math.sqrt(scan.dx * scan.dy) if MODELS[kind].has_cutoff else None
        try:
            fit = fit_covariance(kind, data, float(found.rms_height.value), rings=powers, cutoff_wavelength_m=cutoff)
            fits.append(fit)
        except (IllPosedError, ConvergenceError) as error:
            refused.setdefault(str(error), []).append(kind)
    reasons = [f"{', '.join(names)}: {reason}" for reason, names in refused.items()]
    if not fits:
        raise IllPosedError(f"no model fits the autocorrelation; take the measured one ({'; '.join(reasons)})")
    return sorted(fits, key=lambda one: one.criterion), reasons


def fitted_marginal(
    family: str, scan: Topography, rms_height_m: float
) -> FamilyDistribution | EmpiricalDistribution | None:
    """The distribution of the measured heights: of a family, "empirical", or None for "gaussian"."""
    heights = scan.heights[scan.measured]
    if family == "gaussian":
        return None
    if family == "empirical":
        return empirical_distribution(heights, rms_height_m)
    return fit_distribution(heights, family)
