"""Karhunen-Loeve expansion of a Gaussian field on the nodes of a mesh (eq. 2 of the paper)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy.linalg

from roughslip.errors import IllPosedError, ParameterError, real, whole
from roughslip.grid import Grid
from roughslip.results import described, result
from roughslip.surface.covariance import StationaryCovariance
from roughslip.surface.embedding import circulant_eigenvalues
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
def karhunen_loeve(
    covariance: StationaryCovariance, grid: Grid, order: int | None = None, *, share: float | None = None
) -> KarhunenLoeve:
    """Discrete expansion of the field on the nodes, truncated after `order` modes or where they carry `share`.

    covariance, grid : of the field
    order : M, number of modes, or
    share : of the variance that the modes must carry, in (0, 1]; the fewest modes are taken

    The nodes carry equal weights (equal cells), so the Fredholm equation becomes the eigenproblem of the covariance
    matrix (Ghanem and Spanos 1991, ch. 2). This is the midpoint rule: eigenvalues times the cell area converge to those
    of the continuous problem with the square of the cell, for kernels with a cusp as well. A separable covariance
    on a rectangular mesh is the Kronecker product of two one-dimensional matrices, which are formed up to DENSE_NODES
    on an axis. Otherwise the matrix is formed on small meshes and applied by FFT on large ones.
    Sign: the entry of largest magnitude is positive. Modes of equal eigenvalue keep the order of the nodes.

    Returns the expansion. Raises ParameterError for an order outside 1 ... nx ny or a share outside (0, 1], and
    ConvergenceError where Lanczos does not converge. Raises IllPosedError where a mesh of more than
    MOST_DENSE_NODES needs more than a quarter of its modes: sample by circulant embedding.
    """
    if (order is None) == (share is None):
        raise ParameterError("give either the order of the expansion or the share of the variance")
    if order is not None and not 1 <= whole("the order", order) <= grid.size:
        raise ParameterError(f"the order must lie between 1 and the {grid.size} nodes of the mesh, not {order}")
    if share is not None and not 0.0 < real("the share of the variance", share) <= 1.0:
        raise ParameterError(f"the share of the variance must lie in (0, 1], not {share}")
    if covariance.separable and max(grid.shape) <= DENSE_NODES:
        pairs = _kronecker_modes(covariance, grid, order, share)
    elif grid.size <= DENSE_NODES or (
        order is not None and order > grid.size // LANCZOS_SHARE and grid.size <= MOST_DENSE_NODES
    ):
        pairs = _dense_modes(covariance, grid, order, share)
    else:
        pairs = _lanczos_modes(covariance, grid, order, share)
    # rounding leaves the tail of a smooth kernel slightly negative
    eigenvalues = np.maximum(pairs.values, 0.0)
    largest = np.argmax(np.abs(np.round(pairs.vectors, 9)), axis=1)
    signs = np.sign(pairs.vectors[np.arange(len(largest)), largest])
    modes = pairs.vectors
    modes *= signs[:, None]
    modes *= np.sqrt(eigenvalues)[:, None]
    captured = float(eigenvalues.sum() / (grid.size * covariance.rms_height_m**2))
    return KarhunenLoeve(grid, eigenvalues, modes.reshape(-1, *grid.shape), captured)


def _fewest(values: np.ndarray, total: float, share: float) -> int:
    """How many of the descending eigenvalues carry the share of their total, 1 + their number if all do not."""
    carried = np.cumsum(np.maximum(values, 0.0)) / total
    return int(np.searchsorted(carried, share - 1e-12)) + 1  # all modes carry 1 within rounding


def _kronecker_modes(covariance: StationaryCovariance, grid: Grid, order: int | None, share: float | None) -> _Pairs:
    """Products of the modes of two lines."""
    lines = Grid(grid.nx, 1, grid.dx, grid.dy), Grid(1, grid.ny, grid.dx, grid.dy)
    x, y = (_line_modes(covariance, line) for line in lines)
    products = np.outer(x.values, y.values).ravel()
    descending = np.argsort(-np.round(products, 12), kind="stable")
    leading = descending[: order or _fewest(products[descending], grid.size, share or 1.0)]
    i, j = np.unravel_index(leading, grid.shape)
    vectors = np.einsum("xm,ym->mxy", x.vectors[:, i], y.vectors[:, j]).reshape(len(leading), -1)
    return _Pairs(covariance.rms_height_m**2 * products[leading], vectors)


def _line_modes(covariance: StationaryCovariance, line: Grid) -> _Pairs:
    """All modes of one axis over Sq^2, ascending, vectors in columns."""
    lags = covariance(line.x() - line.dx / 2, 0.0) if line.ny == 1 else covariance(np.zeros(1), line.y() - line.dy / 2)
    return _Pairs(*scipy.linalg.eigh(scipy.linalg.toeplitz(lags) / covariance.rms_height_m**2))


def _dense_modes(covariance: StationaryCovariance, grid: Grid, order: int | None, share: float | None) -> _Pairs:
    variance = covariance.rms_height_m**2
    x, y = (axis.ravel() for axis in np.meshgrid(grid.x(), grid.y(), indexing="ij"))
    matrix = covariance(x[:, None] - x[None, :], y[:, None] - y[None, :])
    values, vectors = scipy.linalg.eigh(matrix)
    descending = np.argsort(-np.round(values / variance, 12), kind="stable")
    leading = descending[: order or _fewest(values[descending], grid.size * variance, share or 1.0)]
    return _Pairs(values[leading], np.ascontiguousarray(vectors[:, leading].T))


def _lanczos_modes(covariance: StationaryCovariance, grid: Grid, order: int | None, share: float | None) -> _Pairs:
    """As many modes as asked for, or a predicted number that grows until they carry the share."""
    variance = covariance.rms_height_m**2
    count = order or _predicted_number(covariance, grid, share or 1.0)
    while count <= grid.size // LANCZOS_SHARE:
        values, vectors, _ = leading_modes(covariance, grid, count)
        needed = order or _fewest(values, grid.size, share or 1.0)
        if needed <= count:
            return _Pairs(variance * values[:needed], vectors[:needed])
        count = math.ceil(1.2 * count)
    raise IllPosedError(
        f"the expansion needs more than a quarter of the {grid.size} modes of the mesh: sample by circulant "
        "embedding, or ask for fewer modes or a smaller share"
    )


def _predicted_number(covariance: StationaryCovariance, grid: Grid, share: float) -> int:
    """About how many modes carry a share of the variance: every fourth wave of the torus of twice the mesh is one.

    On meshes of many correlation lengths the eigenvalues converge to the spectrum (Grenander and Szego, Toeplitz Forms,
    1958). On shorter ones the number is wrong by some modes.
    """
    far = 1e9 * max(grid.nx * grid.dx, grid.ny * grid.dy)  # a line has no second axis to be correlated along
    apart = Grid(grid.nx, grid.ny, grid.dx if grid.nx > 1 else far, grid.dy if grid.ny > 1 else far)
    half = np.maximum(circulant_eigenvalues(covariance, apart, (2 * grid.nx, 2 * grid.ny)), 0.0)
    once, twice = half[:, [0, grid.ny]].ravel(), np.repeat(half[:, 1 : grid.ny].ravel(), 2)
    descending = -np.sort(-np.concatenate((once, twice)))
    carried = np.cumsum(descending.reshape(grid.size, 4).sum(axis=1))
    return int(1.05 * np.searchsorted(carried / carried[-1], share)) + 4
