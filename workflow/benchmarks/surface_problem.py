"""Covariances of the benchmark, ours and public generators of samples, and judges that share no code with either.

The unit of height is Sq and that of length the edge of the mesh; neither changes a time or an error. A generator is set
up once for a mesh; a sample is timed. The generators of GSTools are used as documented.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import fft

from roughslip.grid import Grid
from roughslip.surface import models
from roughslip.surface.covariance import Covariance, StationaryCovariance
from roughslip.surface.embedding import embed
from roughslip.surface.karhunen_loeve import KarhunenLoeve
from roughslip.surface.models import self_affine

LENGTH = 0.1
LAY = 0.5
LAGS = 0.3  # RMS errors include lags up to three correlation lengths on each axis
LAGS_A_SIDE = 32  # lags on an edge, the same on every mesh

COVARIANCES = ("gaussian", "separable_exponential", "exponential", "matern", "rotated", "self_affine")


def square(n: int) -> Grid:
    """Return the mesh of n x n cells."""
    return Grid(n, n, 1 / n, 1 / n)


def covariance_of(name: str, grid: Grid) -> Covariance:
    """Return the covariance of that name; the self-affine spectrum ends at the shortest waves of the mesh."""
    if name == "matern":
        return models.covariance_of("matern", 1.0, LENGTH, smoothness=1.5)
    if name == "rotated":
        return models.covariance_of("exponential", 1.0, 2 * LENGTH, LENGTH / 2, LAY)
    if name == "self_affine":
        return self_affine(1.0, 0.8, 0.5, 2 * max(grid.dx, grid.dy))
    return models.covariance_of(name, 1.0, LENGTH)  # type: ignore[arg-type]


class Convolution:
    """C z for the covariance matrix C of the nodes, by transforms padded to twice the mesh."""

    def __init__(self, covariance: StationaryCovariance, grid: Grid) -> None:
        self.shape, self.padded = grid.shape, (2 * grid.nx, 2 * grid.ny)
        x, y = (fft.fftfreq(2 * n, 1 / (2 * n)) for n in grid.shape)
        reached = (np.abs(x) < grid.nx)[:, None] & (np.abs(y) < grid.ny)  # lags of n nodes do not occur
        lags = np.where(reached, covariance((x * grid.dx)[:, None], (y * grid.dy)[None, :]), 0.0)
        self.symbol = fft.rfft2(lags)

    def __call__(self, field: np.ndarray) -> np.ndarray:
        """Return C z (nx, ny) of a field z (nx, ny)."""
        nx, ny = self.shape
        return fft.irfft2(fft.rfft2(field, self.padded) * self.symbol, self.padded)[:nx, :ny]


def residual(covariance: StationaryCovariance, found: KarhunenLoeve) -> float:
    """Return the largest |C phi - lambda phi| / lambda_1 of the modes, with phi of unit norm."""
    product, worst = Convolution(covariance, found.grid), 0.0
    for eigenvalue, mode in zip(found.eigenvalues, found.modes, strict=True):
        difference = np.linalg.norm(product(mode) - eigenvalue * mode) / np.linalg.norm(mode)
        worst = max(worst, float(difference / found.eigenvalues[0]))
    return worst


@dataclass(frozen=True)
class Lags:
    """Lags at which sample covariances are compared: a half plane, because C(-l) = C(l).

    grid : the mesh
    i, j : (lags,) in nodes, i >= 0, j of both signs
    """

    grid: Grid
    i: np.ndarray
    j: np.ndarray

    @classmethod
    def of(cls, grid: Grid) -> Lags:
        step = max(1, grid.nx // LAGS_A_SIDE), max(1, grid.ny // LAGS_A_SIDE)
        most = int(LAGS * grid.nx) // step[0], int(LAGS * grid.ny) // step[1]
        i, j = np.meshgrid(np.arange(most[0] + 1), np.arange(-most[1], most[1] + 1), indexing="ij")
        kept = ((i > 0) | (j >= 0)).ravel()
        return cls(grid, step[0] * i.ravel()[kept], step[1] * j.ravel()[kept])

    @property
    def x(self) -> np.ndarray:
        """Lags (lags,) along x."""
        return self.i * self.grid.dx

    @property
    def y(self) -> np.ndarray:
        """Lags (lags,) along y."""
        return self.j * self.grid.dy

    @property
    def pairs(self) -> np.ndarray:
        """Number (lags,) of pairs of nodes at each lag."""
        return (self.grid.nx - self.i) * (self.grid.ny - np.abs(self.j))

    def covariance(self, heights: np.ndarray) -> np.ndarray:
        """Return the mean (lags,) of z(x) z(x + l) over the pairs of one sample (nx, ny) of zero mean."""
        padded = tuple(
            fft.next_fast_len(int(n + lag.max()), real=True)
            for n, lag in zip(heights.shape, (self.i, self.j), strict=True)
        )
        sums = fft.irfft2(np.abs(fft.rfft2(heights, padded)) ** 2, padded)
        return sums[self.i, self.j] / self.pairs

    def floor(self, covariance: StationaryCovariance) -> float:
        """Return the RMS error over the lags of the covariance of one exact sample; N samples divide it by sqrt(N).

        Var C^(l) = P^-2 sum_d w(d) (C(d)^2 + C(d + l) C(d - l)) over the differences d of the P pairs, each w(d)
        times, for a Gaussian field (M. S. Bartlett, J. R. Stat. Soc. Suppl. 8, 1946, 27).
        """
        reach = self.grid.nx - 1 + int(self.i.max()), self.grid.ny - 1 + int(self.j.max())
        x, y = (np.arange(-r, r + 1) * d for r, d in zip(reach, (self.grid.dx, self.grid.dy), strict=True))
        table = covariance(x[:, None], y[None, :])
        total = 0.0
        for i, j, pairs in zip(self.i, self.j, self.pairs, strict=True):
            far = self.grid.nx - 1 - i, self.grid.ny - 1 - abs(j)  # the largest difference of pairs on each axis

            def lags(di: int, dj: int, far: tuple[int, int] = far) -> np.ndarray:
                first = reach[0] + di - far[0], reach[1] + dj - far[1]
                return table[first[0] : first[0] + 2 * far[0] + 1, first[1] : first[1] + 2 * far[1] + 1]

            weight_x, weight_y = (f + 1.0 - np.abs(np.arange(-f, f + 1)) for f in far)
            terms = lags(0, 0) ** 2 + lags(i, j) * lags(-i, -j)
            total += float(weight_x @ terms @ weight_y) / float(pairs) ** 2
        return math.sqrt(total / len(self.i)) / covariance.rms_height_m**2


def root_mean_square(difference: np.ndarray) -> float:
    """Return the root mean square over all entries."""
    return math.sqrt(float(np.mean(difference**2)))


# Generators.

Sampler = Callable[[int], np.ndarray]  # heights (nx, ny) of the sample of a number
SEED = 20260
PERIOD = 1.5  # period of the Fourier method over the edge; images are at least half an edge away


def set_up_embedding(covariance: Covariance, grid: Grid, _: int = 0) -> Sampler:
    """Set up circulant embedding, ours."""
    embedding = embed(covariance, grid)
    return lambda number: embedding.sample(np.random.default_rng([SEED, number]))


def set_up_randomization(covariance: Covariance, grid: Grid, waves: int) -> Sampler:
    """Set up GSTools' randomization: plane waves of random wave vectors from the spectrum, redrawn for each sample.

    F. Hesse et al., Environ. Model. Softw. 55 (2014) 32. Its ensemble has the model's covariance; one sample has that
    of its few waves.
    """
    field, axes = gstools_field(covariance, generator="RandMeth", mode_no=waves), (grid.x(), grid.y())
    return lambda number: field.structured(axes, seed=number, store=False)


def set_up_fourier(covariance: Covariance, grid: Grid, waves: int) -> Sampler:
    """Set up GSTools' Fourier method: plane waves at waves x waves equidistant wave vectors, summed at every node.

    The period is PERIOD edges. Waves beyond the last one and between two are missing, which is a systematic error.
    """
    periods, axes = [PERIOD * grid.nx * grid.dx, PERIOD * grid.ny * grid.dy], (grid.x(), grid.y())
    field = gstools_field(covariance, generator="Fourier", period=periods, mode_no=[waves, waves])
    return lambda number: field.structured(axes, seed=number, store=False)


def gstools_field(covariance: Covariance, **generator: object) -> Any:
    """Return the field in GSTools, on one thread; with `rescale` 1 its length scale is our 1/e length."""
    import gstools

    gstools.config.NUM_THREADS = 1
    models = {"gaussian": gstools.Gaussian, "exponential": gstools.Exponential}
    length, variance = covariance.correlation_length_m, covariance.rms_height_m**2
    return gstools.SRF(models[covariance.kind](dim=2, var=variance, len_scale=length, rescale=1.0), **generator)


PEERS: dict[str, Callable[[Covariance, Grid, int], Sampler]] = {
    "gstools/randomization": set_up_randomization,
    "gstools/fourier": set_up_fourier,
}
