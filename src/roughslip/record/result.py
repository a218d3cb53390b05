"""What a measured friction record says: the mean curve over speed and the scatter about it, both with their errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roughslip.probability.estimate import NORMAL_95


@dataclass(frozen=True, eq=False)
class FrictionCurve:
    """Mean friction against sliding speed, over the speeds that were measured.

    form : stribeck, the law of the scene, or spline, where that law does not fit
    speeds_m_per_s : (K,) [m/s] increasing; the first and the last are the slowest and the fastest speed measured
    friction : (K,) [-] at the speeds
    factor : (K, r) [-] their covariance is factor @ factor.T
    misfit : p-value of the hypothesis that Stribeck's law fits
    at_rest : [-] towards rest, where no record measures: of Stribeck's law; of a spline as at the slowest speed
    factor_at_rest : (r,) [-] the row of the factor there
    """

    form: str
    speeds_m_per_s: np.ndarray
    friction: np.ndarray
    factor: np.ndarray
    misfit: float
    at_rest: float
    factor_at_rest: np.ndarray

    def interval(self) -> tuple[np.ndarray, np.ndarray]:
        """Ends : (K,) [-] of the pointwise 95 % intervals."""
        half = NORMAL_95 * np.sqrt(np.sum(self.factor**2, axis=1))
        return self.friction - half, self.friction + half


@dataclass(frozen=True, eq=False)
class FrictionScatter:
    """The stationary scatter about the curve, along the slipped distance.

    standard_deviation : [-] additive: of the friction; multiplicative: of the friction over its mean
    correlation_length_m : [m] integral of the autocorrelation from zero on
    log_covariance : (2, 2) of the errors of the logarithms of these two
    shape : of the autocorrelation: exponential or triangle
    lengths : correlation lengths that the record holds
    identified : false, "cannot tell", where these are too few; the numbers are then no more than a guess
    """

    standard_deviation: float
    correlation_length_m: float
    log_covariance: np.ndarray
    shape: str
    lengths: float
    identified: bool

    def interval(self) -> np.ndarray:
        """(2, 2) ends of the 95 % intervals of standard deviation and correlation length, a row each."""
        values = np.log([self.standard_deviation, self.correlation_length_m])
        half = NORMAL_95 * np.sqrt(np.diag(self.log_covariance))
        return np.exp(np.stack([values - half, values + half], axis=1))
