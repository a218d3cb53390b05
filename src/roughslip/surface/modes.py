"""Karhunen-Loeve expansion of a Gaussian field on the nodes of a mesh (eq. 2 of the paper).

Where the covariance matrix of the nodes is too large to form, its modes are found by Lanczos with products by FFT.
"""

import math
from collections.abc import Callable

import numpy as np
import scipy.linalg
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from roughslip import fft
from roughslip.compilation.cache import compiled
from roughslip.errors import ConvergenceError, IllPosedError, ParameterError, whole
from roughslip.grid import Grid
from roughslip.results import described, result
from roughslip.surface.covariance import StationaryCovariance
from roughslip.surface.embedding import circulant_eigenvalues
from roughslip.validation import gate

DENSE_NODES = 1024  # below this a dense eigenproblem costs less than a second
LARGEST_RESIDUAL = 1e-9  # relative to the largest eigenvalue
MOST_DENSE_NODES = 4096  # nodes up to which the matrix is formed where many modes are wanted
NODES_AT_ONCE = 256
LANCZOS_SHARE = 4  # Lanczos is for up to one mode in so many nodes
MISSING_TOLERANCE = 1e-9  # relative, above the smallest eigenvalue found: what exceeds it was missed
MOST_ROUNDS = 20  # of searches for missing modes
FEWER = "ask for fewer, or take a longer correlation length"
KEYS = "square.modes, roughness.correlation_length_m"

Operator = Callable[[np.ndarray], np.ndarray]
Pairs = tuple[np.ndarray, np.ndarray]  # eigenvalues : (M,) and vectors : (M, nx ny)


@result
class KarhunenLoeve:
    """The leading modes of a field, scaled: z = sum_j xi_j modes_j with independent standard normal xi_j."""

    grid: Grid = described("the mesh")
    eigenvalues: np.ndarray = described(
        "eigenvalues lambda_j of the covariance matrix of the nodes, descending", "m^2", "M"
    )
    modes: np.ndarray = described("modes sqrt(lambda_j) phi_j, with phi_j of unit Euclidean norm", "m", "M x y")
    captured_variance: float = described(
        "share of the variance of the nodes, summed over the mesh, that the modes carry"
    )

    @gate
    def captured_at(self, node: tuple[int, int]) -> float:
        """Share [-] of the variance of one node, such as `grid.centre` or the corner (0, 0), that the modes carry."""
        whole = self.eigenvalues.sum() / (self.captured_variance * self.grid.size)
        return float(np.sum(self.modes[:, node[0], node[1]] ** 2) / whole)


