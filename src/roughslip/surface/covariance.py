"""Stationary covariance of surface heights, and the heights at which a rigid plane stands."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import ndtri

from roughslip.errors import ParameterError


@dataclass(frozen=True)
class Covariance:
    """Covariance of a zero-mean Gaussian field of heights.

    kind : "gaussian", C(r) = Sq^2 exp(-(r/l)^2), or "exponential", C(r) = Sq^2 exp(-r/l)
    rms_height_m : Sq [m]
    correlation_length_m : l [m], where the autocorrelation is 1/e
    """

    kind: Literal["gaussian", "exponential"]
    rms_height_m: float
    correlation_length_m: float

    def __post_init__(self) -> None:
        if self.kind not in ("gaussian", "exponential"):
            raise ParameterError(f"covariance {self.kind!r} is not known: gaussian or exponential")
        for name, value in (("rms height", self.rms_height_m), ("correlation length", self.correlation_length_m)):
            if not (math.isfinite(value) and value > 0):
                raise ParameterError(f"{name} must be positive and finite, not {value}")

    @property
    def separable(self) -> bool:
        """Whether C(x, y) is a product of a function of x and one of y."""
        return self.kind == "gaussian"

    def __call__(self, x: np.ndarray, y: np.ndarray | float = 0.0) -> np.ndarray:
        """C : (broadcast of x and y) [m^2] covariance of two heights that lie x [m] and y [m] apart."""
        length = self.correlation_length_m
        if self.kind == "gaussian":
            correlation = np.exp(-((x / length) ** 2) - (y / length) ** 2)
        else:
            correlation = np.exp(-np.hypot(x, y) / length)
        return self.rms_height_m**2 * correlation


def plane_height(percentile: float | np.ndarray, rms_height_m: float) -> np.ndarray:
    """h_p [m] that `percentile` per cent of the ensemble of Gaussian heights lie above; 50 is the median."""
    above = np.asarray(percentile, dtype=float) / 100.0
    if not np.all((above > 0) & (above < 1)):
        raise ParameterError(f"a penetration percentile lies between 0 and 100, not {percentile}")
    return np.asarray(rms_height_m * ndtri(1.0 - above))
