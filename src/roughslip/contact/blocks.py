"""Long waves of pressure along a strip or a belt: blocks that are as long as wide exchange their forces.

The stencil M of conjugate gradients holds for waves of a few cells. B grows with the wavelength, so M takes long waves
too strongly. Let g be the means of the misfit r over the free nodes of each block, P what takes means off, and W what
puts a constant on the free nodes of each block. In place of M r stands

    s = P M P r + W y,    (K + D) z = g,    z = n y.

z are sums of pressures, and n the numbers of free nodes. K z is the displacement of a block under forces that are even
over the others, by the influence matrix of a mesh of blocks. D z is what the contacts of a block displace themselves
by, LOCAL B_00 z / n. Both are positive definite. Conjugate gradients preconditioned by D solve for z, roughly: the
directions of the outer iteration stay conjugate to the last step with any s.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.grid import Grid

# Displacement of the contacts of a block, each over that of its own pressure. Of 0.3 to 2, values near 1 take the
# fewest products on strips of 10 and 20 nodes across, 2 a fifth more on the first.
LOCAL = 1.0

# Share of its first misfit at which the exchange is solved. With 0.3 solves take 1 to 5 % more products, with 0.03 as
# many.
ROUGHLY = 0.1


@cache
def block_edges(grid: Grid) -> tuple[bool, np.ndarray]:
    """Whether the longer axis is the first, and the first nodes of its blocks, with the end.

    It has as many blocks as widths, of eight nodes at least.
    """
    lengths = grid.nx * grid.dx, grid.ny * grid.dy
    along = lengths[0] >= lengths[1]
    nodes = grid.nx if along else grid.ny
    count = max(1, min(round(max(lengths) / min(lengths)), nodes // 8))
    return along, np.linspace(0, nodes, count + 1).astype(np.int64)


@compiled()
def exchanged(
    between: np.ndarray, means: np.ndarray, numbers: np.ndarray, local: float, of_zero_sum: bool
) -> np.ndarray:
    """y (m,) [Pa] on the free nodes of each block; zero where there are none.

    between : (2 m - 1,) [m/Pa] K by the offset of two blocks, from 1 - m on
    means : (m,) [m] g
    numbers : (m,) n
    local : LOCAL B_00 [m/Pa]
    of_zero_sum : whether n y has no sum
    """
    m = means.size
    y, misfit, direction, toward, product = np.zeros(m), means.copy(), np.zeros(m), np.zeros(m), np.zeros(m)
    first = before = 0.0
    for _ in range(m):
        mean = (numbers * misfit).sum() / max(numbers.sum(), 1.0) if of_zero_sum else 0.0
        square = 0.0
        for k in range(m):
            toward[k] = numbers[k] * (misfit[k] - mean) / local
            square += toward[k] * misfit[k]
        first = max(first, square)
        if not square > ROUGHLY**2 * first:
            break
        curvature, beta, before = 0.0, square / before if before > 0 else 0.0, square
        for k in range(m):
            direction[k] = toward[k] + beta * direction[k]
            product[k] = local / numbers[k] * direction[k] if numbers[k] > 0 else 0.0
        for k in range(m):
            row, force = between[m - 1 - k : 2 * m - 1 - k], direction[k]
            for j in range(m):
                product[j] += row[j] * force
        for k in range(m):
            curvature += direction[k] * product[k]
        for k in range(m):
            y[k] += square / curvature * direction[k]
            misfit[k] -= square / curvature * product[k]
    for k in range(m):
        y[k] /= max(numbers[k], 1.0)
    return y


@compiled(fastmath={"reassoc"})
def block_means(field: np.ndarray, free: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means (m,) of a field over the free nodes, off which it is zero, and their numbers (m,), of blocks of columns."""
    means, numbers = np.zeros(edges.size - 1), np.zeros(edges.size - 1)
    zero, one = field.dtype.type(0.0), field.dtype.type(1.0)
    for block in range(edges.size - 1):
        first, end = edges[block], edges[block + 1]
        for i in range(field.shape[0]):
            row, moves, total, number = field[i, first:end], free[i, first:end], zero, zero
            for j in range(row.size):
                total += row[j]
                number += one if moves[j] else zero
            means[block] += total
            numbers[block] += number
        means[block] /= max(numbers[block], 1.0)
    return means, numbers


@compiled()
def less_of_blocks(
    field: np.ndarray, values: np.ndarray, free: np.ndarray, edges: np.ndarray, result: np.ndarray
) -> None:
    """result <- field less the value (m,) of its block of columns at the free nodes; the field elsewhere."""
    zero = field.dtype.type(0.0)
    for block in range(edges.size - 1):
        value, first, end = field.dtype.type(values[block]), edges[block], edges[block + 1]
        for i in range(field.shape[0]):
            row, moves, out = field[i, first:end], free[i, first:end], result[i, first:end]
            for j in range(row.size):
                out[j] = row[j] - (value if moves[j] else zero)
