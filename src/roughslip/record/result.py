"""What a measured friction record says: the mean curve over speed and the scatter about it, both with their errors."""

from __future__ import annotations

import numpy as np

from roughslip.probability.estimate import NORMAL_95
from roughslip.results import described, result


@result
class FrictionCurve:
    """Mean friction against sliding speed, over the speeds that were measured."""

    form: str = described("stribeck, the law of the scene, or spline, where that law does not fit")
    speeds_m_per_s: np.ndarray = described(
        "increasing speeds, from the slowest to the fastest measured", "m/s", "speed"
    )
    friction: np.ndarray = described("mean friction coefficient at the speeds", "1", "speed")
    factor: np.ndarray = described("F, with F F' the covariance of the curve", "1", "speed draw")
    misfit: float = described("p-value of the hypothesis that Stribeck's law fits")
    at_rest: float = described(
        "friction towards rest, where no record measures: of Stribeck's law; of a spline as at the slowest speed"
    )
    factor_at_rest: np.ndarray = described("the row of the factor at rest", "1", "draw")

    def interval(self) -> tuple[np.ndarray, np.ndarray]:
        """Ends : (K,) [-] of the pointwise 95 % intervals."""
        half = NORMAL_95 * np.sqrt(np.sum(self.factor**2, axis=1))
        return self.friction - half, self.friction + half


@result
class FrictionScatter:
    """The stationary scatter about the curve, along the slipped distance."""

    standard_deviation: float = described("additive: of the friction; multiplicative: of the friction over its mean")
    correlation_length_m: float = described("integral of the autocorrelation from zero on", "m")
    log_covariance: np.ndarray = described("covariance of the logarithms of these two", "1", "error other_error")
    shape: str = described("of the autocorrelation: exponential or triangle")
    lengths: float = described("correlation lengths that the record holds")
    identified: bool = described('false, "cannot tell", where these are too few; the numbers are then a guess')

    def interval(self) -> np.ndarray:
        """(2, 2) ends of the 95 % intervals of standard deviation and correlation length, a row each."""
        values = np.log([self.standard_deviation, self.correlation_length_m])
        half = NORMAL_95 * np.sqrt(np.diag(self.log_covariance))
        return np.exp(np.stack([values - half, values + half], axis=1))
