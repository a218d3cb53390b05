"""Products with matrices whose entries depend on the offset of two nodes only, by fast Fourier transforms."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from roughslip import fft
from roughslip.compilation.cache import compiled

# A spectrum of more than MOST_COLUMNS columns is transformed in parts of about PART columns, which stay in the cache.
# That saves a third of the time at 2048 x 2048 nodes, a quarter at 1024 x 1024, and nothing from 512 x 512 down.
MOST_COLUMNS = 600
PART = 64

# Meshes of up to NARROW columns are transformed along their length only, and summed across. Products with 10, 20 and 32
# columns then take 0.45, 0.5 and 0.8 times as long, with 64 columns 1.5 times.
NARROW = 24

# Wave numbers that are summed across at a time, real and imaginary parts, so that their data stay in the nearest cache.
BLOCK = 128

# Rows of a mesh that are transposed at a time.
TILE = 32


def convolution(
    symbol: np.ndarray, shape: tuple[int, int], torus: tuple[int, int], precision: type = np.float64
) -> Convolution | NarrowConvolution:
    """The faster of the two methods for a mesh. They differ by rounding; arguments as of Convolution."""
    return (NarrowConvolution if shape[1] <= NARROW else Convolution)(symbol, shape, torus, precision)


class Convolution:
    """u = B p on a mesh of nx by ny nodes, B even in both offsets.

    symbol : (m, n // 2 + 1) eigenvalues of the circulant matrix that contains B, on a torus of m by n nodes, in the
        layout of numpy.fft.rfft2
    shape : (nx, ny)
    torus : (m, n), at least (nx, ny)
    precision : float64 or float32, of the transforms; fields have any, and the unit of B does not matter

    Rows of the torus outside the mesh are zero before the product and not needed after it, so they are not transformed
    along the second axis. An instance has its own working arrays and serves one thread.
    """

    def __init__(self, symbol: np.ndarray, shape: tuple[int, int], torus: tuple[int, int], precision: type) -> None:
        self.shape, self.torus = shape, torus
        columns = torus[1] // 2 + 1
        self._unit = float(symbol.max())
        scaled = symbol[: torus[0] // 2 + 1] / (torus[0] * torus[1] * self._unit)  # the other rows mirror these
        half: np.ndarray = scaled.astype(precision)
        complex_precision = np.result_type(precision, np.complex64)
        self._rows: np.ndarray = np.zeros((shape[0], torus[1]), precision)
        edges = np.linspace(0, columns, columns // PART + 1 if columns > MOST_COLUMNS else 2).astype(int)
        buffer = np.empty(torus[0] * int(np.diff(edges).max()), complex_precision)
        self._parts = []
        for first, end in pairwise(edges):
            twice = np.repeat(half[:, first:end], 2, axis=1)  # for real and imaginary part
            block = buffer[: torus[0] * (end - first)].reshape(torus[0], -1)
            self._parts.append((slice(first, end), twice, block))
        whole = len(self._parts) == 1
        self._spectrum = block[: shape[0]] if whole else np.empty((shape[0], columns), complex_precision)

    def __call__(self, field: np.ndarray, result: np.ndarray) -> None:
        """Write B applied to a field (nx, ny) into the result (nx, ny)."""
        (nx, ny), n = self.shape, self.torus[1]
        if self.shape == self.torus and len(self._parts) == 1:  # a period: nothing is padded
            np.copyto(self._rows, field)
            fft.r2c(self._rows, axes=(0, 1), out=self._spectrum)
            _multiply(self._spectrum.view(self._rows.dtype), self._parts[0][1])
            fft.c2r(self._spectrum, axes=(0, 1), lastsize=n, forward=False, out=self._rows)
            np.multiply(self._rows, self._unit, out=result, dtype=result.dtype)
            return
        self._rows[:, :ny], self._rows[:, ny:] = field, 0.0
        fft.r2c(self._rows, axes=(1,), out=self._spectrum)
        for part, symbol, block in self._parts:
            if len(self._parts) > 1:
                block[:nx] = self._spectrum[:, part]
            block[nx:] = 0.0
            fft.c2c(block, axes=(0,), out=block)
            _multiply(block.view(self._rows.dtype), symbol)
            fft.c2c(block, axes=(0,), forward=False, out=block)
            if len(self._parts) > 1:
                self._spectrum[:, part] = block[:nx]
        fft.c2r(self._spectrum, axes=(1,), lastsize=n, forward=False, out=self._rows)
        np.multiply(self._rows[:, :ny], self._unit, out=result, dtype=result.dtype)


class NarrowConvolution:
    """The same product on a mesh of few columns, by transforms along it and sums across.

    Transformed along the first axis, B is a symmetric Toeplitz matrix t_|a-b| for every wave number. Let
    a' = ny - 1 - a. On the even part p_a + p_a' of a field, B acts as t_|a-b| + t_(a'-b). On the odd part p_a - p_a',
    B acts as t_|a-b| - t_(a'-b). This takes ny^2 / 2 products per wave number. No transforms across a torus of twice
    the columns are needed.
    """

    def __init__(self, symbol: np.ndarray, shape: tuple[int, int], torus: tuple[int, int], precision: type) -> None:
        self.shape, self.torus = shape, torus
        waves = torus[0] // 2 + 1
        self._unit = float(symbol.max())
        scaled = symbol[:waves] / (torus[0] * torus[1] * self._unit)
        across = fft.c2r(scaled + 0j, axes=(1,), lastsize=torus[1], forward=False)
        self._toeplitz: np.ndarray = np.repeat(across[:, : shape[1]].T, 2, axis=1).astype(
            precision
        )  # real and imaginary part
        self._columns: np.ndarray = np.zeros((shape[1], torus[0]), precision)
        self._spectrum = np.empty((shape[1], waves), np.result_type(precision, np.complex64))

    def __call__(self, field: np.ndarray, result: np.ndarray) -> None:
        """Write B applied to a field (nx, ny) into the result (nx, ny)."""
        _fold(field, self._columns)
        fft.r2c(self._columns, axes=(1,), out=self._spectrum)
        _sum_across(self._toeplitz, self._spectrum.view(self._columns.dtype))
        fft.c2r(self._spectrum, axes=(1,), lastsize=self.torus[0], forward=False, out=self._columns)
        _unfold(self._columns, self._unit, result)


def fast_length(nodes: int) -> int:
    """The smallest length of at least `nodes` whose transform is fast."""
    return int(fft.good_size(nodes, True))


@compiled()
def _multiply(spectrum: np.ndarray, symbol: np.ndarray) -> None:
    """Multiply rows k and -k of the spectrum by row k of the symbol."""
    rows, columns = spectrum.shape
    for i in range(rows):
        k = min(i, rows - i)
        for j in range(columns):
            spectrum[i, j] *= symbol[k, j]


@compiled()
def _fold(field: np.ndarray, columns: np.ndarray) -> None:
    """Write the even and odd parts of the field, one column after the other, followed by zeros."""
    nx, ny = field.shape
    half = ny // 2
    columns[:, nx:] = 0.0
    for first in range(0, nx, TILE):
        end = min(first + TILE, nx)
        for a in range(half):
            for i in range(first, end):
                columns[a, i] = field[i, a] + field[i, ny - 1 - a]
                columns[ny - 1 - a, i] = field[i, a] - field[i, ny - 1 - a]
        if ny % 2:
            for i in range(first, end):
                columns[half, i] = field[i, half]


@compiled()
def _unfold(columns: np.ndarray, unit: float, field: np.ndarray) -> None:
    """Write the field that has these even and odd parts, in a unit."""
    nx, ny = field.shape
    half, mean = ny // 2, unit / 2
    for first in range(0, nx, TILE):
        end = min(first + TILE, nx)
        for a in range(half):
            for i in range(first, end):
                field[i, a] = (columns[a, i] + columns[ny - 1 - a, i]) * mean
                field[i, ny - 1 - a] = (columns[a, i] - columns[ny - 1 - a, i]) * mean
        if ny % 2:
            for i in range(first, end):
                field[i, half] = columns[half, i] * unit


@compiled()
def _sum_across(toeplitz: np.ndarray, spectrum: np.ndarray) -> None:
    """Apply the Toeplitz matrix of every wave number to even and odd parts.

    The middle column of an odd number of columns is an even part that counts once. Each loop has one sum, because the
    compiler vectorises no others.
    """
    ny, length = spectrum.shape
    half = ny // 2
    sums = np.empty((ny, BLOCK), spectrum.dtype)
    for first in range(0, length, BLOCK):
        end = min(first + BLOCK, length)
        width = end - first
        sums[:] = 0
        for a in range(half):
            even, odd = sums[a], sums[ny - 1 - a]
            for b in range(half):
                near, far = toeplitz[abs(a - b), first:end], toeplitz[ny - 1 - a - b, first:end]
                even_part, odd_part = spectrum[b, first:end], spectrum[ny - 1 - b, first:end]
                for k in range(width):
                    even[k] += (near[k] + far[k]) * even_part[k]
                for k in range(width):
                    odd[k] += (near[k] - far[k]) * odd_part[k]
        if ny % 2:
            middle, middle_part = sums[half], spectrum[half, first:end]
            for a in range(half):
                between, even, even_part = toeplitz[half - a, first:end], sums[a], spectrum[a, first:end]
                for k in range(width):
                    even[k] += (between[k] + between[k]) * middle_part[k]
                for k in range(width):
                    middle[k] += between[k] * even_part[k]
            itself = toeplitz[0, first:end]
            for k in range(width):
                middle[k] += itself[k] * middle_part[k]
        for a in range(ny):
            for k in range(width):
                spectrum[a, first + k] = sums[a, k]
