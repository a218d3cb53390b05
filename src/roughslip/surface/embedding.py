"""Exact sampling of stationary Gaussian fields on long strips by circulant embedding."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft

from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.surface.covariance import Covariance

NEGATIVE_SHARE = 1e-9  # of the largest eigenvalue: what rounding and a truncated tail may leave below zero
DOUBLINGS = 12
MOST_NODES = 2**25  # of the torus: a few arrays of 0.3 GB
REACH = {"gaussian": 6.0, "exponential": 36.0}  # correlation lengths beyond which the correlation is below 1e-15


@dataclass(frozen=True)
class Embedding:
    """Square root of the covariance on a torus that holds the mesh.

    grid : the mesh
    torus : nodes of the torus on each axis
    root : (torus[0], torus[1] // 2 + 1) [m] square root of the eigenvalues of the circulant covariance
    clipped_variance : share of the variance in eigenvalues below zero, which were set to zero
    """

    grid: Grid
    torus: tuple[int, int]
    root: np.ndarray
    clipped_variance: float

    def sample(self, generator: np.random.Generator) -> np.ndarray:
        """z : (nx, ny) [m] heights, stationary with the covariance asked for: white noise on the torus, filtered."""
        noise = scipy.fft.rfft2(generator.standard_normal(self.torus))
        heights = scipy.fft.irfft2(self.root * noise, s=self.torus)
        return np.ascontiguousarray(heights[: self.grid.nx, : self.grid.ny])


def embed(covariance: Covariance, grid: Grid) -> Embedding:
    """Circulant embedding (Dietrich and Newsam 1997) on the smallest of a few tori that is positive.

    Lags on the mesh are exact once the torus exceeds it by its own size, or by the reach of the covariance. On an axis
    shorter than the reach the excess doubles, up to twice the reach, while an eigenvalue lies below zero by more than
    NEGATIVE_SHARE of the largest. Raises IllPosedError where none serves within MOST_NODES: use a shorter correlation
    length or larger cells.
    """
    reach = REACH[covariance.kind] * covariance.correlation_length_m
    worst, torus = 0.0, grid.shape
    for doubling in range(DOUBLINGS):
        torus = (
            _even_fast_length(grid.nx + _excess(grid.nx, reach / grid.dx, doubling)),
            _even_fast_length(grid.ny + _excess(grid.ny, reach / grid.dy, doubling)),
        )
        if torus[0] * torus[1] > MOST_NODES:
            break
        x = np.minimum(np.arange(torus[0]), torus[0] - np.arange(torus[0])) * grid.dx
        y = np.minimum(np.arange(torus[1]), torus[1] - np.arange(torus[1])) * grid.dy
        eigenvalues = scipy.fft.rfft2(covariance(x[:, None], y[None, :])).real
        worst = float(eigenvalues.min() / eigenvalues.max())
        if worst >= -NEGATIVE_SHARE:
            negative = np.maximum(-eigenvalues, 0.0)
            clipped = float(negative.sum() / np.abs(eigenvalues).sum())
            return Embedding(grid, torus, np.sqrt(np.maximum(eigenvalues, 0.0)), clipped)
    raise IllPosedError(
        f"no torus up to {torus[0]} x {torus[1]} nodes embeds the covariance: smallest eigenvalue {worst:.1e} of the "
        f"largest; use a shorter correlation length or larger cells"
    )


def _excess(nodes: int, reach: float, doubling: int) -> float:
    """Nodes by which the torus exceeds the mesh on an axis; `reach` is that of the covariance in nodes."""
    first = min(nodes, reach)
    return min(first * 2**doubling, max(first, 2 * reach))


def _even_fast_length(nodes: float) -> int:
    length = int(np.ceil(nodes))
    while (length := scipy.fft.next_fast_len(length, real=True)) % 2:
        length += 1
    return length
