"""Normal displacement of a free elastic half-space under pressures uniform on the cells of a mesh: u = B p.

B is positive definite for every shape of cell, so the contact problem has one solution. The proof:

    1/r = 2/sqrt(pi) int_0^inf exp(-s^2 x^2) exp(-s^2 y^2) ds,

so B is a sum of Kronecker products of the Toeplitz matrices of g_k = int_{k-1/2}^{k+1/2} exp(-(s t)^2) dt. By Poisson's
formula their symbol, 0 < q <= pi, is a positive factor times

    sin(q/2) sum_m (-1)^m exp(-((q + 2 pi m) / 2 s)^2) / (q/2 + pi m).

The terms m >= 0 and m < 0 are two alternating series of decreasing terms, each with a positive first term.

Distant contacts along a strip act on the contact at a column by one step of a fixed-point iteration. An expansion in
local functionals describes contacts within some correlation lengths. Distant columns that carry more force than the
mean press the surface down by

    u(x) = sum over |x' - x| > reach of K(x - x') (F(x') - mean F),

with K the displacement averaged across the strip. For a column pressed down by u the plane is higher by u. Its contact
area and force are therefore those at the height h_p + u, interpolated between the known penetrations. The mean of F is
subtracted because the expansion was trained with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from roughslip import fft
from roughslip.compilation.cache import compiled
from roughslip.contact.blocks import block_edges
from roughslip.contact.convolution import (
    NarrowConvolution,
    convolution,
    embedding_symbol,
    fast_length,
    rough_convolution,
)
from roughslip.contact.periodic import periodic_symbol
from roughslip.errors import ParameterError, real
from roughslip.grid import Grid
from roughslip.validation import gate, positive

# Cells on either side of the centre of the patch behind `approximate_inverse`, which has 5 x 5 cells. Convolutions of
# the iterative solver on 24 rough surfaces, relative to those without any approximate inverse: 0.59 with 3 x 3 cells,
# 0.56 with 5 x 5, 0.55 with 7 x 7, and 0.88 with the inverse of the whole symbol, which needs a second one a step.
PATCH_RADIUS = 2

# Errors of a product over its size: in single precision, and on a strip with distant forces summed in blocks.
ROUNDED, ROUGH = 1e-6, 5e-3

# Up to so many loaded nodes their sum costs less than a convolution; they break even at 64 (240 x 10) to 190 (64 x 64).
DIRECT_SUM_LIMIT = 64


@gate
@dataclass(frozen=True)
class Material:
    """An isotropic, linearly elastic material.

    young_modulus_pa : Young's modulus E [Pa], positive
    poisson_ratio : Poisson's ratio nu, in (-1, 0.5]

    Raises ParameterError outside these ranges.
    """

    young_modulus_pa: float
    poisson_ratio: float

    def __post_init__(self) -> None:
        positive("young_modulus_pa", self.young_modulus_pa, "Pa")
        if not -1 < real("poisson_ratio", self.poisson_ratio) <= 0.5:
            raise ParameterError(f"poisson_ratio must lie in (-1, 0.5], not {self.poisson_ratio}")

    @property
    def plane_strain_modulus_pa(self) -> float:
        """Plane-strain modulus E* = E / (1 - nu^2) [Pa] of contact with a rigid body."""
        return self.young_modulus_pa / (1 - self.poisson_ratio**2)


def love_coefficients(grid: Grid, plane_strain_modulus_pa: float) -> np.ndarray:
    """Displacement at the offset (i dx, j dy) from a cell under unit pressure.

    grid : the mesh
    plane_strain_modulus_pa : E* = E / (1 - nu^2) [Pa]

    Returns (nx, ny) [m/Pa] = 1/(pi E*) times the integral of 1/r over the cell, to a few units in the last place. On
    long cells the nearest coefficients lose about the square of the aspect ratio in accuracy. Raises ParameterError
    for a modulus that is not positive and finite.

    Method: Love, Phil. Trans. R. Soc. A 228 (1929) 377. The integral is a sum over the four edges. An edge contributes
    its distance times int ds / r = 2 artanh(length / sum of the distances to its ends), Love's logarithms in pairs.
    """
    positive("plane_strain_modulus_pa", plane_strain_modulus_pa, "Pa")
    x = (np.arange(grid.nx) * grid.dx)[:, None]
    y = (np.arange(grid.ny) * grid.dy)[None, :]
    across_x = _opposite_edges(x, y, grid.dx, grid.dy)
    across_y = _opposite_edges(y, x, grid.dy, grid.dx)
    return (across_x + across_y) / (math.pi * plane_strain_modulus_pa)


def _opposite_edges(x: np.ndarray, y: np.ndarray, dx: float, dy: float) -> np.ndarray:
    """The two edges at x' = -dx/2 and dx/2, each of length dy, of a cell seen from (x, y) >= 0.

    With a = dx/2, (x + a) T_far - (x - a) T_near is computed as a (T_far + T_near) - x (T_near - T_far).
    The difference of the artanh is written as one artanh. Far away the plain form would lose a factor x/dx
    of the accuracy. The sum over the four corners would lose r^2 / (dx dy).
    """
    a, b = dx / 2, dy / 2
    far = np.hypot(x + a, y + b), np.hypot(x + a, y - b)
    near = np.hypot(x - a, y + b), np.hypot(x - a, y - b)
    far_sum, near_sum = far[0] + far[1], near[0] + near[1]
    excess = 4 * a * x * (1 / (far[0] + near[0]) + 1 / (far[1] + near[1]))  # far_sum - near_sum
    difference = np.arctanh(dy * excess / (far_sum * near_sum - dy**2))
    return 2 * (a * (np.arctanh(dy / far_sum) + np.arctanh(dy / near_sum)) - x * difference)


@gate
class Influence:
    """The influence matrix B of a mesh. It never changes; its working arrays allow one thread per instance.

    grid : the mesh
    periodic : whether the mesh is one cell of a periodic surface; the free half-space otherwise
    modulus : E* [Pa]
    coefficients : (nx, ny) [m/Pa] B by the offset of two nodes, along and across
    diagonal : B_00 [m/Pa], the displacement of a cell under its own unit pressure
    mirrored : (nx, 2 ny - 1) [m/Pa] the same by offsets of either sign across
    approximate_inverse : (5, 5) [Pa/m] the pressures on a patch of cells that lift its centre by one metre and no other
        cell. B^-1 decays as 1/r^3, so these 25 values are most of it. For all aspect ratios tried, the values off the
        centre are negative and the stencil is diagonally dominant, hence positive definite on any set of nodes.

    Raises ParameterError for a modulus that is not positive and finite, and for a periodic cell of one node.
    """

    def __init__(self, grid: Grid, plane_strain_modulus_pa: float, periodic: bool = False) -> None:
        real("plane_strain_modulus_pa", plane_strain_modulus_pa)
        if periodic and grid.size == 1:
            raise ParameterError("a periodic cell of one node is a rigid flat: it needs two nodes at least")
        self.periodic = periodic
        self.modulus = plane_strain_modulus_pa
        self.approximate_inverse = _lifting_pressures(grid, plane_strain_modulus_pa)
        if periodic:
            torus, symbol = grid.shape, periodic_symbol(grid, plane_strain_modulus_pa)
            coefficients = fft.c2r(symbol + 0j, axes=(0, 1), lastsize=grid.ny, forward=False, inorm=2)
        else:
            torus = (fast_length(2 * grid.nx - 1), fast_length(2 * grid.ny - 1))
            coefficients = love_coefficients(grid, plane_strain_modulus_pa)
            symbol = embedding_symbol(coefficients, torus)
        self.grid, self.coefficients = grid, coefficients
        self.diagonal = float(coefficients[0, 0])
        self._convolution = convolution(symbol, grid.shape, torus)
        self._rounded_convolution = convolution(symbol, grid.shape, torus, np.float32)
        self.mirrored = np.hstack((coefficients[:, :0:-1], coefficients))
        for array in (coefficients, self.approximate_inverse, self.mirrored):
            array.setflags(write=False)

    @cached_property
    def rough_convolution(self) -> NarrowConvolution | None:
        """The product without detail afar; None where it would not be the faster."""
        return None if self.periodic else rough_convolution(self.coefficients)

    @cached_property
    def coarser(self) -> Influence:
        """B on cells of twice the edge. An axis with a single node, or with cells twice as long, keeps its cells."""
        g = self.grid
        halve_x = g.nx > 1 and (g.ny == 1 or g.dx < 2 * g.dy)
        halve_y = g.ny > 1 and (g.nx == 1 or g.dy < 2 * g.dx)
        nx, dx = ((g.nx + 1) // 2, 2 * g.dx) if halve_x else (g.nx, g.dx)
        ny, dy = ((g.ny + 1) // 2, 2 * g.dy) if halve_y else (g.ny, g.dy)
        return Influence(Grid(nx, ny, dx, dy), self.modulus, self.periodic)

    @cached_property
    def between_blocks(self) -> np.ndarray:
        """(2 m - 1,) [m/Pa] displacement of a block under a unit sum of pressures on one at an offset from 1 - m on."""
        g, (along, edges) = self.grid, block_edges(self.grid)
        if edges.size == 2:
            return np.zeros(1)
        nx, ny = (edges.size - 1, 1) if along else (1, edges.size - 1)
        blocks = Influence(Grid(nx, ny, g.nx * g.dx / nx, g.ny * g.dy / ny), self.modulus, self.periodic)
        of_offset = blocks.coefficients.ravel() * (nx * ny / g.size)
        return np.concatenate((of_offset[:0:-1], of_offset))

    def apply(self, pressure: np.ndarray, result: np.ndarray | None = None, error: float = 0.0) -> np.ndarray:
        """Displacement u = B p.

        pressure : (nx, ny) [Pa]
        result : (nx, ny) array to write to, of the precision of the pressure; a new one of doubles if not given
        error : [-] relative, that is allowed; from ROUNDED on in single precision, from ROUGH on without detail afar

        Returns (nx, ny) [m], by direct summation when few nodes are loaded, else by a convolution.
        Raises ParameterError for a wrong shape.
        """
        if pressure.shape != self.grid.shape:
            raise ParameterError(f"pressures have the shape {pressure.shape}, the mesh has {self.grid.shape}")
        pressure = np.ascontiguousarray(pressure)
        result = np.empty(pressure.shape) if result is None else result
        if not _few_summed(self.mirrored, pressure, result):
            whole = self._rounded_convolution if error >= ROUNDED else self._convolution
            rough = self.rough_convolution if error >= ROUGH else None
            (whole if rough is None else rough)(pressure, result)
        return result


def _lifting_pressures(grid: Grid, plane_strain_modulus_pa: float) -> np.ndarray:
    """The pressures on a patch of cells that lift its centre by one metre and no other cell of the patch."""
    width = 2 * PATCH_RADIUS + 1
    patch = Grid(width, width, grid.dx, grid.dy)
    i, j = np.divmod(np.arange(patch.size), width)
    lift = (np.arange(patch.size) == patch.size // 2).astype(np.float64)
    matrix = gathered(love_coefficients(patch, plane_strain_modulus_pa), i, j)
    return np.linalg.solve(matrix, lift).reshape(patch.shape)


@compiled()
def _few_summed(mirrored: np.ndarray, pressure: np.ndarray, displacement: np.ndarray) -> bool:
    """Write B p where at most DIRECT_SUM_LIMIT nodes are loaded, and whether they are."""
    nx, ny = pressure.shape
    nodes, count = np.empty(DIRECT_SUM_LIMIT, dtype=np.int64), 0
    for i in range(nx):
        for j in range(ny):
            if pressure[i, j] != 0:
                if count == DIRECT_SUM_LIMIT:
                    return False
                nodes[count] = i * ny + j
                count += 1
    direct_sum(mirrored, nodes[:count], pressure, displacement)
    return True


@compiled()
def direct_sum(mirrored: np.ndarray, loaded: np.ndarray, pressure: np.ndarray, displacement: np.ndarray) -> None:
    """Write B p, from the pressures of the loaded nodes, numbered along the rows."""
    nx, ny = pressure.shape
    displacement[:] = 0.0
    for node in loaded:
        k, m = divmod(node, ny)
        load = pressure[k, m]
        for i in range(nx):
            row = displacement[i]
            influence = mirrored[abs(i - k), ny - 1 - m : 2 * ny - 1 - m]
            for j in range(ny):
                row[j] += influence[j] * load


@compiled()
def gathered(coefficients: np.ndarray, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """B between the nodes (i_k, j_k) : (n, n) [m/Pa], symmetric, from the coefficients by offset.

    i, j : (n,) positions of the nodes along and across; not checked
    """
    n = i.size
    matrix = np.empty((n, n))
    for row in range(n):
        for column in range(row + 1):
            value = coefficients[abs(i[row] - i[column]), abs(j[row] - j[column])]
            matrix[row, column] = value
            matrix[column, row] = value
    return matrix


def column_influence(influence: Influence, spacing: int, reach: int) -> np.ndarray:
    """Mean displacement across a strip under a force distributed evenly across another column.

    influence : B of the strip
    spacing : columns of the mesh from one selected column to the next
    reach : number of selected columns, from the loaded one on, that are local and get K = 0; at least 1

    Returns K : (ceil(nx / spacing),) [m/N] by the distance in selected columns. Raises ParameterError for a spacing or
    a reach below 1.
    """
    if spacing < 1 or reach < 1:
        raise ParameterError(f"columns {spacing} apart and a reach of {reach}: both must be at least 1")
    rows = influence.grid.ny
    pairs = np.where(np.arange(rows) > 0, 2.0, 1.0) * (rows - np.arange(rows))  # of rows so far apart
    kernel = influence.coefficients[::spacing] @ pairs / (rows**2 * influence.grid.cell_area)
    kernel[:reach] = 0.0
    return kernel


def displacement(kernel: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Displacement along a strip under forces on its columns, without load outside.

    kernel : (at least n,) [m/N] K
    force : (..., n) [N]

    Returns u : (..., n) [m]. Raises ParameterError for a kernel of fewer columns.
    """
    n = force.shape[-1]
    if len(kernel) < n:
        raise ParameterError(f"an influence over {len(kernel)} columns does not reach along {n}")
    around = np.concatenate([kernel[:n], [0.0], kernel[n - 1 : 0 : -1]])
    spectrum = np.fft.rfft(around) * np.fft.rfft(force, 2 * n)
    return np.asarray(np.fft.irfft(spectrum, 2 * n)[..., :n])


