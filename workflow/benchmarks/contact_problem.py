"""Contact problems of the benchmarks, and a judge that shares no code with any solver except Love's coefficients.

Pressures and gaps scale with the heights, and pressures with E*, so Sq, E* and the edge only set units.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import fft
from scipy.optimize import bisect

from roughslip.contact.influence import Influence, love_coefficients
from roughslip.contact.solve import solve
from roughslip.grid import Grid
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of

EDGE = 100e-6  # m
RMS_HEIGHT = 0.5e-6  # m
MODULUS = 2.3e11  # Pa, E* of steel against a rigid plane
SEED = 20260

SURFACES = {
    "gauss": covariance_of(kind="gaussian", rms_height_m=RMS_HEIGHT, correlation_length_m=EDGE / 16),
    "exp": covariance_of(kind="exponential", rms_height_m=RMS_HEIGHT, correlation_length_m=EDGE / 64),
    "white": None,
}
LEVELS = ("5", "25", "50", "75", "95", "contact90")  # per cent of the heights above the plane, or of nodes in contact


class Problem(NamedTuple):
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
    """Return heights (nx, ny) [m] of a kind in SURFACES, the same at every call."""
    generator = np.random.default_rng([SEED, list(SURFACES).index(kind), *grid.shape])
    covariance = SURFACES[kind]
    if covariance is None:
        return RMS_HEIGHT * generator.standard_normal(grid.shape)
    return embed(covariance, grid).sample(generator)


def plane_height(level: str, heights: np.ndarray, influence: Influence) -> float:
    """Return the plane [m] of a level in LEVELS; one for contact is found to 0.1 % of the RMS height."""
    if level != "contact90":
        return float(np.percentile(heights, 100 - float(level)))

    def excess(plane: float) -> float:
        return solve(influence, heights - plane, 1e-5).area_fraction - 0.9

    high, depth = float(heights.min()), 8 * float(heights.std())
    while excess(high - depth) < 0:
        high, depth = high - depth, 2 * depth
    return float(bisect(excess, high - depth, high, xtol=1e-3 * float(heights.std())))


class Convolution:
    """u = B p by transforms padded to twice the mesh (Hockney's method).

    grid, modulus : as of `love_coefficients`
    """

    def __init__(self, grid: Grid, modulus: float) -> None:
        self.coefficients = love_coefficients(grid, modulus)
        self.shape, self.padded = grid.shape, (2 * grid.nx, 2 * grid.ny)
        i, j = (np.abs(fft.fftfreq(2 * n, 1 / (2 * n))).astype(int) % n for n in grid.shape)  # offset n is never used
        self.symbol = fft.rfft2(self.coefficients[i[:, None], j])

    def __call__(self, pressure: np.ndarray) -> np.ndarray:
        """Return displacements (nx, ny) [m] under pressures (nx, ny) [Pa]."""
        nx, ny = self.shape
        return fft.irfft2(fft.rfft2(pressure, self.padded) * self.symbol, self.padded)[:nx, :ny]


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
