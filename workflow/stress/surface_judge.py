"""The judge of expansions and embeddings: the covariance matrix from kernels of its own, and what follows from it.

Of an embedding it takes the response of the sampler to one unit of noise, a field as wide as the torus that it reads
window by window; that heights are this response folded with the noise is seen with random noise, and then their
covariance is the sum of its products with itself.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg

from roughslip.surface.embedding import IMAGE_SHARE, Embedding
from roughslip.surface.karhunen_loeve import KarhunenLoeve
from workflow.stress.kernels import ROUNDING, correlation
from workflow.stress.outcomes import Verdict, verdict_of
from workflow.stress.surface_problem import Problem

TOLERANCE = 1e-10  # of eigenvalues and residuals, relative to the largest eigenvalue
MATRIX_ROUNDING = 1e-13  # of an entry of the matrix: its eigenvalues move by so much a node
SHARE_ROUNDING = 1e-9  # of a share at which the number of modes may fall to either side
LAGS = 20
MOST_WINDOWS = 100
IMAGES = 1.1  # on lines longer than 64 nodes not every lag is probed


def matrix_of(problem: Problem) -> np.ndarray:
    """(nx ny, nx ny) [-] correlations of the nodes."""
    grid = problem.grid
    i, j = (np.arange(n) for n in grid.shape)
    lags_x, lags_y = np.arange(1 - grid.nx, grid.nx) * grid.dx, np.arange(1 - grid.ny, grid.ny) * grid.dy
    table = correlation(problem.covariance, lags_x[:, None], lags_y[None, :])
    rows, columns = i[:, None] - i[None, :] + grid.nx - 1, j[:, None] - j[None, :] + grid.ny - 1
    return table[rows[:, None, :, None], columns[None, :, None, :]].reshape(grid.size, grid.size)


def judge_modes(
    problem: Problem, eigenvalues: np.ndarray, vectors: np.ndarray, residuals: np.ndarray, complete: bool
) -> dict[str, tuple[float, float]]:
    """What eigenpairs must meet.

    eigenvalues : (M,) [-] over Sq^2; vectors : (M, nx ny) of unit norm; residuals : (M,) as told
    complete : whether all modes are there
    """
    matrix = matrix_of(problem)
    exact = scipy.linalg.eigvalsh(matrix)
    largest, count = float(exact[-1]), len(eigenvalues)
    rounding = MATRIX_ROUNDING * problem.grid.size / largest
    allowed = TOLERANCE + rounding
    wrong = np.linalg.norm(vectors @ matrix - eigenvalues[:, None] * vectors, axis=1) / largest
    gram = vectors @ vectors.T
    met = {
        "the residual": (wrong.max(), allowed),
        "its residuals": (np.max(wrong - residuals), TOLERANCE / 10 + rounding),
        "eigenvalues": (np.max(np.abs(eigenvalues - exact[::-1][:count])) / largest, allowed),
        "descending": (np.max(np.diff(eigenvalues), initial=0.0) / largest, allowed),
        "orthonormal": (np.abs(gram - np.eye(count)).max(), 1e-10),
    }
    if complete:
        met["the matrix from its modes"] = (
            np.abs((vectors.T * eigenvalues) @ vectors - matrix).max() / largest,
            allowed,
        )
    return met


def judge_expansion(problem: Problem, found: KarhunenLoeve) -> Verdict:
    """Whether an expansion is what it claims."""
    grid, variance = problem.grid, problem.covariance.rms_height_m**2
    shapes = (
        found.modes.shape == (len(found.eigenvalues), *grid.shape) and found.residuals.shape == found.eigenvalues.shape
    )
    if not (shapes and all(np.isfinite(a).all() for a in (found.modes, found.eigenvalues, found.residuals))):
        return Verdict(math.inf, ("fields of another shape, or not finite",))
    eigenvalues = found.eigenvalues / variance
    count = len(eigenvalues)
    kept = eigenvalues > 0  # those that are rounding may be told as zero, and then have no vector
    scaled = found.modes.reshape(count, -1) / problem.covariance.rms_height_m
    vectors = scaled[kept] / np.sqrt(eigenvalues[kept])[:, None]
    met = judge_modes(
        problem, eigenvalues[kept], vectors, found.residuals[kept], bool(kept.all()) and count == grid.size
    )
    exact = np.maximum(scipy.linalg.eigvalsh(matrix_of(problem))[::-1], 0.0)
    slack = SHARE_ROUNDING + MATRIX_ROUNDING * grid.size
    carried = np.cumsum(exact) / grid.size
    i, j = grid.centre
    met |= {
        "modes told as zero": (
            np.max(exact[:count][~kept], initial=0.0),
            (TOLERANCE + MATRIX_ROUNDING * grid.size) * exact[0],
        ),
        "captured variance": (abs(found.captured_variance - carried[count - 1]), slack),
        "captured at the centre": (abs(found.captured_at((i, j)) - np.sum(scaled[:, i * grid.ny + j] ** 2)), slack),
        "variance": (np.abs(found.variance().ravel() / variance - np.sum(scaled**2, axis=0)).max(), 1e-12),
        "the largest entry is positive": (np.max(-vectors.min(axis=1) - vectors.max(axis=1), initial=0.0), 1e-8),
    }
    if problem.order is not None:
        met["its order"] = (abs(count - problem.order), 0)
    else:
        met["carries the share"] = (problem.share - carried[count - 1], slack)
        met["with no mode too many"] = ((carried[count - 2] if count > 1 else 0.0) - problem.share, slack)
    return verdict_of(met)


class Noise:
    """A generator whose normal variables are given."""

    def __init__(self, values: np.ndarray) -> None:
        self.values = values

    def standard_normal(self, size: tuple[int, int]) -> np.ndarray:
        if size != self.values.shape:
            raise ValueError(f"noise of {size} is asked for, not {self.values.shape}")
        return self.values.copy()


def response(embedding: Embedding) -> np.ndarray:
    """(torus) [m] heights by one unit of noise, lag zero first, read through the window of the mesh.

    Of a torus of more than so many windows the transform of the root is taken; linearity is then seen against it.
    """
    (m, n), (nx, ny) = embedding.torus, embedding.grid.shape
    if m * n > MOST_WINDOWS * nx * ny:
        return np.fft.irfft2(embedding.root, s=embedding.torus)
    filter_ = np.empty(embedding.torus)
    for i in range(0, m, nx):
        for j in range(0, n, ny):
            unit = np.zeros(embedding.torus)
            unit[-i % m, -j % n] = 1.0
            part = filter_[i : i + nx, j : j + ny]
            part[...] = embedding.sample(Noise(unit))[: part.shape[0], : part.shape[1]]  # type: ignore[arg-type]
    return filter_


def judge_embedding(problem: Problem, embedding: Embedding) -> Verdict:
    """Whether samples have the covariance asked for, at lags of the mesh at random and at its corners."""
    grid, rms = problem.grid, problem.covariance.rms_height_m
    generator = np.random.default_rng([problem.number, 3])
    filter_ = response(embedding) / rms
    noise = generator.standard_normal(embedding.torus)
    heights = embedding.sample(Noise(noise)) / rms  # type: ignore[arg-type]
    if heights.shape != grid.shape or not (np.isfinite(heights).all() and np.isfinite(filter_).all()):
        return Verdict(math.inf, ("heights of another shape, or not finite",))
    node = tuple(int(generator.integers(n)) for n in grid.shape)
    turned = np.roll(filter_[::-1, ::-1], (node[0] + 1, node[1] + 1), (0, 1))  # of the noise that reaches the node
    i = np.append(generator.integers(0, grid.nx, LAGS), [0, 0, grid.nx - 1, grid.nx - 1, grid.nx - 1])
    j = np.append(generator.integers(1 - grid.ny, grid.ny, LAGS), [0, grid.ny - 1, 0, grid.ny - 1, 1 - grid.ny])
    asked = correlation(problem.covariance, i * grid.dx, j * grid.dy)
    found = np.array([np.sum(filter_ * np.roll(filter_, (k, m), (0, 1))) for k, m in zip(i, j, strict=True)])
    limit = ROUNDING * math.log2(filter_.size + 2) + 3 * embedding.clipped_variance
    fall = float(1 - correlation(problem.covariance, *_corners(problem)).min())
    limit += IMAGES * embedding.image_share * fall
    met = {
        "the covariance": (np.abs(found - asked).max(), limit),
        "linear in its noise": (abs(heights[node] - np.sum(turned * noise)), 1e-12 * math.sqrt(filter_.size)),
        "clipped variance": (embedding.clipped_variance, 1e-6),
        "image share": (embedding.image_share, IMAGE_SHARE),
    }
    return verdict_of(met)


def _corners(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """All lags of the mesh, a half plane of them."""
    grid = problem.grid
    return (np.arange(grid.nx) * grid.dx)[:, None], (np.arange(1 - grid.ny, grid.ny) * grid.dy)[None, :]
