"""Leading eigenpairs of the covariance matrix of a mesh that is too large to form: Lanczos with products by FFT."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from roughslip import fft
from roughslip.errors import ConvergenceError, ParameterError
from roughslip.grid import Grid
from roughslip.surface.covariance import StationaryCovariance
from roughslip.surface.embedding import circulant_eigenvalues

LARGEST_RESIDUAL = 1e-9  # relative to the largest eigenvalue
MOST_DENSE_NODES = 4096  # nodes up to which the matrix is formed where Lanczos fails
LANCZOS_SHARE = 4  # Lanczos is for up to one mode in so many nodes
MISSING_TOLERANCE = 1e-9  # relative, above the smallest eigenvalue found: what exceeds it was missed
MOST_ROUNDS = 20  # of searches for missing modes

Operator = Callable[[np.ndarray], np.ndarray]


def leading_modes(
    covariance: StationaryCovariance, grid: Grid, order: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The largest eigenvalues of the covariance matrix of the nodes over Sq^2, and their vectors.

    covariance, grid : of the field
    order : M, number of modes, at most a quarter of the nodes

    Returns eigenvalues (M,) [-] descending, vectors (M, nx ny) of unit norm, and residuals
    |C phi - lambda phi| / lambda_1 (M,) [-], computed afresh.

    Lanczos from one vector may miss a mode whose eigenvalue is multiple, as most are on a square. So the modes found
    are projected out of the matrix, and the search goes on until nothing above the smallest eigenvalue is left.

    Raises ConvergenceError where Lanczos stops short or a residual exceeds LARGEST_RESIDUAL: ask for fewer modes;
    ParameterError for a covariance that is not finite.

    Method: implicitly restarted Lanczos (Lehoucq, Sorensen and Yang, ARPACK Users' Guide, 1998) with deflation.
    """
    apply = covariance_operator(covariance, grid)
    try:
        values, vectors = _lanczos_modes(apply, grid, order)
    except ArpackError as error:  # eigenvalues that are nearly all equal, as of independent nodes
        text = (
            f"Lanczos has not found {order} modes of {grid.size} nodes, whose eigenvalues are nearly equal; ask for "
            "fewer, or take a longer correlation length; scene keys: square.modes, roughness.correlation_length_m"
        )
        raise ConvergenceError(text, math.nan, order) from error
    images = (apply(vector.reshape(grid.shape)).ravel() for vector in vectors)
    defects = [image - value * vector for image, value, vector in zip(images, values, vectors, strict=True)]
    residuals = np.linalg.norm(defects, axis=1) / values[0]
    worst = float(residuals.max())
    if not worst <= LARGEST_RESIDUAL:
        text = f"{order} modes of {grid.nx} x {grid.ny} nodes are inaccurate; ask for fewer; scene key: square.modes"
        raise ConvergenceError(text, worst, order)
    return values, vectors, residuals


def _lanczos_modes(apply: Operator, grid: Grid, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues descending and vectors in rows, without gaps."""
    values, vectors = np.empty(0), np.empty((0, grid.size))
    count = order
    for _ in range(MOST_ROUNDS):
        more, more_vectors = _search(apply, grid, vectors, count)
        smallest = values[order - 1] * (1.0 + MISSING_TOLERANCE) if len(values) else -math.inf
        if more[0] <= smallest:
            return values[:order], vectors[:order]
        values, vectors = np.concatenate((values, more)), np.concatenate((vectors, more_vectors))
        descending = np.argsort(-values, kind="stable")
        values, vectors = values[descending], vectors[descending]
        count = 1 if more[-1] <= smallest else min(2 * count, order)
    text = f"Lanczos still finds missing modes of {order}; ask for fewer; scene key: square.modes"
    raise ConvergenceError(text, math.nan, MOST_ROUNDS)


def _search(apply: Operator, grid: Grid, known: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
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
