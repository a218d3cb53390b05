"""The autocorrelation of a scan as a covariance: a table near to it that is one, continued between its lags.

A table of lags is a covariance if its spectrum is nowhere negative; what a scan gives is not quite, since its long lags
are noise and end abruptly. A table h * h, with any even kernel h, has the spectrum h(q)^2 at every q. Cubic splines
through a table keep the property. With B the transform of their values at the lags, the continuation has the spectrum
of the table times sinc^4(q/2) / B(q). Both factors are positive.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy

from roughslip.errors import IllPosedError, ParameterError
from roughslip.validation import positive

MARGIN = 26  # nodes of zeros around the table: splines that interpolate decay by 0.27 a node
TAPERED = 0.5  # share of the lags over which a taper falls
LARGEST_CHANGE = 0.2  # of a correlation; a table that needs more is no estimate of an autocorrelation


@dataclass(frozen=True, eq=False)
class MeasuredCovariance:
    """A covariance given at lags; zero beyond them. Made by `measured_covariance`.

    rms_height_m : Sq [m]
    lag_x_m, lag_y_m : [m] between neighbouring lags
    correlation : (4 kx + 1, 4 ky + 1) [-] at lags to twice those measured, positive semidefinite, 1 in the middle
    largest_change : [-] of a correlation within the lags measured
    coefficients : (4 kx + 1 + 2 MARGIN, 4 ky + 1 + 2 MARGIN) [-] of the cubic splines
    """

    rms_height_m: float
    lag_x_m: float
    lag_y_m: float
    correlation: np.ndarray
    largest_change: float
    coefficients: np.ndarray
    separable = mirror_symmetric = False  # an estimate is neither

    @property
    def reach_m(self) -> tuple[float, float]:
        nx, ny = self.coefficients.shape
        return (nx // 2) * self.lag_x_m, (ny // 2) * self.lag_y_m

    @property
    def rms_slope(self) -> float:
        """h' [-], the root mean square of the gradient, over both directions: of the splines, exactly."""
        nx, ny = (size // 2 for size in self.coefficients.shape)
        around, mean = self.coefficients[nx - 1 : nx + 2, ny - 1 : ny + 2], np.array([1.0, 4.0, 1.0]) / 6.0
        bend = np.array([1.0, -2.0, 1.0])
        along, across = bend @ around @ mean / self.lag_x_m**2, mean @ around @ bend / self.lag_y_m**2
        return self.rms_height_m * math.sqrt(max(-float(along + across), 0.0))

    @property
    def rms_curvature(self) -> float:
        """[1/m], that of the waves as long as a lag: the splines have no fourth derivative."""
        return self.rms_slope / min(self.lag_x_m, self.lag_y_m)

    def __call__(self, x: np.ndarray, y: np.ndarray | float = 0.0) -> np.ndarray:
        nx, ny = self.coefficients.shape
        at = np.broadcast_arrays(np.asarray(x) / self.lag_x_m + nx // 2, np.asarray(y) / self.lag_y_m + ny // 2)
        lags = np.stack(at).reshape(2, -1)
        correlation = scipy.ndimage.map_coordinates(self.coefficients, lags, order=3, mode="constant", prefilter=False)
        return self.rms_height_m**2 * correlation.reshape(at[0].shape)


def measured_covariance(
    correlation: np.ndarray, lag_x_m: float, lag_y_m: float, rms_height_m: float
) -> MeasuredCovariance:
    """A covariance near to an estimated autocorrelation, positive semidefinite on every mesh.

    correlation : (2 kx + 1, 2 ky + 1) [-] at lags of both signs, zero in the middle, where it is 1
    lag_x_m, lag_y_m : [m] between neighbouring lags
    rms_height_m : Sq [m]

    Returns the covariance with the change that it took. Raises ParameterError for a table of another form,
    IllPosedError where a correlation would change by more than LARGEST_CHANGE: take fewer lags or a larger scan.

    Method: on a torus of twice the lags the nearest positive table has the spectrum of the given one, with its negative
    part set to zero. The root of that spectrum is the transform of a kernel h, which is cut to the given lags. The
    result is h * h, scaled to 1 at zero. It is positive at every wave vector and zero beyond twice the given lags.
    """
    _check_table(correlation, lag_x_m, lag_y_m, rms_height_m)
    even = 0.5 * (correlation + correlation[::-1, ::-1])
    spectrum = _spectrum(even, _torus(even.shape))
    root = scipy.fft.irfft2(np.sqrt(np.maximum(spectrum, 0.0)), s=_torus(even.shape))
    kernel = _unwrapped(root, even.shape)
    shape = tuple(2 * n - 1 for n in even.shape)
    positive = _unwrapped(scipy.fft.irfft2(_spectrum(kernel, _torus(shape)) ** 2, s=_torus(shape)), shape)
    positive /= positive[_middle(shape)]
    measured = tuple(slice(n // 2, n // 2 + n) for n in even.shape)
    change = float(np.abs(positive[measured] - even).max())
    if not change <= LARGEST_CHANGE:
        raise IllPosedError(
            f"the covariance near to the table of correlations differs by up to {change:.2g} from it: take fewer "
            "lags, a larger scan or the best of the models",
            scene_keys="roughness.scan.covariance",
        )
    coefficients = scipy.ndimage.spline_filter(np.pad(positive, MARGIN), order=3, mode="mirror")
    return MeasuredCovariance(rms_height_m, lag_x_m, lag_y_m, positive, change, coefficients)


def tapered(correlation: np.ndarray) -> np.ndarray:
    """A table of correlations (2 kx + 1, 2 ky + 1) that falls to zero over the outer half of its lags (Tukey's window).

    An abrupt end has a spectrum at all wavenumbers, and no covariance is near it. Surfaces sampled after two scans had
    5 and 2.7 times their power at the shortest waves, and 1.1 times with the taper. With lags to three correlation
    lengths the taper does not change the lengths.
    """
    windows = []
    for n in correlation.shape:
        out = np.clip((np.abs(np.arange(n) - n // 2) / (n // 2 + 1) - (1 - TAPERED)) / TAPERED, 0.0, 1.0)
        windows.append(0.5 + 0.5 * np.cos(math.pi * out))
    return correlation * np.outer(*windows)


def _check_table(correlation: np.ndarray, lag_x_m: float, lag_y_m: float, rms_height_m: float) -> None:
    for name, value in (("lag along x", lag_x_m), ("lag along y", lag_y_m), ("rms height", rms_height_m)):
        positive(name, value, "m")
    odd = correlation.ndim == 2 and all(n % 2 for n in correlation.shape)
    if not (odd and abs(correlation[_middle(correlation.shape)] - 1.0) <= 1e-9):
        raise ParameterError("a table of correlations has odd numbers of lags on two axes, and is 1 at lag zero")
    if not np.abs(correlation - correlation[::-1, ::-1]).max() <= 1e-9:
        raise ParameterError(
            "a table of correlations must be finite, and equal at opposite lags: take the mean of both"
        )


def _torus(shape: tuple[int, ...]) -> tuple[int, int]:
    nx, ny = (scipy.fft.next_fast_len(2 * n - 1, real=True) for n in shape)
    return nx, ny


def _middle(shape: tuple[int, ...]) -> tuple[int, int]:
    return shape[0] // 2, shape[1] // 2


def _spectrum(table: np.ndarray, torus: tuple[int, int]) -> np.ndarray:
    """Real transform of a table that is equal at opposite lags, its middle moved to the first node of the torus."""
    padded = np.zeros(torus)
    padded[: table.shape[0], : table.shape[1]] = table
    i, j = _middle(table.shape)
    return np.asarray(scipy.fft.rfft2(np.roll(padded, (-i, -j), axis=(0, 1))).real)


def _unwrapped(field: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """The lags of a table of that shape from a torus, equal at opposite lags in every digit."""
    table = np.roll(field, _middle(shape), axis=(0, 1))[: shape[0], : shape[1]]
    return 0.5 * (table + table[::-1, ::-1])
