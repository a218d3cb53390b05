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

# Blocks of distant forces along a strip. The torus of a rough product is longer than the strip by ten of them, so that
# forces that wrap around it are so far away.
DISTANT, NEAREST = 160, 10


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
        self._parts: list[tuple[slice, np.ndarray, np.ndarray, np.ndarray]] = []
        for first, end in pairwise(edges):
            twice = np.repeat(half[:, first:end], 2, axis=1)  # for real and imaginary part
            block = buffer[: torus[0] * (end - first)].reshape(torus[0], -1)
            self._parts.append((slice(first, end), twice, block, block.view(precision)))
        whole = len(self._parts) == 1
        self._spectrum = block[: shape[0]] if whole else np.empty((shape[0], columns), complex_precision)
        self._inside, self._outside = self._rows[:, : shape[1]], self._rows[:, shape[1] :]
        self._lift: np.ndarray = np.zeros(shape[0], precision)  # none

    def __call__(self, field: np.ndarray, result: np.ndarray) -> None:
        """Write B applied to a field (nx, ny) into the result (nx, ny)."""
        nx, n = self.shape[0], self.torus[1]
        self._inside[:] = field
        if self.shape == self.torus and len(self._parts) == 1:  # a period: nothing is padded
            fft.r2c(self._rows, axes=(0, 1), out=self._spectrum)
            _multiply(self._parts[0][3], self._parts[0][1])
            fft.c2r(self._spectrum, axes=(0, 1), lastsize=n, forward=False, out=self._rows)
        else:
            self._outside[:] = 0.0
            fft.r2c(self._rows, axes=(1,), out=self._spectrum)
            for part, symbol, block, numbers in self._parts:
                if len(self._parts) > 1:
                    block[:nx] = self._spectrum[:, part]
                block[nx:] = 0.0
                fft.c2c(block, axes=(0,), out=block)
                _multiply(numbers, symbol)
                fft.c2c(block, axes=(0,), forward=False, out=block)
                if len(self._parts) > 1:
                    self._spectrum[:, part] = block[:nx]
            fft.c2r(self._spectrum, axes=(1,), lastsize=n, forward=False, out=self._rows)
        _lifted(self._rows, self._unit, self._lift, result)


class NarrowConvolution:
    """The same product on a mesh of few columns, by transforms along it and sums across.

    Transformed along the first axis, B is a symmetric Toeplitz matrix t_|a-b| for every wave number. Let
    a' = ny - 1 - a. On the even part p_a + p_a' of a field, B acts as t_|a-b| + t_(a'-b). On the odd part p_a - p_a',
    B acts as t_|a-b| - t_(a'-b). This takes ny^2 / 2 products per wave number. No transforms across a torus of twice
    the columns are needed.

    far : (2 m - 1,) [unit of B] what the mean over columns of B lacks on the torus, by offset in m blocks of rows
    span : rows of such a block
    """

    def __init__(
        self,
        symbol: np.ndarray,
        shape: tuple[int, int],
        torus: tuple[int, int],
        precision: type,
        far: np.ndarray | None = None,
        span: int = 1,
    ) -> None:
        self.shape, self.torus, self._far, self._span = shape, torus, far, span
        waves = torus[0] // 2 + 1
        self._unit = float(symbol.max())
        scaled = symbol[:waves] / (torus[0] * torus[1] * self._unit)
        across = fft.c2r(scaled + 0j, axes=(1,), lastsize=torus[1], forward=False)
        self._toeplitz: np.ndarray = np.ascontiguousarray(across[:, : shape[1]].T, precision)
        self._torus: np.ndarray = np.zeros((torus[0], shape[1]), precision)
        self._spectrum = np.empty((shape[1], waves), np.result_type(precision, np.complex64))  # a line for each column
        self._lift: np.ndarray = np.zeros(shape[0], precision)

    def __call__(self, field: np.ndarray, result: np.ndarray) -> None:
        """Write B applied to a field (nx, ny) into the result (nx, ny)."""
        nx = self.shape[0]
        self._torus[:nx], self._torus[nx:] = field, 0.0
        if self._far is not None:
            _lift_far(self._torus[:nx], self._far, self._span, self._lift)
        fft.r2c(self._torus, axes=(0,), out=self._spectrum.T)
        _sum_across(self._toeplitz, self._spectrum.view(self._torus.dtype))
        fft.c2r(self._spectrum.T, axes=(0,), lastsize=self.torus[0], forward=False, out=self._torus)
        _lifted(self._torus, self._unit / 2, self._lift, result)


