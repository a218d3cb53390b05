"""Normal displacement of a periodic elastic half-space under pressures uniform on the cells of a mesh, mode by mode.

A plane wave of pressure displaces the surface by u = 2 p / (E* |q|). A pressure that is uniform on the cells also
contains the waves q + G, which agree with q at the nodes; G are the reciprocal vectors of the mesh:

    Lambda(q) = 2/E* sum_G sinc((q_x + G_x) dx/2) sinc((q_y + G_y) dy/2) / |q + G|,   sinc t = sin(t) / t.

This is the influence matrix of the free half-space, summed over all images of a cell of the surface. A mean pressure
has no finite displacement on a half-space. Lambda(0) = 0, so displacements are relative to their mean.

The usual symbol is the term G = 0 without its sinc, 2/(E* |q|) (Stanley and Kato, J. Tribol. 119 (1997) 481). It is
slightly better for smooth surfaces (L2 error of a sine wave of 256 cells 1.23e-3, here 1.32e-3). This one is better for
steps, for limited pressures and for solvers that exchange nodes. Its least eigenvalue on 32 x 32 square cells is
0.54 B_00, there 0.42 B_00, and all off-diagonal entries of its inverse are negative. With it a large periodic cell
tends to the free half-space on the same mesh.

Both have their place. To second order Lambda is less than that of the wave by 1 - (q h)^2 / 24, so a mesh asks for
pressures that are too large. For the shortest waves of a surface at eight cells each that is 1.9 to 3.2 %, and the area
under a load is up to 1 % too small. Hertz contacts do not show it: a paraboloid is only shifted. `cell_heights` lowers
the waves of the heights by the same factor. The matrix stays, and full contact is exact.
"""

from __future__ import annotations

import functools
import math

import numpy as np
from scipy.special import erf

from roughslip.errors import ParameterError
from roughslip.grid import Grid
from roughslip.validation import finite, gate, positive

# erf(6) = 1 to rounding, and so is 1 - exp(-6^2).
REACH = 6.0

# Gauss-Legendre nodes per panel of unit length in ln s. With 12 the error is 1e-11, with 14 it is rounding.
PANEL_NODES = 16


def periodic_symbol(grid: Grid, plane_strain_modulus_pa: float) -> np.ndarray:
    """Eigenvalues of the influence matrix of a periodic cell.

    grid : the mesh of one cell, nx dx by ny dy
    plane_strain_modulus_pa : E* = E / (1 - nu^2) [Pa]

    Returns (nx, ny // 2 + 1) [m/Pa], in the order of numpy.fft.rfft2: u = irfft2(symbol * rfft2(p), (nx, ny)). Zero for
    the mean, positive otherwise, to a few units in the last place on cells of any aspect.
    Raises ParameterError for a modulus that is not positive and finite.

    Method: with 1/r = 2/sqrt(pi) int_0^inf exp(-s^2 x^2) exp(-s^2 y^2) ds the sum over images becomes

        Lambda = 2/(sqrt(pi) E*) int_0^inf X(s, q_x) Y(s, q_y) ds / s^2,

    a product of two sums along the axes, in place of the slowly converging, alternating sum over G. X and Y are
    positive (see influence), so every term of the quadrature is.
    """
    positive("plane_strain_modulus_pa", plane_strain_modulus_pa, "Pa")
    # Below the first s every mode but the mean has X Y < exp(-REACH^2). Above the last X = Y = 1, and 1/s remains.
    lowest = math.pi / max(grid.nx * grid.dx, grid.ny * grid.dy) / REACH
    highest = 2 * REACH / min(grid.dx, grid.dy)
    s, weight = _logarithmic_panels(lowest, highest)
    along = _lattice_sum(s * grid.dx, grid.nx) * (weight / s)[:, None]
    across = _lattice_sum(s * grid.dy, grid.ny)
    half = np.einsum("ki,kj->ij", along, across) + 1 / highest
    symbol = half[np.minimum(np.arange(grid.nx), grid.nx - np.arange(grid.nx))]  # even in q_x
    symbol *= 2 / (math.sqrt(math.pi) * plane_strain_modulus_pa)
    symbol[0, 0] = 0.0
    return symbol


@gate
def cell_heights(heights: np.ndarray, grid: Grid) -> np.ndarray:
    """Heights of a smooth periodic surface, as cells of constant pressure need them.

    heights : (nx, ny) [m] at the nodes of one cell of the surface
    grid : their mesh

    Returns (nx, ny) [m], each wave of the heights times Lambda(q) E* |q| / 2. With them `solve_load` has in full
    contact the pressures p + E* |q| z_q / 2 at the nodes, to rounding. Its gap is then lower by the same factors. The
    mean stays. They are for waves of four cells and more, not for heights that are independent from cell to cell or
    have steps. Raises ParameterError for heights of another shape.
    """
    heights = finite("heights", heights, 2)
    if heights.shape != grid.shape:
        raise ParameterError(f"the heights have the shape {heights.shape}, the mesh has {grid.shape}")
    return np.fft.irfft2(_cell_factors(grid) * np.fft.rfft2(heights), grid.shape)


@functools.lru_cache(maxsize=4)  # belts of one mesh follow each other, and the symbol takes a third of a solve
def _cell_factors(grid: Grid) -> np.ndarray:
    """Lambda(q) E* |q| / 2, and one for the mean, in the order of numpy.fft.rfft2."""
    waves = np.hypot(np.fft.fftfreq(grid.nx, grid.dx)[:, None], np.fft.rfftfreq(grid.ny, grid.dy))
    factors = periodic_symbol(grid, 1.0) * math.pi * waves
    factors[0, 0] = 1.0
    return factors


def _logarithmic_panels(lowest: float, highest: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes s and weights of the integral of f over ln s, from the lowest to the highest s."""
    panels = math.ceil(math.log(highest / lowest))
    edges = np.linspace(math.log(lowest), math.log(highest), panels + 1)
    node, weight = np.polynomial.legendre.leggauss(PANEL_NODES)
    half = (edges[1] - edges[0]) / 2
    return np.exp((edges[:-1, None] + half * (1 + node)).ravel()), np.tile(half * weight, panels)


def _lattice_sum(a: np.ndarray, n: int) -> np.ndarray:
    """Sum over an infinite row of cells, s/sqrt(pi) sum_k exp(i k theta) int_k exp(-s^2 t^2) dt; a = s times the cell.

    a : (m,) positive
    n : number of cells in a period

    Returns (m, n // 2 + 1), theta = 2 pi j / n. Where the Gaussian is wider than a cell, Poisson's formula gives
    sum_l exp(-(w_l / a)^2) sinc w_l with w_l = theta/2 + pi l. Elsewhere the sum is taken directly, k and -k together.
    At a = 1, where both converge slowest, the omitted terms are below 1e-19.
    """
    theta = 2 * np.pi * np.arange(n // 2 + 1) / n
    result = np.empty((a.size, theta.size))
    wide = a < 1
    w = theta / 2 + np.pi * np.arange(-2, 3)[:, None, None]
    result[wide] = (np.exp(-((w / a[wide, None]) ** 2)) * np.sinc(w / np.pi)).sum(axis=0)
    k = np.arange(7)[:, None, None]
    edge = a[~wide, None]
    cell = (erf(edge * (k + 0.5)) - erf(edge * (k - 0.5))) / 2
    cell[1:] *= 2
    result[~wide] = (cell * np.cos(k * theta)).sum(axis=0)
    return result
