"""Karhunen-Loeve expansion of a Gaussian field on the nodes of a mesh (eq. 2 of the paper)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft
import scipy.linalg
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.grid import Grid
from roughslip.surface.covariance import Covariance

DENSE_NODES = 1024  # below this a dense eigenproblem costs less than a second


@dataclass(frozen=True)
class KarhunenLoeve:
    """The leading modes of a field, scaled: z = sum_j xi_j modes_j with independent standard normal xi_j.

    grid : the mesh
    eigenvalues : (M,) [m^2] lambda_j of the covariance matrix of the nodes, descending
    modes : (M, nx, ny) [m] sqrt(lambda_j) phi_j, with phi_j of unit Euclidean norm
    captured_variance : share of the variance of the nodes, summed over the mesh, that the modes carry
    """

    grid: Grid
    eigenvalues: np.ndarray
    modes: np.ndarray
    captured_variance: float

    def variance(self) -> np.ndarray:
        """Var z : (nx, ny) [m^2]; a truncated expansion is not stationary, so it differs from node to node."""
        return np.sum(self.modes**2, axis=0)


def heights(modes: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """z : (nx, ny) [m] of one sample xi : (M,) of the modes : (M, nx, ny) [m].

    One sample at a time, so that no bit depends on batches.
    """
    return (xi @ modes.reshape(len(modes), -1)).reshape(modes.shape[1:])


def karhunen_loeve(covariance: Covariance, grid: Grid, order: int) -> KarhunenLoeve:
    """Discrete expansion of the field on the nodes, truncated after `order` modes.

    The nodes carry equal weights (equal cells), so the Fredholm equation becomes the eigenproblem of the covariance
    matrix (Ghanem and Spanos 1991, ch. 2). A separable covariance on a rectangular mesh is the Kronecker product of
    two one-dimensional matrices; otherwise the matrix is formed on small meshes and applied by FFT on large ones.
    Sign: the entry of largest magnitude is positive. Modes of equal eigenvalue keep the order of the nodes.

    Raises ParameterError for an order outside 1 ... nx ny, ConvergenceError where Lanczos does not converge.
    """
    if not 1 <= order <= grid.size:
        raise ParameterError(f"order {order} is not between 1 and the {grid.size} nodes of the mesh")
    if covariance.separable:
        eigenvalues, vectors = _kronecker_modes(covariance, grid, order)
    elif grid.size <= DENSE_NODES or order > grid.size // 4:
        eigenvalues, vectors = _dense_modes(covariance, grid, order)
    else:
        eigenvalues, vectors = _lanczos_modes(covariance, grid, order)
    eigenvalues = np.maximum(eigenvalues, 0.0)  # rounding leaves the tail of a smooth kernel slightly negative
    largest = np.argmax(np.abs(np.round(vectors, 9)), axis=1)
    vectors *= np.sign(vectors[np.arange(order), largest])[:, None]
    modes = np.sqrt(eigenvalues)[:, None] * vectors
    total = grid.size * covariance.rms_height_m**2
    return KarhunenLoeve(grid, eigenvalues, modes.reshape(order, *grid.shape), float(eigenvalues.sum() / total))


def _kronecker_modes(covariance: Covariance, grid: Grid, order: int) -> tuple[np.ndarray, np.ndarray]:
    variance = covariance.rms_height_m**2
    values_x, vectors_x = scipy.linalg.eigh(scipy.linalg.toeplitz(covariance(grid.x() - grid.dx / 2)) / variance)
    values_y, vectors_y = scipy.linalg.eigh(scipy.linalg.toeplitz(covariance(grid.y() - grid.dy / 2)) / variance)
    products = np.outer(values_x, values_y).ravel()
    leading = np.argsort(-np.round(products, 12), kind="stable")[:order]
    i, j = np.unravel_index(leading, grid.shape)
    vectors = np.einsum("xm,ym->mxy", vectors_x[:, i], vectors_y[:, j]).reshape(order, -1)
    return variance * products[leading], vectors


def _dense_modes(covariance: Covariance, grid: Grid, order: int) -> tuple[np.ndarray, np.ndarray]:
    x, y = (axis.ravel() for axis in np.meshgrid(grid.x(), grid.y(), indexing="ij"))
    matrix = covariance(x[:, None] - x[None, :], y[:, None] - y[None, :])
    values, vectors = scipy.linalg.eigh(matrix)
    leading = np.argsort(-np.round(values / covariance.rms_height_m**2, 12), kind="stable")[:order]
    return values[leading], np.ascontiguousarray(vectors[:, leading].T)


def _lanczos_modes(covariance: Covariance, grid: Grid, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Lanczos with the block-Toeplitz matrix applied by FFT on a torus of twice the size, never formed."""
    shape = 2 * grid.nx, 2 * grid.ny
    x = np.minimum(np.arange(shape[0]), shape[0] - np.arange(shape[0])) * grid.dx
    y = np.minimum(np.arange(shape[1]), shape[1] - np.arange(shape[1])) * grid.dy
    symbol = scipy.fft.rfft2(covariance(x[:, None], y[None, :])).real / covariance.rms_height_m**2

    def apply(vector: np.ndarray) -> np.ndarray:
        transform = scipy.fft.rfft2(vector.reshape(grid.shape), s=shape)
        return scipy.fft.irfft2(symbol * transform, s=shape)[: grid.nx, : grid.ny].ravel()

    operator = LinearOperator((grid.size, grid.size), matvec=apply, dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(grid.size)  # fixed, generic: no mode is orthogonal to it
    try:
        values, vectors = eigsh(operator, k=order, which="LA", v0=start, tol=1e-12)
    except ArpackError as error:
        raise ConvergenceError(f"Lanczos found fewer than {order} modes: {error}; ask for fewer", np.nan, 0) from error
    leading = np.argsort(-values)
    return values[leading] * covariance.rms_height_m**2, np.ascontiguousarray(vectors[:, leading].T)