def embedding_symbol(coefficients: np.ndarray, torus: tuple[int, int]) -> np.ndarray:
    """Eigenvalues of the circulant matrix that holds B at offsets up to half the torus, as of numpy.fft.rfft2."""
    kernel = np.zeros(torus)
    i, j = (np.minimum(np.arange(m), m - np.arange(m)) for m in torus)
    held = np.ix_(i < coefficients.shape[0], j < coefficients.shape[1])
    kernel[held] = coefficients[np.ix_(i[held[0].ravel()], j[held[1].ravel()])]
    return fft.r2c(kernel, axes=(0, 1)).real  # even, hence real


def rough_convolution(coefficients: np.ndarray) -> NarrowConvolution | None:
    """The product of a free half-space on a strip to some 1e-3 of it, in half the time; None on other meshes.

    coefficients : (nx, ny) B by the offset of two nodes
    """
    nx, ny = coefficients.shape
    span = nx // DISTANT
    if ny > NARROW or span * NEAREST < 3 * ny:
        return None
    torus = fast_length(nx + NEAREST * span), fast_length(2 * ny - 1)
    pairs = np.where(np.arange(ny) > 0, 2.0, 1.0) * (ny - np.arange(ny))
    means = coefficients @ pairs / ny**2
    apart = span * np.arange(nx // span + 1)
    beyond = (apart > torus[0] / 2) & (apart < nx)
    far = np.where(beyond, means[np.minimum(apart, nx - 1)] - means[np.where(beyond, torus[0] - apart, 0)], 0.0)
    far = np.concatenate((far[:0:-1], far))
    return NarrowConvolution(embedding_symbol(coefficients, torus), (nx, ny), torus, np.float32, far, span)


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
def _lifted(torus: np.ndarray, unit: float, lift: np.ndarray, result: np.ndarray) -> None:
    """result <- the rows of a torus in a unit, with a lift (nx,) of each."""
    nx, ny = result.shape
    for i in range(nx):
        of_row, row, raised = torus[i], result[i], lift[i]
        for j in range(ny):
            row[j] = of_row[j] * unit + raised


@compiled(fastmath={"reassoc"})
def _lift_far(field: np.ndarray, far: np.ndarray, span: int, lift: np.ndarray) -> None:
    """Write the lift (nx,) of rows by the forces on distant blocks of a span of rows, linear between their centres.

    far : (2 blocks - 1,) by the offset of two blocks, from 1 - blocks on
    """
    (n, ny), blocks, flat = field.shape, far.size // 2 + 1, field.reshape(-1)
    height = np.zeros(blocks)
    for block in range(blocks):
        nodes, force = flat[block * span * ny : min((block + 1) * span, n) * ny], 0.0
        for k in range(nodes.size):
            force += nodes[k]
        of_offset = far[blocks - 1 - block : 2 * blocks - 1 - block]
        for k in range(blocks):
            height[k] += of_offset[k] * force
    for right in range(blocks + 1):
        start = height[max(right - 1, 0)]
        slope, centre = (height[min(right, blocks - 1)] - start) / span, right * span - span // 2
        for i in range(max(centre, 0), min(centre + span, n)):
            lift[i] = start + slope * (i - centre)


@compiled(fastmath={"contract"})
def _sum_across(toeplitz: np.ndarray, spectrum: np.ndarray) -> None:
    """Write twice the product of the Toeplitz matrix (ny, waves) of every wave number and a spectrum (ny, 2 waves).

    Parts are even and odd in turn. The middle column of an odd number of columns is an even part. Matrix and parts of
    BLOCK numbers are copied to rows of this length, offsets of either sign, so that the compiler sees which of them may
    overlap and vectorises. Five parts are summed at a time. Rows beyond the parts are zero.
    """
    ny, waves = toeplitz.shape
    pairs, middle = (ny + 1) // 2, ny + 5
    matrix = np.zeros((2 * middle + 1) * BLOCK, toeplitz.dtype)
    parts, sums = np.zeros(2 * (pairs + 5) * BLOCK, toeplitz.dtype), np.zeros(2 * pairs * BLOCK, toeplitz.dtype)
    for first in range(0, waves, BLOCK // 2):
        width = min(BLOCK // 2, waves - first)
        for offset in range(ny):
            plus = matrix[(middle + offset) * BLOCK : (middle + offset + 1) * BLOCK]
            minus = matrix[(middle - offset) * BLOCK : (middle - offset + 1) * BLOCK]
            of_offset = toeplitz[offset, first : first + width]
            for k in range(width):
                plus[2 * k] = plus[2 * k + 1] = of_offset[k]  # for real and imaginary part
            for k in range(BLOCK):
                minus[k] = plus[k]
        for b in range(pairs):
            left = spectrum[b, 2 * first : 2 * (first + width)]
            right = spectrum[ny - 1 - b, 2 * first : 2 * (first + width)]
            even, odd = parts[2 * b * BLOCK : (2 * b + 1) * BLOCK], parts[(2 * b + 1) * BLOCK : 2 * (b + 1) * BLOCK]
            share = spectrum.dtype.type(0.5 if 2 * b == ny - 1 else 1.0)
            for k in range(left.size):
                even[k], odd[k] = share * (left[k] + right[k]), left[k] - right[k]
        sums[:] = 0
        for a in range(pairs):
            for b in range(0, pairs, 5):
                near = matrix[(middle + a - b - 4) * BLOCK : (middle + a - b + 1) * BLOCK]
                far = matrix[(middle + ny - 5 - a - b) * BLOCK : (middle + ny - a - b) * BLOCK]
                part = parts[2 * b * BLOCK : 2 * (b + 5) * BLOCK]
                total = sums[2 * a * BLOCK : 2 * (a + 1) * BLOCK]
                for k in range(BLOCK):
                    n0, f0, n1, f1 = near[4 * BLOCK + k], far[4 * BLOCK + k], near[3 * BLOCK + k], far[3 * BLOCK + k]
                    n2, f2, n3, f3 = near[2 * BLOCK + k], far[2 * BLOCK + k], near[BLOCK + k], far[BLOCK + k]
                    n4, f4 = near[k], far[k]
                    total[k] += (
                        (n0 + f0) * part[k]
                        + (n1 + f1) * part[2 * BLOCK + k]
                        + (n2 + f2) * part[4 * BLOCK + k]
                        + (n3 + f3) * part[6 * BLOCK + k]
                        + (n4 + f4) * part[8 * BLOCK + k]
                    )
                    total[BLOCK + k] += (
                        (n0 - f0) * part[BLOCK + k]
                        + (n1 - f1) * part[3 * BLOCK + k]
                        + (n2 - f2) * part[5 * BLOCK + k]
                        + (n3 - f3) * part[7 * BLOCK + k]
                        + (n4 - f4) * part[9 * BLOCK + k]
                    )
        for b in range(pairs):
            left = spectrum[b, 2 * first : 2 * (first + width)]
            right = spectrum[ny - 1 - b, 2 * first : 2 * (first + width)]
            even, odd = sums[2 * b * BLOCK : (2 * b + 1) * BLOCK], sums[(2 * b + 1) * BLOCK : 2 * (b + 1) * BLOCK]
            for k in range(left.size):
                left[k], right[k] = even[k] + odd[k], even[k] - odd[k]
