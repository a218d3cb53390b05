"""Areal Gaussian high-pass of a scan, ISO 16610-61: waves longer than the cutoff are taken off.

The mean over the weights exp(-pi r^2 / (alpha lambda)^2) is taken off, with alpha^2 = ln(2) / pi. It keeps
exp(-pi (alpha lambda / wavelength)^2) of a wave, one half at the cutoff lambda. The weights are a product, so that both
axes are filtered one after the other. At the rim they are cut off. There the mean is the value of the
weighted least squares line, as ISO 16610-28 allows. So a plane is taken off to the last point.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import scipy

from roughslip.errors import ParameterError
from roughslip.scan.topography import ROUNDING, Topography

ALPHA = math.sqrt(math.log(2.0) / math.pi)
REACH = 1.7  # cutoffs from the point at which the weight is 1e-18
FEWEST_CELLS = 5.0  # of a cutoff: sums over nodes then give one half to 3e-8


def high_pass(scan: Topography, cutoff_m: float) -> Topography:
    """The scan less its waves longer than `cutoff_m` [m], those of what fills its holes with them.

    Raises ParameterError for a cutoff below FEWEST_CELLS cells or above the shorter edge of the scan, and where
    nothing but rounding is left.
    """
    minimum = FEWEST_CELLS * max(scan.dx, scan.dy)
    maximum = min(scan.grid.nx * scan.dx, scan.grid.ny * scan.dy)
    if not minimum <= cutoff_m <= maximum:
        raise ParameterError(
            f"roughness.scan.cutoff_m = {cutoff_m:.3g} m; allowed are {minimum:.3g} m, five cells of the scan, to "
            f"{maximum:.3g} m, its shorter edge"
        )
    long = _smoothed(_smoothed(scan.heights, cutoff_m / scan.dx).T, cutoff_m / scan.dy).T
    left = scan.heights - long
    if np.std(left) <= ROUNDING * np.ptp(scan.heights):
        raise ParameterError(f"roughness.scan.cutoff_m = {cutoff_m:.3g} m: no shorter waves are left of the scan")
    return replace(scan, heights=left)


def _smoothed(heights: np.ndarray, cutoff: float) -> np.ndarray:
    """Weighted least squares lines along the first axis, each at its own point. cutoff : [cells]"""
    points = len(heights)
    reach = min(points - 1, math.ceil(REACH * cutoff))
    lag = np.arange(-reach, reach + 1)
    weight = np.exp(-math.pi * (lag / (ALPHA * cutoff)) ** 2)[:, None]
    # sums over neighbours at x + lag; a convolution turns the lags round
    of_heights, with_lag = (
        scipy.signal.fftconvolve(heights, kernel[::-1], mode="full", axes=0)[reach : reach + points]
        for kernel in (weight, weight * lag[:, None])
    )
    ones = np.ones(points)
    s0, s1, s2 = (np.convolve(ones, (weight[:, 0] * lag**k)[::-1])[reach : reach + points, None] for k in range(3))
    return np.asarray((s2 * of_heights - s1 * with_lag) / (s0 * s2 - s1**2))
