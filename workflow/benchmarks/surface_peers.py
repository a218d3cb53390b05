"""Generators of samples, ours and the two of GSTools as documented, and modes by LAPACK on the whole matrix.

A sampler is set up once for a mesh; a sample is timed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
import scipy.linalg

from roughslip.grid import Grid
from roughslip.surface.covariance import Covariance
from roughslip.surface.embedding import embed
from workflow.benchmarks.surface_problem import Lags

SEED = 20260
PERIOD = 1.5  # period of the Fourier method over the edge; images are at least half an edge away


class Sampler(Protocol):
    """Samples of one field on one mesh."""

    def sample(self, number: int) -> np.ndarray:
        """Return heights (nx, ny) of the sample of that number."""

    def ensemble(self, lags: Lags) -> np.ndarray:
        """Return the covariance (lags,) that the mean over all samples converges to."""


class Embedded:
    """Circulant embedding, ours. Its covariance is the transform of the squared root."""

    def __init__(self, covariance: Covariance, grid: Grid, setting: int = 0) -> None:
        self.embedding = embed(covariance, grid)

    def sample(self, number: int) -> np.ndarray:
        return self.embedding.sample(np.random.default_rng([SEED, number]))

    def ensemble(self, lags: Lags) -> np.ndarray:
        return np.fft.irfft2(self.embedding.root**2, self.embedding.torus)[lags.i, lags.j]


class Randomization:
    """GSTools' randomization: `setting` plane waves of random wave vectors from the spectrum, redrawn for each sample.

    F. Hesse et al., Environ. Model. Softw. 55 (2014) 32. Its ensemble has the model's covariance; one sample has that
    of its few waves.
    """

    def __init__(self, covariance: Covariance, grid: Grid, setting: int) -> None:
        self.covariance = covariance
        self.field = _field(covariance, generator="RandMeth", mode_no=setting)
        self.axes = grid.x(), grid.y()

    def sample(self, number: int) -> np.ndarray:
        return self.field.structured(self.axes, seed=number, store=False)

    def ensemble(self, lags: Lags) -> np.ndarray:
        return self.covariance(lags.x, lags.y)


class Fourier(Randomization):
    """GSTools' Fourier method: plane waves at `setting` x `setting` equidistant wave vectors, summed at every node.

    The period is PERIOD edges. Waves beyond the last one and between two are missing, which is a systematic error.
    """

    def __init__(self, covariance: Covariance, grid: Grid, setting: int) -> None:
        self.covariance = covariance
        self.periods = PERIOD * grid.nx * grid.dx, PERIOD * grid.ny * grid.dy
        self.field = _field(covariance, generator="Fourier", period=list(self.periods), mode_no=[setting, setting])
        self.axes, self.setting = (grid.x(), grid.y()), setting

    def ensemble(self, lags: Lags) -> np.ndarray:
        return covariance_of_waves(self.covariance, self.periods, self.setting, lags.x, lags.y)


def covariance_of_waves(
    covariance: Covariance, periods: tuple[float, float], waves: int, x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """Return sum_k S(k) dk / (2 pi)^2 cos(k . l) (lags,) over equidistant wave vectors, from -waves / 2 on each axis.

    It uses our spectrum and no number of the Fourier method.
    """
    steps = [2 * np.pi / period for period in periods]
    kx, ky = (step * np.arange(-(waves // 2), waves // 2) for step in steps)
    shares = covariance.spectrum(kx[:, None], ky[None, :]) * steps[0] * steps[1] / (2 * np.pi) ** 2
    along, across = np.exp(1j * np.outer(x, kx)), np.exp(1j * np.outer(y, ky))
    return ((along @ shares) * across).sum(axis=1).real


def _field(covariance: Covariance, **generator: object) -> object:
    """Return the field in GSTools, on one thread; with `rescale` 1 its length scale is our 1/e length."""
    import gstools

    gstools.config.NUM_THREADS = 1
    models = {"gaussian": gstools.Gaussian, "exponential": gstools.Exponential}
    length, variance = covariance.correlation_length_m, covariance.rms_height_m**2
    return gstools.SRF(models[covariance.kind](dim=2, var=variance, len_scale=length, rescale=1.0), **generator)


SAMPLERS: dict[str, Callable[[Covariance, Grid, int], Sampler]] = {
    "gstools/randomization": Randomization,
    "gstools/fourier": Fourier,
}


def dense_modes(covariance: Covariance, grid: Grid, order: int) -> np.ndarray:
    """Return the largest eigenvalues (order,), descending, by LAPACK on the whole matrix; vectors are computed too."""
    x, y = (axis.ravel() for axis in np.meshgrid(grid.x(), grid.y(), indexing="ij"))
    matrix = covariance(np.subtract.outer(x, x), np.subtract.outer(y, y))
    values, _ = scipy.linalg.eigh(matrix, subset_by_index=[grid.size - order, grid.size - 1], overwrite_a=True)
    return values[::-1]
