"""Contact problems of the benchmark, and a judge that shares no code with any solver except Love's coefficients.

Pressures and gaps scale with the heights, and pressures with E*, so Sq, E* and the edge only set units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft

from roughslip.contact.influence import Influence, love_coefficients
from roughslip.contact.solve import solve
from roughslip.grid import Grid
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of

EDGE = 100e-6  # m
RMS_HEIGHT = 0.5e-6  # m
MODULUS = 2.3e11  # Pa, E* of steel against a rigid plane

SURFACES = {
    "gauss": covariance_of(kind="gaussian", rms_height_m=RMS_HEIGHT, correlation_length_m=EDGE / 16),
    "exp": covariance_of(kind="exponential", rms_height_m=RMS_HEIGHT, correlation_length_m=EDGE / 64),
    "white": None,
}
LEVELS = ("5", "25", "50", "75", "95", "contact90")
SEED = 20260


@dataclass(frozen=True)
class Problem:
    """A surface and a plane.

    grid : the mesh
    heights : (nx, ny) [m]
    plane : height of the plane [m]
    """

    grid: Grid
    heights: np.ndarray
    plane: float

    @property
    def interference(self) -> np.ndarray:
        """(nx, ny) [m] u_bar, height of the surface over the plane."""
        return self.heights - self.plane


def square(n: int) -> Grid:
    """Return the mesh of n x n cells."""
    return Grid(n, n, EDGE / n, EDGE / n)


def surface(kind: str, grid: Grid) -> np.ndarray:
    """Return heights (nx, ny) [m], the same at every call."""
    generator = np.random.default_rng([SEED, list(SURFACES).index(kind), *grid.shape])
    covariance = SURFACES[kind]
    if covariance is None:
        return RMS_HEIGHT * generator.standard_normal(grid.shape)
    return embed(covariance, grid).sample(generator)


def plane_height(level: str, heights: np.ndarray, influence: Influence) -> float:
    """Return the plane [m] below so many per cent of the heights, or for 90 % of the nodes in contact."""
    if level == "contact90":
        return plane_for_area(0.9, heights, influence)
    return float(np.percentile(heights, 100 - float(level)))


def plane_for_area(area: float, heights: np.ndarray, influence: Influence) -> float:
    """Return the plane [m] for an area fraction, to 2 % of the fraction out of contact, by bisection."""

    def contact(plane: float) -> float:
        return solve(influence, heights - plane, 1e-5).area_fraction

    high, depth = float(heights.min()), 8 * float(heights.std())
    while contact(high - depth) < area:
        high, depth = high - depth, 2 * depth
    low = high - depth
    for _ in range(12):
        middle = (low + high) / 2
        excess = contact(middle) - area
        if abs(excess) < (1 - area) / 50:
            return middle
        low, high = (middle, high) if excess > 0 else (low, middle)
    return low


class Convolution:
    """u = B p by transforms padded to twice the mesh (Hockney's method).

    grid, modulus : as of `love_coefficients`
    """

    def __init__(self, grid: Grid, modulus: float) -> None:
        self.coefficients = love_coefficients(grid, modulus)
        self.shape, self.padded = grid.shape, (2 * grid.nx, 2 * grid.ny)
        i, j = (np.minimum(np.arange(2 * n), 2 * n - np.arange(2 * n)) for n in grid.shape)
        reached = (i < grid.nx)[:, None] & (j < grid.ny)  # the offset n, in the middle of the padding, is never used
        kernel = np.where(reached, self.coefficients[np.minimum(i, grid.nx - 1)][:, np.minimum(j, grid.ny - 1)], 0.0)
        self.symbol = fft.rfft2(kernel)

    def __call__(self, pressure: np.ndarray) -> np.ndarray:
        """Return displacements (nx, ny) [m] under pressures (nx, ny) [Pa]."""
        nx, ny = self.shape
        return fft.irfft2(fft.rfft2(pressure, self.padded) * self.symbol, self.padded)[:nx, :ny]

    def direct_sum(self, pressure: np.ndarray) -> np.ndarray:
        """Return the same without a transform, for small meshes."""
        i, j = (np.abs(np.subtract.outer(np.arange(n), np.arange(n))) for n in self.shape)
        return np.einsum("ikjm,km->ij", self.coefficients[i[:, :, None, None], j[None, None, :, :]], pressure)


class Judge:
    """The residual ||min(gap, B_00 p)|| / ||max(u_bar, 0)|| with gap = B p - u_bar, the same for every method."""

    def __init__(self, grid: Grid) -> None:
        self.convolution = Convolution(grid, MODULUS)

    def residual(self, problem: Problem, pressure: np.ndarray) -> float:
        """Return the residual: 1 without pressure, 0 at the solution."""
        interference = problem.interference
        gap = self.convolution(pressure) - interference
        unmet = np.minimum(gap, self.convolution.coefficients[0, 0] * pressure)
        return float(np.linalg.norm(unmet) / np.linalg.norm(np.maximum(interference, 0.0)))
