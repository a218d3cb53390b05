"""Products with matrices that depend on the offset of two nodes alone, by transforms without the needless parts."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from ducc0 import fft
from numba import njit

# A spectrum of more columns is transformed in parts of about so many, which stay in the cache: a third of the time less
# at 2048 x 2048 nodes, a quarter at 1024 x 1024. From 512 x 512 down it gains nothing.
MOST_COLUMNS = 600
PART = 64


class Convolution:
    """u = B p on a mesh of nx by ny nodes, B even in both offsets.

    symbol : (m, n // 2 + 1) eigenvalues of the circulant matrix on a torus of m by n nodes that holds B, in the layout
        of numpy.fft.rfft2
    shape : (nx, ny)
    torus : (m, n), at least (nx, ny)

    Rows of the torus beyond the mesh are zero before the product and not wanted after it: they are not transformed
    along the second axis. Holds its own scratch, so that one instance serves one thread.
    """

    def __init__(self, symbol: np.ndarray, shape: tuple[int, int], torus: tuple[int, int]) -> None:
        self.shape, self.torus = shape, torus
        columns = torus[1] // 2 + 1
        half = symbol[: torus[0] // 2 + 1] / (torus[0] * torus[1])  # the other rows mirror these
        self._rows = np.zeros((shape[0], torus[1]))
        edges = np.linspace(0, columns, columns // PART + 1 if columns > MOST_COLUMNS else 2).astype(int)
        buffer = np.empty(torus[0] * int(np.diff(edges).max()), dtype=np.complex128)
        self._parts = []
        for first, end in pairwise(edges):
            twice = np.repeat(half[:, first:end], 2, axis=1)  # for real and imaginary part
            block = buffer[: torus[0] * (end - first)].reshape(torus[0], -1)
            self._parts.append((slice(first, end), twice, block))
        whole = len(self._parts) == 1
        self._spectrum = block[: shape[0]] if whole else np.empty((shape[0], columns), dtype=np.complex128)

    def __call__(self, field: np.ndarray, result: np.ndarray) -> None:
        """Writes B applied to a field (nx, ny) into the result (nx, ny)."""
        (nx, ny), n = self.shape, self.torus[1]
        _padded(field, self._rows)
        fft.r2c(self._rows, axes=(1,), out=self._spectrum)
        for part, symbol, block in self._parts:
            if len(self._parts) > 1:
                block[:nx] = self._spectrum[:, part]
            block[nx:] = 0.0
            fft.c2c(block, axes=(0,), out=block)
            _multiply(block.view(np.float64), symbol)
            fft.c2c(block, axes=(0,), forward=False, out=block)
            if len(self._parts) > 1:
                self._spectrum[:, part] = block[:nx]
        fft.c2r(self._spectrum, axes=(1,), lastsize=n, forward=False, out=self._rows)
        result[:] = self._rows[:, :ny]


def fast_length(nodes: int) -> int:
    """The least length from `nodes` on whose transform is fast."""
    return int(fft.good_size(nodes, True))


@njit(cache=True)
def _padded(field: np.ndarray, rows: np.ndarray) -> None:
    """Writes the field, followed by zeros, into the rows."""
    nx, ny = field.shape
    for i in range(nx):
        rows[i, :ny] = field[i]
        rows[i, ny:] = 0.0


@njit(cache=True)
def _multiply(spectrum: np.ndarray, symbol: np.ndarray) -> None:
    """Rows k and -k of the spectrum times row k of the symbol."""
    rows, columns = spectrum.shape
    for i in range(rows):
        k = min(i, rows - i)
        for j in range(columns):
            spectrum[i, j] *= symbol[k, j]
