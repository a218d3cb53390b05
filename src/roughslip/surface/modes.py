"""Karhunen-Loeve expansion of a Gaussian field on the nodes of a mesh (eq. 2 of the paper)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError, whole
from roughslip.grid import Grid
from roughslip.results import described, result
from roughslip.surface.covariance import StationaryCovariance
from roughslip.surface.lanczos import LANCZOS_SHARE, MOST_DENSE_NODES, leading_modes
from roughslip.validation import gate

DENSE_NODES = 1024  # below this a dense eigenproblem costs less than a second


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

    def variance(self) -> np.ndarray:
        """Var z : (nx, ny) [m^2]; a truncated expansion is not stationary, so it differs from node to node."""
        return np.sum(self.modes**2, axis=0)

    @gate
    def captured_at(self, node: tuple[int, int]) -> float:
        """Share [-] of the variance of one node, such as `grid.centre` or the corner (0, 0), that the modes carry."""
        whole = self.eigenvalues.sum() / (self.captured_variance * self.grid.size)
        return float(np.sum(self.modes[:, node[0], node[1]] ** 2) / whole)


class _Pairs(NamedTuple):
    values: np.ndarray  # (M,) [m^2] descending
    vectors: np.ndarray  # (M, nx ny)


def heights(modes: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """z : (nx, ny) [m] of one sample xi : (M,) of the modes : (M, nx, ny) [m].

    One sample at a time, so that no bit depends on batches.
    """
    return (xi @ modes.reshape(len(modes), -1)).reshape(modes.shape[1:])


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
    if not 1 <= whole("the order", order) <= grid.size:
        raise ParameterError(f"the order must lie between 1 and the {grid.size} nodes of the mesh, not {order}")
    most = grid.size // LANCZOS_SHARE
    if covariance.separable and max(grid.shape) <= DENSE_NODES:
        pairs = _kronecker_modes(covariance, grid, order)
    elif grid.size <= DENSE_NODES or (order > most and grid.size <= MOST_DENSE_NODES):
        pairs = _dense_modes(covariance, grid, order)
    elif order > most:
        raise IllPosedError(
            f"{order} are more than a quarter of the {grid.size} modes of the mesh: sample by circulant embedding, or "
            "ask for fewer modes"
        )
    else:
        pairs = _lanczos_modes(covariance, grid, order)
    # rounding leaves the tail of a smooth kernel slightly negative
    eigenvalues = np.maximum(pairs.values, 0.0)
    largest = np.argmax(np.abs(np.round(pairs.vectors, 9)), axis=1)
    signs = np.sign(pairs.vectors[np.arange(len(largest)), largest])
    modes = pairs.vectors
    modes *= signs[:, None]
    modes *= np.sqrt(eigenvalues)[:, None]
    captured = float(eigenvalues.sum() / (grid.size * covariance.rms_height_m**2))
    return KarhunenLoeve(grid, eigenvalues, modes.reshape(-1, *grid.shape), captured)


def _kronecker_modes(covariance: StationaryCovariance, grid: Grid, order: int) -> _Pairs:
    """Products of the modes of two lines."""
    lines = Grid(grid.nx, 1, grid.dx, grid.dy), Grid(1, grid.ny, grid.dx, grid.dy)
    x, y = (_line_modes(covariance, line) for line in lines)
    products = np.outer(x.values, y.values).ravel()
    descending = np.argsort(-np.round(products, 12), kind="stable")
    leading = descending[:order]
    i, j = np.unravel_index(leading, grid.shape)
    vectors = np.einsum("xm,ym->mxy", x.vectors[:, i], y.vectors[:, j]).reshape(len(leading), -1)
    return _Pairs(covariance.rms_height_m**2 * products[leading], vectors)


def _line_modes(covariance: StationaryCovariance, line: Grid) -> _Pairs:
    """All modes of one axis over Sq^2, ascending, vectors in columns."""
    lags = covariance(line.x() - line.dx / 2, 0.0) if line.ny == 1 else covariance(np.zeros(1), line.y() - line.dy / 2)
    return _Pairs(*scipy.linalg.eigh(scipy.linalg.toeplitz(lags) / covariance.rms_height_m**2))


def _dense_modes(covariance: StationaryCovariance, grid: Grid, order: int) -> _Pairs:
    variance = covariance.rms_height_m**2
    x, y = (axis.ravel() for axis in np.meshgrid(grid.x(), grid.y(), indexing="ij"))
    matrix = covariance(x[:, None] - x[None, :], y[:, None] - y[None, :])
    values, vectors = scipy.linalg.eigh(matrix)
    descending = np.argsort(-np.round(values / variance, 12), kind="stable")
    leading = descending[:order]
    return _Pairs(values[leading], np.ascontiguousarray(vectors[:, leading].T))


def _lanczos_modes(covariance: StationaryCovariance, grid: Grid, order: int) -> _Pairs:
    """By products with the matrix; of the matrix itself where these do not converge, if it can be formed."""
    try:
        values, vectors, _ = leading_modes(covariance, grid, order)
    except ConvergenceError:
        if grid.size > MOST_DENSE_NODES:
            raise
        return _dense_modes(covariance, grid, order)
    return _Pairs(covariance.rms_height_m**2 * values, vectors)
