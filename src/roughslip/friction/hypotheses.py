"""Tests of what the paper says of friction, each with a p-value from resampled strips.

What is resampled scatters about the sample as the sample does about the truth. So a number theta is held against a
value by how often its replicates lie as far from theta itself (the pivot; Hall and Wilson, Biometrics 47 (1991) 757:
resample what the null hypothesis would give), and a curve by the distance of its replicates from it.
p = (1 + number as far) / (1 + replicates) is never 0.
"""

from __future__ import annotations

import numpy as np

from roughslip.errors import IllPosedError, ParameterError
from roughslip.probability import Estimate


def p_value(estimate: Estimate, value: float = 0.0) -> float:
    """Two-sided p-value of `estimate` : () being `value`."""
    return _share(np.abs(estimate.replicates - estimate.value), abs(float(estimate.value) - value))


def p_value_of_equality(curves: np.ndarray) -> float:
    """p-value of curves of several levels being one.

    curves : (levels, 1 + R, n) the curve of each level, and below it its replicates, which levels share

    The statistic is the mean square difference of the levels from the mean of all, in standard errors, so that noisy
    levels and places weigh no more than others. The largest difference would be refused too often: 17 % at a level of
    5 % with 99 replicates, 9 % with 399, as the errors are those of the replicates themselves. Raises IllPosedError for
    fewer than two levels.
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
