"""Linear functionals of the heights around a node, the Gaussian variables in which the pressure there is expanded.

A Karhunen-Loeve expansion orders its modes by their share of the variance of the whole mesh; the pressure at a node
depends on what the surface does around that node. Height, slopes, curvatures and two local means are linear in the
heights, so they are jointly Gaussian, and eight of them say more about the pressure than the eight leading modes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from roughslip.errors import IllPosedError

NAMES = ("height", "slope x", "slope y", "curvature xx", "curvature yy", "curvature xy", "near mean", "far mean")


@dataclass(frozen=True)
class Stencil:
    """Half widths, in nodes along x and y, of the boxes over which the near and the far mean of the heights run."""

    near: tuple[int, int]
    far: tuple[int, int]


def local_functionals(heights: np.ndarray, stencil: Stencil) -> np.ndarray:
    """functionals : (8, ..., nx, ny) NAMES at every node of heights : (..., nx, ny), in units of height.

    Differences are central, one-sided at the border; the boxes are cut at the border. All of it is linear.
    """
    slope_x, slope_y = _difference(heights, -2), _difference(heights, -1)
    return np.stack(
        [
            heights,
            slope_x,
            slope_y,
            _second_difference(heights, -2),
            _second_difference(heights, -1),
            _difference(slope_x, -1),
            _box_mean(heights, stencil.near),
            _box_mean(heights, stencil.far),
        ]
    )


def _difference(field: np.ndarray, axis: int) -> np.ndarray:
    if field.shape[axis] == 1:
        return np.zeros_like(field)
    return np.gradient(field, axis=axis)


def _second_difference(field: np.ndarray, axis: int) -> np.ndarray:
    along = np.moveaxis(field, axis, -1)
    second = np.zeros_like(along)
    if along.shape[-1] >= 3:
        second[..., 1:-1] = along[..., 2:] - 2 * along[..., 1:-1] + along[..., :-2]
        second[..., 0], second[..., -1] = second[..., 1], second[..., -2]
    return np.moveaxis(second, -1, axis)


def _box_mean(field: np.ndarray, half_widths: tuple[int, int]) -> np.ndarray:
    for axis, half in zip((-2, -1), half_widths, strict=True):
        along = np.moveaxis(field, axis, -1)
        n = along.shape[-1]
        sums = np.concatenate([np.zeros_like(along[..., :1]), np.cumsum(along, axis=-1)], axis=-1)
        high = np.minimum(np.arange(n) + half + 1, n)
        low = np.maximum(np.arange(n) - half, 0)
        field = np.moveaxis((sums[..., high] - sums[..., low]) / (high - low), -1, axis)
    return field


def orthonormal_directions(candidates: np.ndarray, count: int) -> np.ndarray:
    """directions : (count, M) orthonormal rows that span the leading independent rows of candidates : (n, M).

    Rows are taken in their order and orthogonalised (Gram-Schmidt, twice is enough); one that depends on those before
    it is passed over. A row is a functional of independent standard normals, so the directions are variables of that
    kind again. Raises IllPosedError where fewer than `count` are independent: add candidates.
    """
    directions: list[np.ndarray] = []
    for candidate in candidates:
        norm = np.linalg.norm(candidate)
        if norm == 0:
            continue
        row = candidate / norm
        for _ in range(2):
            for direction in directions:
                row = row - (direction @ row) * direction
        remaining = np.linalg.norm(row)
        if remaining > 1e-6:
            directions.append(row / remaining)
        if len(directions) == count:
            return np.array(directions)
    raise IllPosedError(f"only {len(directions)} of the {count} variables asked for are independent: ask for fewer")


def whitening(samples: np.ndarray) -> np.ndarray:
    """whiten : (n, n) lower triangular, so that whiten @ functional has unit covariance, from samples : (K, n).

    The functionals have mean zero by construction. Raises IllPosedError where they are dependent.
    """
    covariance = samples.T @ samples / len(samples)
    scale = np.sqrt(np.diag(covariance))
    if not np.all(scale > 0):
        raise IllPosedError("a local functional vanishes on every sample: the strip is too narrow for it")
    try:
        factor = scipy.linalg.cholesky(covariance / np.outer(scale, scale), lower=True)
    except np.linalg.LinAlgError as error:
        raise IllPosedError("the local functionals depend on each other: use fewer, or a wider strip") from error
    return scipy.linalg.solve_triangular(factor, np.diag(1.0 / scale), lower=True)
