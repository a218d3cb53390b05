"""Long waves of pressure along a periodic belt: blocks of the belt, each as long as wide, that exchange their forces.

The stencil M holds for waves of a few cells. B grows with the wavelength, so along a belt of 24 widths M takes waves up
to 24 times too strongly, which doubles or triples the iterations. Let W put a constant on the free nodes of each block,
and let P take the mean over these off a block. In place of M r then stands

    s = P M P r + W C W' r.

C^-1 is W' B W with the same share f of free nodes in each of the m nodes of a block: f^2 m Lambda(q) for the waves of
the blocks, and f m times the displacement of a contact by its own share. It is one row of a circulant matrix, so the
plane is its longest wave. Where the shares of blocks differ much it would take more iterations, or thousands: M r
stands alone there, and no block is shorter than the width.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import circulant

from roughslip.compilation.cache import compiled
from roughslip.contact.influence import Influence

# Displacement of the contacts of a block under a unit mean pressure in contact, over B_00. From 1 to 8 solves of belts
# take as many products.
LOCAL = 2.0

# Free nodes of a block, over the mean of the blocks, from which on the blocks exchange their forces.
LEAST_SHARE = 0.5


def block_edges(influence: Influence) -> tuple[np.ndarray, np.ndarray]:
    """First nodes of the blocks along and across, and the ends; a cell that is no belt, or not periodic, is one block.

    The longer axis has as many blocks as it has widths, of eight nodes at least.
    """
    grid = influence.grid
    aspect = grid.nx * grid.dx / (grid.ny * grid.dy) if influence.periodic else 1.0
    counts = (max(1, min(round(aspect), grid.nx // 8)), max(1, min(round(1 / aspect), grid.ny // 8)))
    along, across = (np.linspace(0, n, k + 1).astype(np.int64) for n, k in zip(grid.shape, counts, strict=True))
    return along, across


def exchange(influence: Influence, blocks: int, share: float) -> np.ndarray:
    """C (blocks, blocks) [Pa/m] between blocks in a row, of whose nodes a share is free."""
    if blocks == 1:
        return np.zeros((1, 1))
    grid = influence.grid
    waves = 2 * np.pi * np.fft.rfftfreq(blocks, max(grid.nx * grid.dx, grid.ny * grid.dy) / blocks)[1:]
    displacement = share**2 * 2 / (influence.modulus * waves) + share * LOCAL * influence.diagonal
    stiffness = np.concatenate(([0.0], blocks / (grid.size * displacement)))
    return np.asarray(circulant(np.fft.irfft(stiffness, blocks)))


@compiled()
def block_sums(
    field: np.ndarray, free: np.ndarray, along: np.ndarray, across: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Sums of a field, which is zero off the free nodes, and numbers of these (blocks,), at least one."""
    k, m = along.size - 1, across.size - 1
    sums, counts = np.zeros((k, m)), np.zeros((k, m))
    column, number = np.empty(field.shape[1]), np.empty(field.shape[1])
    for block in range(k):
        column[:] = 0.0
        number[:] = 0.0
        for i in range(along[block], along[block + 1]):
            row, moves = field[i], free[i]
            for j in range(row.size):
                column[j] += row[j]
                number[j] += moves[j]
        for beside in range(m):
            sums[block, beside] = column[across[beside] : across[beside + 1]].sum()
            counts[block, beside] = max(number[across[beside] : across[beside + 1]].sum(), 1.0)
    return sums.reshape(-1), counts.reshape(-1)


@compiled()
def add_to_blocks(
    field: np.ndarray,
    values: np.ndarray,
    free: np.ndarray,
    along: np.ndarray,
    across: np.ndarray,
    result: np.ndarray,
) -> None:
    """result <- field + the value (blocks,) of its block at the free nodes; the field elsewhere."""
    m = across.size - 1
    added = np.empty(field.shape[1], field.dtype)
    for block in range(along.size - 1):
        for beside in range(m):
            added[across[beside] : across[beside + 1]] = values[block * m + beside]
        for i in range(along[block], along[block + 1]):
            row, moves, out = field[i], free[i], result[i]
            for j in range(row.size):
                out[j] = row[j] + added[j] * moves[j]
