"""A rough surface of any kind: fields to draw on a mesh, heights from them, and where a rigid plane stands.

Expansions take their variables from a field. For a Gaussian or translated surface it is the Gaussian field. For a
fractal it is the heights, because its phases have no place on the mesh.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from roughslip.errors import ParameterError
from roughslip.grid import Grid
from roughslip.probability import Translation, translate
from roughslip.probability.translation import Distribution
from roughslip.surface.corrected_covariance import corrected
from roughslip.surface.covariance import StationaryCovariance, plane_height
from roughslip.surface.embedding import embed, embed_cell
from roughslip.surface.fractal import WeierstrassMandelbrot, plane_waves
from roughslip.surface.measured_covariance import measured_covariance, tapered
from roughslip.validation import finite, gate


@dataclass(frozen=True, eq=False)
class EndlessLay:
    """The covariance of a surface with an infinitely long lay.

    Heights are equal along the axis of the lay; across it they have the covariance of the profile.

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


Sampler = Callable[[np.random.Generator], np.ndarray]


class SurfaceModel(Protocol):
    """What the stages need of a surface: a field to draw, heights from it, and where the plane stands."""

    @property
    def rms_height_m(self) -> float:
        """Sq [m]."""

    @property
    def lengths_m(self) -> tuple[float, float]:
        """1/e lengths [m] along x and y, which scale the variables of expansions."""

    @property
    def mirror_symmetric(self) -> bool:
        """Whether a surface mirrored along x has the same law; one turned by half a turn always has."""

    def sampler(self, grid: Grid) -> Sampler:
        """A function that draws a field (nx, ny) [m] on the mesh."""

    def heights(self, field: np.ndarray) -> np.ndarray:
        """z : (as field) [m] from a field."""

    def plane_height(self, percentile: float | np.ndarray) -> np.ndarray:
        """h_p [m] that `percentile` per cent of the ensemble of heights lie above; 50 is the median."""


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
    def cell_sampler(self, grid: Grid) -> Sampler:
        """The same of a periodic cell, which the mesh is; raises as `embed_cell`."""
        return embed_cell(self.covariance, grid).sample

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


@gate
@dataclass(frozen=True, eq=False)
class FractalModel:
    """Plane waves with random phases. law : their frequencies and amplitudes."""

    law: WeierstrassMandelbrot

    @property
    def rms_height_m(self) -> float:
        """Sq [m]."""
        return self.law.rms_height_m

    @cached_property
    def lengths_m(self) -> tuple[float, float]:
        """[m] 1/e lengths along x and y."""
        return self.law.correlation_length(0.0), self.law.correlation_length(np.pi / 2)

    @property
    def mirror_symmetric(self) -> bool:
        """Not known: waves may run in any set of directions."""
        return False

    @gate
    def sampler(self, grid: Grid) -> Sampler:
        """One standard normal variable a wave, mapped to its phase."""
        waves, variables = plane_waves(self.law, grid), self.law.variables
        return lambda generator: waves.heights(generator.standard_normal(variables))

    @gate
    def heights(self, field: np.ndarray) -> np.ndarray:
        """The field itself."""
        return field

    @gate
    def plane_height(self, percentile: float | np.ndarray) -> np.ndarray:
        """h_p [m] from the exact law of a sum of cosines."""
        return self.law.marginal().quantile(1.0 - np.asarray(percentile, dtype=float) / 100.0)


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
