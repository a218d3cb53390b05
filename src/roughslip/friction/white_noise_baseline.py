"""What the windows alone do to the autocorrelation: the same windows, on as many strips, of white pressure.

A column of white pressure knows nothing of the next, so what its windows show is their overlap (the triangle of
`correlation.triangular`), the bias of the estimator, which subtracts an estimated mean, and noise. Only what a measured
length has beyond that comes from the surface.
"""

from __future__ import annotations

import math

import numpy as np

from roughslip.errors import ParameterError, whole
from roughslip.friction.bowden_tabor import window_sums
from roughslip.friction.correlation import curves_of, pair_sums
from roughslip.friction.resampling import FEWEST_REPLICATES
from roughslip.probability import Estimate


def white_autocorrelation(
    strips: int, columns: int, window: int, spacing: int, lags: int, replicates: int, rng: np.random.Generator
) -> Estimate:
    """Autocorrelation of windows of white pressure, measured as `correlation.autocorrelation` measures that of mu.

    strips : number of strips of one measurement
    columns : on which the windows of a strip lie
    window, spacing : length of a window and distance of two starts [columns]
    lags : number K of lags, in window spacings
    replicates : measurements, at least FEWEST_REPLICATES

    Returns (K,): the mean over the measurements, and between low and high 95 % of them. Raises ParameterError where the
    windows do not fit or the replicates are too few.

    Windows begin and end at multiples of the common divisor of length and spacing; the columns between are summed
    already when they are drawn, as sums of normal variables are normal.
    """
    if whole("the number of replicates", replicates) < FEWEST_REPLICATES:
        raise ParameterError(f"a range of 95 % needs at least {FEWEST_REPLICATES} replicates, not {replicates}")
    block = math.gcd(whole("a window", window), whole("the spacing of windows", spacing))
    curves = np.empty((1 + replicates, lags))
    for row in curves[1:]:
        sums = window_sums(rng.standard_normal((strips, columns // block)), window // block, spacing // block)
        parts = pair_sums(sums, np.ones(sums.shape, dtype=bool), lags)
        row[:] = curves_of([part.sum(axis=0, keepdims=True) for part in parts], 0.0)[0]
    curves[0] = curves[1:].mean(axis=0)
    return Estimate.from_rows(curves)
