"""A rough surface of any kind: fields to draw on a mesh, heights from them, and where a rigid plane stands.

Expansions take their variables from a field. For a Gaussian or translated surface it is the Gaussian field. For a
fractal it is the heights, because its phases have no place on the mesh.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from roughslip.errors import IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.probability import translate
from roughslip.probability.translation import Distribution, Translation
from roughslip.surface.covariance import StationaryCovariance, plane_height
from roughslip.surface.embedding import circulant_lags, embed
from roughslip.surface.fractal import WeierstrassMandelbrot
from roughslip.surface.measured_covariance import measured_covariance, tapered
from roughslip.validation import finite, gate

NODES, NODES_PER_LENGTH = 256, 8  # of the mesh, on each axis, on which the existence of the correction is tested
NEGATIVE_SHARE = 1e-6  # of the spectrum that may be cut

Sampler = Callable[[np.random.Generator], np.ndarray]


@dataclass(frozen=True, eq=False)
class DerivedCovariance:
    """A covariance made of another one, by `endless_lay` or `corrected`; attributes as of StationaryCovariance."""

    rms_height_m: float
    reach_m: tuple[float, float]
    mirror_symmetric: bool
    separable: bool
    values: Callable[[np.ndarray, np.ndarray], np.ndarray]

    def __call__(self, x: np.ndarray, y: np.ndarray | float = 0.0) -> np.ndarray:
        x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        return self.values(x, y)


def endless_lay(profile: StationaryCovariance, axis: int) -> DerivedCovariance:
    """The covariance of a surface with an infinitely long lay along an axis, 0 for x and 1 for y.

    Heights are equal along it, so that it has any period there. Across it they have the covariance of the profile.
    """
    (x, y), zero = profile.reach_m, np.zeros(1)
    reach, across = ((x, 0.0), lambda x, _: profile(x, zero)) if axis else ((0.0, y), lambda _, y: profile(zero, y))
    return DerivedCovariance(profile.rms_height_m, reach, True, True, across)


def corrected(
    wanted: StationaryCovariance, translation: Translation, lengths_m: tuple[float, float]
) -> DerivedCovariance:
    """The covariance of the Gaussian field whose translated heights have the covariance asked for.

    lengths_m : 1/e lengths along x and y [m], for the cells of a torus on which it is seen that such a field exists

    Raises IllPosedError, with the deviation of the nearest correlation, where none can.

    Translation maps a correlation rho of the Gaussian variables to rho_z(rho). Its inverse, lag by lag, gives the
    Gaussian correlation, if the result is positive semidefinite. For smooth kernels it is not. Near lag zero
    rho ~ rho_z / w_1 - (w_2 / w_1^3) rho_z^2, and the square of a Gaussian kernel has the wider spectrum: the
    difference is negative at short waves. Kernels whose spectra fall by a power (exponential, matern) allow it.
    """
    cells = lengths_m[0] / NODES_PER_LENGTH, lengths_m[1] / NODES_PER_LENGTH
    variance = wanted.rms_height_m**2
    lags = circulant_lags(wanted, Grid(NODES, NODES, *cells), (2 * NODES, 2 * NODES))
    refuse_impossible(translation, lags / variance)

    def values(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return variance * translation.gaussian_correlation(wanted(x, y) / variance)

    # a product of two correlations, inverted, is no product
    return DerivedCovariance(wanted.rms_height_m, wanted.reach_m, wanted.mirror_symmetric, False, values)


def refuse_impossible(translation: Translation, wanted: np.ndarray) -> None:
    """Raises IllPosedError where no Gaussian field gives heights of a correlation, with the deviation of the nearest.

    wanted : (tx, ty) [-] of the heights, by lag on a torus: 1 at lag zero, even

    The nearest is raised to the least correlation possible, with its spectrum cut at zero.
    """
    minimum = translation.least_correlation
    gaussian = translation.gaussian_correlation(np.maximum(wanted, minimum))
    spectrum = np.fft.fftn(gaussian).real
    positive = np.maximum(spectrum, 0.0)
    nearest = np.fft.ifftn(positive * (wanted.size / np.sum(positive))).real
    reasons, below = [], minimum - float(np.min(wanted))
    if below > translation.least_error:
        reasons.append(f"it falls {below:.2g} below the least possible {minimum:.4g}")
    negative = float(np.sum(positive - spectrum) / np.sum(np.abs(spectrum)))
    if negative > NEGATIVE_SHARE:
        reasons.append(f"{negative:.2g} of the spectrum needed is negative (allowed {NEGATIVE_SHARE:.2g})")
    if reasons:
        deviation = float(np.max(np.abs(translation.correlation(nearest) - wanted)))
        raise IllPosedError(
            f"no Gaussian field gives the wanted correlation: {' and '.join(reasons)}; the nearest deviates by "
            f"{deviation:.2g}: leave the correlation uncorrected",
            scene_keys="roughness.correct_correlation",
        )


@gate
@dataclass(frozen=True, eq=False)
class GaussianModel:
    """A Gaussian field, or heights translated from one.

    covariance : of the Gaussian field, whose Sq is that of the heights
    lengths_m : [m] 1/e lengths along x and y
    marginal : law of the heights; None where they are Gaussian
    """

    covariance: StationaryCovariance
    lengths_m: tuple[float, float]
    marginal: Distribution | None = None

    @property
    def rms_height_m(self) -> float:
        """Sq [m]."""
        return self.covariance.rms_height_m

    @property
    def mirror_symmetric(self) -> bool:
        """Whether the covariance is so."""
        return self.covariance.mirror_symmetric

    @cached_property
    def _translation(self) -> Translation | None:
        return None if self.marginal is None else translate(self.marginal)

    @gate
    def sampler(self, grid: Grid) -> Sampler:
        """Exact sampling by circulant embedding."""
        return embed(self.covariance, grid).sample

    @gate
    def heights(self, field: np.ndarray) -> np.ndarray:
        """z : (as field) [m]; of a truncated expansion, whose variance is smaller, so is that of the heights."""
        return field if self._translation is None else self._translation.apply(field / self.rms_height_m)

    @gate
    def plane_height(self, percentile: float | np.ndarray) -> np.ndarray:
        """h_p [m] from the quantiles of the law of the heights."""
        if self.marginal is None:
            return plane_height(percentile, self.rms_height_m)
        return np.asarray(self.marginal.from_gaussian(plane_height(percentile, 1.0)))


SurfaceModel = GaussianModel | WeierstrassMandelbrot  # both draw fields, translate them to heights and place planes


@gate
def gaussian_model(
    covariance: StationaryCovariance,
    lengths_m: tuple[float, float] | None = None,
    marginal: Distribution | None = None,
    *,
    correct_correlation: bool = False,
) -> GaussianModel:
    """A surface of a covariance and a law of heights.

    covariance : of the heights if `correct_correlation`, else of the Gaussian field behind them
    lengths_m, marginal : as of GaussianModel; a Covariance has its own lengths

    Raises IllPosedError where no Gaussian field gives the heights that covariance, ParameterError for missing lengths.
    """
    lengths_m = lengths_m or getattr(covariance, "axis_lengths_m", None)
    if lengths_m is None:
        raise ParameterError("lengths_m must be given where the covariance is not one of roughslip.surface.MODELS")
    if marginal is not None and correct_correlation:
        covariance = corrected(covariance, translate(marginal), lengths_m)
    return GaussianModel(covariance, lengths_m, marginal)


@gate
def measured_model(
    correlation: np.ndarray,
    lag_steps_m: tuple[float, float],
    rms_height_m: float,
    lengths_m: tuple[float, float],
    marginal: Distribution | None = None,
    *,
    correct_correlation: bool = False,
) -> GaussianModel:
    """A surface of a table of correlations, as `measured_covariance` takes it, and a law of heights.

    correlation : (2 kx + 1, 2 ky + 1) [-] at lags of both signs, zero in the middle, where it is 1

    A correction is that of each lag; the covariance near to the table so found, tapered, is taken, as without one.
    Raises IllPosedError as `measured_covariance`.
    """
    correlation = finite("correlation", correlation, 2)
    if marginal is not None and correct_correlation:
        translation = translate(marginal)
        correlation = translation.gaussian_correlation(np.maximum(correlation, translation.least_correlation))
    return GaussianModel(measured_covariance(tapered(correlation), *lag_steps_m, rms_height_m), lengths_m, marginal)