def at_displaced_planes(values: np.ndarray, planes: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Quantities along a strip at displaced planes, linear between the known heights of the plane.

    values : (..., levels, n) not negative, at the known heights of the plane
    planes : (levels,) [m] these heights, in descending order
    moved : (levels, n) [m] rise of the plane of each level at each column

    Returns (..., levels, n), constant above the highest plane, extrapolated below the lowest, never negative. With a
    single plane the values are returned unchanged. Raises ParameterError for planes that do not descend.
    """
    levels = len(planes)
    if not np.all(np.diff(planes) < 0):
        raise ParameterError("planes must be given from the highest to the lowest")
    if levels == 1:
        return values
    displaced = np.empty_like(values)
    _between_planes(values.reshape(-1, levels, values.shape[-1]), planes, moved, displaced.reshape(-1, *moved.shape))
    return displaced


@compiled()
def _between_planes(values: np.ndarray, planes: np.ndarray, moved: np.ndarray, displaced: np.ndarray) -> None:
    for level in range(len(planes)):
        lower = max(level, 1)
        for k in range(moved.shape[1]):
            height = planes[level] + moved[level, k]
            while lower > 1 and planes[lower - 1] < height:
                lower -= 1
            while lower < len(planes) - 1 and planes[lower] >= height:
                lower += 1
            share = max((planes[lower - 1] - height) / (planes[lower - 1] - planes[lower]), 0.0)
            for q in range(len(values)):
                between = (1 - share) * values[q, lower - 1, k] + share * values[q, lower, k]
                displaced[q, level, k] = max(between, 0.0)
