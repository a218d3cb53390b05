"""A covariance that does not change along one axis: that of a surface with an infinitely long lay."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roughslip.surface.covariance import StationaryCovariance


@dataclass(frozen=True, eq=False)
class EndlessLay:
    """Heights are equal along the axis of the lay; across it they have the covariance of the profile.

    profile : any covariance, of which the lags across the lay count alone
    axis : of the lay, 0 for x and 1 for y
    """

    profile: StationaryCovariance
    axis: int
    separable = mirror_symmetric = True

    @property
    def rms_height_m(self) -> float:
        """Sq [m]."""
        return self.profile.rms_height_m

    @property
    def reach_m(self) -> tuple[float, float]:
        """[m] of the profile across the lay. Along it the covariance has any period."""
        x, y = self.profile.reach_m
        return (x, 0.0) if self.axis else (0.0, y)

    def __call__(self, x: np.ndarray, y: np.ndarray | float = 0.0) -> np.ndarray:
        """C : (broadcast of x and y) [m^2] covariance of two heights that lie x [m] and y [m] apart."""
        x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        zero = np.zeros(1)
        return self.profile(x, zero) if self.axis else self.profile(zero, y)
