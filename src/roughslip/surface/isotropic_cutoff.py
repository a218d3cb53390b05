"""A self-affine spectrum whose roll-off has a lay while its shortest wave is equally long in all directions.

At the angle theta from the lay the spectrum is constant up to q_r(theta), an ellipse. It falls as (q / q_r)^(-2-2H) up
to the circle q_s. A ray is that of an isotropic spectrum of bandwidth B = q_s / q_r, so integrals are means over rays:

    C(r, psi) = Sq^2 <q_r^2 P(q_r r cos(theta - psi), B)> / <q_r^2 P(0, B)>

with P(s, B) of `self_affine_transform.ray`. Integrands are analytic and periodic: equal steps of theta are exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # its parts when they are used

from roughslip.surface import self_affine_transform
from roughslip.surface.covariance import direction
from roughslip.validation import gate

DECAY = 18.0  # half of the decades, as powers of e, by which angular harmonics fall: 2e-16
BLOCK = 64  # lags in memory with their rays


@gate
@dataclass(frozen=True)
class IsotropicCutoff:
    """A self-affine covariance of two roll-off wavelengths and one cut-off; `self_affine` makes and checks it.

    rms_height_m : Sq [m]
    hurst : H [-]
    rolloff_wavelengths_m : [m] along and across the lay
    cutoff_wavelength_m : [m] in all directions
    lay_rad : angle from x to the lay

    Two waves of one length differ between along and across by the ratio of roll-offs to the power 2 + 2 H at most.
    """

    rms_height_m: float
    hurst: float
    rolloff_wavelengths_m: tuple[float, float]
    cutoff_wavelength_m: float
    lay_rad: float = 0.0

    separable = False
    has_cutoff = True
    reach_m = (math.inf, math.inf)

    @property
    def mirror_symmetric(self) -> bool:
        """Whether C(-x, y) = C(x, y)."""
        return 0.0 in direction(self.lay_rad)

    @property
    def cutoff_wavelengths_m(self) -> tuple[float, float]:
        """[m] along and across the lay, which are equal."""
        return self.cutoff_wavelength_m, self.cutoff_wavelength_m

    @property
    def rms_slope(self) -> float:
        """h' [-], the root mean square of the gradient: that of q over the spectrum, times Sq."""
        return self.rms_height_m * math.sqrt(self._moment(2) / self._moment(0))

    @property
    def rms_curvature(self) -> float:
        """[1/m], the root mean square of half the Laplacian."""
        return 0.5 * self.rms_height_m * math.sqrt(self._moment(4) / self._moment(0))

    @cached_property
    def axis_lengths_m(self) -> tuple[float, float]:
        """[m] distances along x and y at which the autocorrelation is 1/e."""
        return self._length(-self.lay_rad), self._length(math.pi / 2 - self.lay_rad)

    def __call__(self, x: np.ndarray, y: np.ndarray | float = 0.0) -> np.ndarray:
        """C : (broadcast of x and y) [m^2] covariance of two heights that lie x [m] and y [m] apart.

        Some 0.2 us for each lag and ray; rays are half as many as the longest lag has cut-off radians, and some dozens.
        """
        x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        lag, azimuth = np.hypot(x, y).ravel(), np.arctan2(y, x).ravel() - self.lay_rad
        correlation, order = np.empty(lag.shape), np.argsort(lag)
        for start in range(0, lag.size, BLOCK):
            part = order[start : start + BLOCK]
            correlation[part] = self._correlation(lag[part], azimuth[part])
        return self.rms_height_m**2 * correlation.reshape(x.shape)

    @gate
    def spectrum(self, qx: np.ndarray, qy: np.ndarray | float = 0.0) -> np.ndarray:
        """S : (broadcast of qx and qy) [m^4] spectral density at the wave vector (qx, qy) [rad/m]."""
        (along, across), (cos, sin) = self._rolloff, direction(self.lay_rad)
        k = np.hypot((cos * qx + sin * qy) / along, (cos * qy - sin * qx) / across)
        plateau = 2 * math.pi * self.rms_height_m**2 / self._moment(0)
        inside = np.hypot(qx, qy) <= self._end
        return np.where(inside, plateau * np.maximum(k, 1.0) ** (-2 - 2 * self.hurst), 0.0)

    @property
    def _rolloff(self) -> tuple[float, float]:
        """q_r [rad/m] along and across the lay."""
        return 2 * math.pi / self.rolloff_wavelengths_m[0], 2 * math.pi / self.rolloff_wavelengths_m[1]

    @property
    def _end(self) -> float:
        """q_s [rad/m]."""
        return 2 * math.pi / self.cutoff_wavelength_m

    def _rays(self, lag: float) -> int:
        """Rays in half a turn: harmonics of q_r fall with its poles, those of cos(q r cos theta) end at q r."""
        ratio = min(self._rolloff) / max(self._rolloff)
        pole = math.atanh(min(ratio, 0.76))
        return math.ceil(DECAY / pole + 0.55 * self._end * lag + 10)

    def _along(self, theta: np.ndarray) -> np.ndarray:
        """q_r : (as theta) [rad/m] at angles from the lay."""
        along, across = self._rolloff
        return 1 / np.hypot(np.cos(theta) / along, np.sin(theta) / across)

    def _moment(self, power: int) -> float:
        """Mean over rays of q_r^(2 + power) int t^(1 + power) S dt : [(rad/m)^(2 + power)]."""
        rays = self._rays(0.0)
        rolloff = self._along(np.arange(rays) * math.pi / rays)
        parts = self_affine_transform.moment(power, self.hurst, self._end / rolloff)
        return float(np.mean(rolloff ** (2 + power) * parts))

    def _correlation(self, lag: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
        """C / Sq^2 : (n,) [-] at lags (n,) [m] and angles (n,) from the lay."""
        rays = self._rays(lag.max())
        theta = np.arange(rays) * math.pi / rays
        rolloff = self._along(theta)
        bandwidth, weight = self._end / rolloff, rolloff**2
        s = np.abs(lag[:, None] * np.cos(theta - azimuth[:, None])) * rolloff
        mass = weight @ self_affine_transform.moment(0, self.hurst, bandwidth)
        return np.asarray(self_affine_transform.ray(s, self.hurst, bandwidth) @ weight / mass)

    def _length(self, azimuth: float) -> float:
        """[m] at an angle from the lay, where the correlation first is 1/e: at u = 3.5 it is below, as with a lay."""
        along, across = self._rolloff
        far = 3.5 / math.hypot(along * math.cos(azimuth), across * math.sin(azimuth))

        def excess(lag: float) -> float:
            return float(self._correlation(np.array([lag]), np.array([azimuth]))[0]) - math.exp(-1)

        return float(scipy.optimize.brentq(excess, 0.0, far, xtol=1e-13 * far))
