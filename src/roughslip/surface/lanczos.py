"""Leading eigenpairs of the covariance matrix of a mesh, which is never formed: Lanczos on its symmetry classes.

C(-x, -y) = C(x, y), so modes are even or odd under reflection in the centre of the mesh; where C(-x, y) = C(x, y) too,
they are even or odd about both its middle lines. Each class is solved by itself. Its vectors are a half or a quarter as
long and as many, so that orthogonalisation, which dominates, costs a quarter to a sixteenth; and the eigenvalues that
symmetry makes equal, as on a square, fall into different classes, where Lanczos finds them and a mode is unique.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from itertools import product

import ducc0  # type: ignore[import-not-found]
import numpy as np
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from roughslip.errors import ConvergenceError
from roughslip.grid import Grid
from roughslip.surface.covariance import StationaryCovariance
from roughslip.surface.embedding import circulant_eigenvalues

TOLERANCE = 1e-9  # of Lanczos, relative to each eigenvalue; those that count end near rounding
LARGEST_RESIDUAL = 1e-9  # relative to the largest eigenvalue
HALF = math.sqrt(0.5)

Operator = Callable[[np.ndarray], np.ndarray]


def leading_modes(
    covariance: StationaryCovariance, grid: Grid, order: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The `order` largest eigenvalues of the covariance matrix of the nodes over Sq^2, and their vectors.

    covariance, grid : of the field
    order : M, at most a quarter of the nodes

    Returns eigenvalues (M,) [-] descending, vectors (M, nx ny) of unit norm, and residuals
    |C phi - lambda phi| / lambda_1 (M,) [-], computed afresh.
    Raises ConvergenceError where Lanczos stops short or a residual exceeds LARGEST_RESIDUAL: ask for fewer modes.

    Method: implicitly restarted Lanczos (Lehoucq, Sorensen and Yang, ARPACK Users' Guide, 1998) with products by FFT.
    """
    apply = covariance_operator(covariance, grid)
    classes = _symmetry_classes(covariance, grid)
    # two classes share the modes evenly; of four the even ones have more, by half the modes on an edge
    margin = 3 if len(classes) < 4 else 2 + math.isqrt(order) // 2
    wanted = [min(order // len(classes) + margin, size - 1) for size, _, _ in classes]
    found: list[tuple[np.ndarray, np.ndarray]] = [(np.empty(0), np.empty((0, 0)))] * len(classes)
    while True:
        for k, (size, fold, unfold) in enumerate(classes):
            if len(found[k][0]) < wanted[k]:
                found[k] = _largest(partial(_within, apply, fold, unfold), size, wanted[k])
        values = np.concatenate([part for part, _ in found])
        leading = np.argsort(-values, kind="stable")[:order]
        # a class whose smallest value is among the leading may have more of them
        short = [k for k, (part, _) in enumerate(found) if part[-1] > values[leading[-1]]]
        if not short and len(leading) == order:
            break
        if all(wanted[k] == classes[k][0] - 1 for k in short):
            raise ConvergenceError(f"Lanczos cannot tell {order} modes from the rest; ask for fewer", math.nan, order)
        for k in short:
            wanted[k] = min(2 * wanted[k], classes[k][0] - 1)
    owner = np.repeat(np.arange(len(classes)), [len(part) for part, _ in found])[leading]
    place = np.concatenate([np.arange(len(part)) for part, _ in found])[leading]
    vectors = np.empty((order, grid.size))
    residuals = np.empty(order)
    for row, (k, column) in enumerate(zip(owner, place, strict=True)):
        vectors[row] = classes[k][2](found[k][1][:, column]).ravel()
        image = apply(vectors[row].reshape(grid.shape)).ravel()
        residuals[row] = np.linalg.norm(image - values[leading[row]] * vectors[row]) / values[leading[0]]
    if not residuals.max() <= LARGEST_RESIDUAL:
        raise ConvergenceError(f"modes of {grid.shape} nodes are inaccurate; ask for fewer", residuals.max(), order)
    return values[leading], vectors, residuals


def covariance_operator(covariance: StationaryCovariance, grid: Grid) -> Operator:
    """The function that multiplies a field (nx, ny) by the covariance matrix of the nodes over Sq^2.

    A convolution on a torus of twice the mesh; rows that are padding are neither transformed nor transformed back.
    """
    nx, ny = grid.shape
    torus = 2 * nx, 2 * ny
    scale = covariance.rms_height_m**2 * math.prod(torus)
    symbol = circulant_eigenvalues(covariance, grid, torus) / scale
    padded, spectrum = np.zeros((nx, 2 * ny)), np.zeros((2 * nx, ny + 1), dtype=complex)
    result = np.empty_like(padded)

    def apply(field: np.ndarray) -> np.ndarray:
        padded[:, :ny] = field
        ducc0.fft.r2c(padded, axes=(1,), out=spectrum[:nx])
        spectrum[nx:] = 0.0
        ducc0.fft.c2c(spectrum, axes=(0,), out=spectrum)
        np.multiply(spectrum, symbol, out=spectrum)
        ducc0.fft.c2c(spectrum, axes=(0,), forward=False, out=spectrum)
        ducc0.fft.c2r(
            spectrum[:nx], axes=(1,), lastsize=2 * ny, forward=False, out=result, allow_overwriting_input=True
        )
        return result[:, :ny].copy()

    return apply


def _symmetry_classes(covariance: StationaryCovariance, grid: Grid) -> list[tuple[int, Operator, Operator]]:
    """Size of each class, the map of a field to its part, and the map back: its transpose, an isometry."""
    nx, ny = grid.shape
    classes: list[tuple[int, Operator, Operator]] = []
    if covariance.mirror_symmetric:
        for sx, sy in product((1, -1), repeat=2):
            part = _folded_length(nx, sx), _folded_length(ny, sy)

            def fold(field: np.ndarray, sx: int = sx, sy: int = sy) -> np.ndarray:
                return _fold(_fold(field, sx).T, sy).T.ravel()

            def unfold(vector: np.ndarray, sx: int = sx, sy: int = sy, part: tuple[int, int] = part) -> np.ndarray:
                return _unfold(_unfold(vector.reshape(part), nx, sx).T, ny, sy).T

            classes.append((math.prod(part), fold, unfold))
    else:
        for sign in (1, -1):

            def fold_centre(field: np.ndarray, sign: int = sign) -> np.ndarray:
                return _fold(field.ravel(), sign)

            def unfold_centre(vector: np.ndarray, sign: int = sign) -> np.ndarray:
                return _unfold(vector, grid.size, sign).reshape(grid.shape)

            classes.append((_folded_length(grid.size, sign), fold_centre, unfold_centre))
    return [entry for entry in classes if entry[0] > 1]


def _within(apply: Operator, fold: Operator, unfold: Operator, part: np.ndarray) -> np.ndarray:
    return fold(apply(unfold(part)))


def _folded_length(nodes: int, sign: int) -> int:
    return (nodes + (sign > 0)) // 2


def _fold(field: np.ndarray, sign: int) -> np.ndarray:
    """Even (sign 1) or odd (-1) part along the first axis, on the first half of its nodes and the middle one."""
    half = len(field) // 2
    part = HALF * (field[:half] + sign * field[::-1][:half])
    return np.concatenate((part, field[half : half + 1])) if len(field) % 2 and sign > 0 else part


def _unfold(part: np.ndarray, nodes: int, sign: int) -> np.ndarray:
    half = nodes // 2
    field = np.zeros((nodes, *part.shape[1:]))
    field[:half] = HALF * part[:half]
    field[nodes - half :] = sign * field[:half][::-1]
    if nodes % 2 and sign > 0:
        field[half] = part[half]
    return field


def _largest(matvec: Operator, size: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The `count` largest eigenvalues (count,) of a class, descending, and their vectors (size, count)."""
    operator = LinearOperator((size, size), matvec=matvec, dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(size)  # fixed, generic: no mode is orthogonal to it
    krylov = min(size, max(3 * count // 2 + 10, 20))  # measured: 10 % faster than ARPACK's twice the count
    try:
        values, vectors = eigsh(operator, k=count, which="LA", v0=start, ncv=krylov, tol=TOLERANCE)
    except ArpackError as error:
        message = f"Lanczos found fewer than {count} modes: {error}; ask for fewer"
        raise ConvergenceError(message, math.nan, 0) from error
    descending = np.argsort(-values)
    return values[descending], vectors[:, descending]