def heights(modes: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """z : (k, nx, ny) [m] of samples xi : (k, M) of modes : (M, nx, ny) [m]; no bit depends on the other samples."""
    fields = np.zeros((len(xi), modes[0].size))
    _add_modes(np.ascontiguousarray(modes).reshape(len(modes), -1), xi, fields)
    return fields.reshape(len(xi), *modes.shape[1:])


@compiled()
def _add_modes(modes: np.ndarray, xi: np.ndarray, fields: np.ndarray) -> None:
    """Add xi @ modes to the fields, mode by mode, on so many nodes at a time as stay in the cache."""
    for first in range(0, modes.shape[1], NODES_AT_ONCE):
        for row in range(len(xi)):
            part = fields[row, first : first + NODES_AT_ONCE]
            for mode in range(len(modes)):
                factor, values = xi[row, mode], modes[mode, first : first + NODES_AT_ONCE]
                for node in range(part.size):
                    part[node] += factor * values[node]


@gate
def karhunen_loeve(covariance: StationaryCovariance, grid: Grid, order: int) -> KarhunenLoeve:
    """Discrete expansion of the field on the nodes, truncated after `order` modes.

    covariance, grid : of the field
    order : M, number of modes

    The nodes carry equal weights (equal cells), so the Fredholm equation becomes the eigenproblem of the covariance
    matrix (Ghanem and Spanos 1991, ch. 2). This is the midpoint rule: eigenvalues times the cell area converge to those
    of the continuous problem with the square of the cell, for kernels with a cusp as well. A separable covariance
    on a rectangular mesh is the Kronecker product of two one-dimensional matrices, which are formed up to DENSE_NODES
    on an axis. Otherwise the matrix is formed on small meshes and applied by FFT on large ones.
    Sign: the entry of largest magnitude is positive. Modes of equal eigenvalue keep the order of the nodes.

    Returns the expansion. Raises ParameterError for an order outside 1 ... nx ny, and ConvergenceError where Lanczos
    does not converge. Raises IllPosedError for more than a quarter of the modes of a mesh of more than
    MOST_DENSE_NODES: sample by circulant embedding.
    """
    if not 1 <= whole("order", order) <= grid.size:
        raise ParameterError(f"order must lie between 1 and the {grid.size} nodes of the mesh, not {order}")
    most = grid.size // LANCZOS_SHARE
    if covariance.separable and max(grid.shape) <= DENSE_NODES:
        values, vectors = _kronecker_modes(covariance, grid, order)
    elif grid.size <= DENSE_NODES or (order > most and grid.size <= MOST_DENSE_NODES):
        values, vectors = _dense_modes(covariance, grid, order)
    elif order > most:
        raise IllPosedError(
            f"{order} are more than a quarter of the {grid.size} modes of the mesh: sample by circulant embedding, or "
            "ask for fewer modes"
        )
    else:
        values, vectors = leading_modes(covariance, grid, order)
    # rounding leaves the tail of a smooth kernel slightly negative
    eigenvalues = np.maximum(covariance.rms_height_m**2 * values, 0.0)
    largest = np.argmax(np.abs(np.round(vectors, 9)), axis=1)
    vectors *= np.sign(vectors[np.arange(len(largest)), largest])[:, None]
    vectors *= np.sqrt(eigenvalues)[:, None]
    captured = float(eigenvalues.sum() / (grid.size * covariance.rms_height_m**2))
    return KarhunenLoeve(grid, eigenvalues, vectors.reshape(-1, *grid.shape), captured)


def _kronecker_modes(covariance: StationaryCovariance, grid: Grid, order: int) -> Pairs:
    """Products of the modes of two lines, over Sq^2."""
    lags = covariance(grid.x() - grid.dx / 2, 0.0), covariance(np.zeros(1), grid.y() - grid.dy / 2)
    (x, along), (y, across) = (scipy.linalg.eigh(scipy.linalg.toeplitz(c) / covariance.rms_height_m**2) for c in lags)
    products = np.outer(x, y).ravel()
    leading = np.argsort(-np.round(products, 12), kind="stable")[:order]
    i, j = np.unravel_index(leading, grid.shape)
    return products[leading], np.einsum("xm,ym->mxy", along[:, i], across[:, j]).reshape(len(leading), -1)


def _dense_modes(covariance: StationaryCovariance, grid: Grid, order: int) -> Pairs:
    x, y = (axis.ravel() for axis in np.meshgrid(grid.x(), grid.y(), indexing="ij"))
    matrix = covariance(x[:, None] - x[None, :], y[:, None] - y[None, :])
    values, vectors = scipy.linalg.eigh(matrix)
    values /= covariance.rms_height_m**2
    leading = np.argsort(-np.round(values, 12), kind="stable")[:order]
    return values[leading], np.ascontiguousarray(vectors[:, leading].T)


def leading_modes(covariance: StationaryCovariance, grid: Grid, order: int) -> Pairs:
    """The largest eigenvalues of the covariance matrix of the nodes over Sq^2, and their vectors.

    covariance, grid : of the field
    order : M, number of modes, at most a quarter of the nodes

    Returns eigenvalues (M,) [-] descending and vectors (M, nx ny) of unit norm.

    Lanczos from one vector may miss a mode whose eigenvalue is multiple, as most are on a square. So the modes found
    are projected out of the matrix, and the search goes on until nothing above the smallest eigenvalue is left.

    Raises ConvergenceError where Lanczos stops short, or |C phi - lambda phi| / lambda_1 exceeds LARGEST_RESIDUAL: ask
    for fewer modes; ParameterError for a covariance that is not finite.

    Method: implicitly restarted Lanczos (Lehoucq, Sorensen and Yang, ARPACK Users' Guide, 1998) with deflation.
    """
    apply, count = covariance_operator(covariance, grid), order
    values, vectors, more, smallest = np.empty(0), np.empty((0, grid.size)), np.ones(1), -math.inf
    for _ in range(MOST_ROUNDS):
        try:
            more, more_vectors = _search(apply, grid, vectors, count)
        except ArpackError as error:  # eigenvalues that are nearly all equal, as of independent nodes
            text = f"Lanczos has not found {order} modes of {grid.size} nodes, whose eigenvalues are nearly equal"
            raise ConvergenceError(f"{text}; {FEWER}", math.nan, order, KEYS) from error
        if more[0] <= smallest:
            break
        values, vectors = np.concatenate((values, more)), np.concatenate((vectors, more_vectors))
        descending = np.argsort(-values, kind="stable")
        values, vectors = values[descending], vectors[descending]
        smallest = values[order - 1] * (1.0 + MISSING_TOLERANCE)
        count = 1 if more[-1] <= smallest else min(2 * count, order)
    values, vectors = values[:order], vectors[:order]
    defects = [apply(v.reshape(grid.shape)).ravel() - value * v for value, v in zip(values, vectors, strict=True)]
    worst = float(np.linalg.norm(defects, axis=1).max() / values[0])
    if not worst <= LARGEST_RESIDUAL or more[0] > smallest:
        text = f"{order} modes of {grid.nx} x {grid.ny} nodes are inaccurate, or some are missing"
        raise ConvergenceError(f"{text}; {FEWER}", worst, order, KEYS)
    return values, vectors


def _search(apply: Operator, grid: Grid, known: np.ndarray, count: int) -> Pairs:
    """The largest eigenvalues, descending, and vectors in rows, of the matrix without the modes known."""

    def product(vector: np.ndarray) -> np.ndarray:
        rest = vector.ravel()
        rest = rest - (known @ rest) @ known
        image = apply(rest.reshape(grid.shape)).ravel()
        return image - (known @ image) @ known

    generator = np.random.default_rng(len(known))  # fixed: the same bits from run to run
    values, vectors = eigsh(
        LinearOperator((grid.size, grid.size), matvec=product, dtype=float),
        k=count,
        which="LA",
        v0=generator.standard_normal(grid.size),
        ncv=min(grid.size, 2 * count + 60),
        rng=generator,
    )
    return values[::-1], vectors[:, ::-1].T


def covariance_operator(covariance: StationaryCovariance, grid: Grid) -> Operator:
    """The function that multiplies a field (nx, ny) by the covariance matrix of the nodes over Sq^2.

    A convolution on a torus of twice the mesh. Raises ParameterError for a covariance that is not finite.
    """
    nx, ny = grid.shape
    torus = 2 * nx, 2 * ny
    symbol = circulant_eigenvalues(covariance, grid, torus) / (covariance.rms_height_m**2 * math.prod(torus))
    if not np.all(np.isfinite(symbol)):
        raise ParameterError(f"the covariance is not finite at all lags of {nx} x {ny} nodes")
    padded = np.zeros(torus)

    def apply(field: np.ndarray) -> np.ndarray:
        padded[:nx, :ny] = field
        return fft.c2r(symbol * fft.r2c(padded), lastsize=2 * ny, forward=False)[:nx, :ny].copy()

    return apply
