"""Stress campaign of surfaces: random fields, height distributions and fits of covariances, each answer judged.

`python -m workflow.stress.surface -j 2 --output results/stress/surface.json` runs the campaign; `--only 17` runs one
problem. Six problems of ten are fields on meshes (here), three are height distributions and sums of waves
(`surface_heights`), and one is a fit (`surface_fit`).

The judge of expansions builds the covariance matrix from kernels of its own. The judge of embeddings takes the response
of the sampler to one unit of noise, a field as wide as the torus, window by window. Random noise shows that heights are
this response convolved with the noise. Their covariance is then the sum of products of the response with itself.
"""

from __future__ import annotations

import math
import sys
from functools import partial

import numpy as np
import scipy.linalg

from roughslip.errors import IllPosedError, ParameterError, RoughslipError
from roughslip.surface.embedding import IMAGE_SHARE, MOST_FOLDS, Embedding, embed
from roughslip.surface.karhunen_loeve import KarhunenLoeve, karhunen_loeve
from roughslip.surface.lanczos import leading_modes
from workflow.evidence.rows import Row
from workflow.stress import runner, surface_fit, surface_heights
from workflow.stress.kernels import ROUNDING, correlation
from workflow.stress.runner import Conditions, Verdict, has_advice, verdict_of
from workflow.stress.surface_problem import FieldProblem, random_problem

STAGE = "surface"
PROBLEMS = 2000
HEIGHTS, FIT = (2, 5, 8), 9  # last digits of the numbers of their problems

TOLERANCE = 1e-10  # of eigenvalues and residuals, relative to the largest eigenvalue
MATRIX_ROUNDING = 1e-13  # of an entry of the matrix; eigenvalues move by as much for each node
SHARE_ROUNDING = 1e-9  # of a share, within which the number of modes may be one more or less
LAGS = 20
MOST_WINDOWS = 100
IMAGES = 1.1  # of the image share: on lines longer than 64 nodes the package does not try every lag


def row_of(seed: int, number: int) -> Row:
    """Return the row of the problem of this number."""
    digit = number % 10
    if digit in HEIGHTS or digit == FIT:
        part = surface_fit if digit == FIT else surface_heights
        problem, judge, answers = part.random_problem(seed, number), part.judged, part.is_answer
    else:
        problem, judge, answers = random_problem(seed, number), judged, is_answer
    return runner.problem_row(STAGE, runner.case_of(problem), partial(judge, problem), partial(answers, problem))


def judged(problem: FieldProblem) -> Verdict:
    """Expand or embed the field and judge the result."""
    covariance, grid = problem.covariance, problem.grid
    if problem.entry == "embedding":
        return judge_embedding(problem, embed(covariance, grid))
    if problem.entry == "expansion":
        return judge_expansion(problem, karhunen_loeve(covariance, grid, problem.order, share=problem.share))
    eigenvalues, vectors, residuals = leading_modes(covariance, grid, problem.order or 1)
    return verdict_of(judge_modes(problem, eigenvalues, vectors, residuals, False))


def is_answer(problem: FieldProblem, error: RoughslipError) -> bool:
    """Whether an error answers a problem: waves of a self-affine field far longer than the mesh, or below its cells."""
    covariance, grid = problem.covariance, problem.grid
    if problem.entry != "embedding" or covariance.kind != "self_affine" or not has_advice(error):
        return False
    longest, shortest = max(covariance.rolloff_wavelengths_m), min(covariance.cutoff_wavelengths_m)
    folds = max(grid.dx, grid.dy) / shortest > MOST_FOLDS
    far = longest > min(grid.nx * grid.dx, grid.ny * grid.dy)
    return folds if isinstance(error, ParameterError) else isinstance(error, IllPosedError) and far


def matrix_of(problem: FieldProblem) -> np.ndarray:
    """Return (nx ny, nx ny) [-] correlations of the nodes."""
    grid = problem.grid
    i, j = (np.arange(n) for n in grid.shape)
    lags_x, lags_y = np.arange(1 - grid.nx, grid.nx) * grid.dx, np.arange(1 - grid.ny, grid.ny) * grid.dy
    table = correlation(problem.covariance, lags_x[:, None], lags_y[None, :])
    rows, columns = i[:, None] - i[None, :] + grid.nx - 1, j[:, None] - j[None, :] + grid.ny - 1
    return table[rows[:, None, :, None], columns[None, :, None, :]].reshape(grid.size, grid.size)


def judge_modes(
    problem: FieldProblem, eigenvalues: np.ndarray, vectors: np.ndarray, residuals: np.ndarray, complete: bool
) -> Conditions:
    """Return conditions on eigenpairs.

    eigenvalues : (M,) [-] over Sq^2
    vectors : (M, nx ny) of unit norm
    residuals : (M,) as the package states them
    complete : whether all modes are present
    """
    matrix = matrix_of(problem)
    exact = scipy.linalg.eigvalsh(matrix)
    largest, count = float(exact[-1]), len(eigenvalues)
    rounding = MATRIX_ROUNDING * problem.grid.size / largest
    allowed = TOLERANCE + rounding
    wrong = np.linalg.norm(vectors @ matrix - eigenvalues[:, None] * vectors, axis=1) / largest
    gram = vectors @ vectors.T
    conditions = {
        "the residual": (wrong.max(), allowed),
        "its residuals": (np.max(wrong - residuals), TOLERANCE / 10 + rounding),
        "eigenvalues": (np.max(np.abs(eigenvalues - exact[::-1][:count])) / largest, allowed),
        "descending": (np.max(np.diff(eigenvalues), initial=0.0) / largest, allowed),
        "orthonormal": (np.abs(gram - np.eye(count)).max(), 1e-10),
    }
    if complete:
        conditions["the matrix from its modes"] = (
            np.abs((vectors.T * eigenvalues) @ vectors - matrix).max() / largest,
            allowed,
        )
    return conditions


def judge_expansion(problem: FieldProblem, found: KarhunenLoeve) -> Verdict:
    """Return the verdict on an expansion: its eigenpairs, its variance and its number of modes."""
    grid, variance = problem.grid, problem.covariance.rms_height_m**2
    shapes = (
        found.modes.shape == (len(found.eigenvalues), *grid.shape) and found.residuals.shape == found.eigenvalues.shape
    )
    if not (shapes and all(np.isfinite(a).all() for a in (found.modes, found.eigenvalues, found.residuals))):
        return Verdict(math.inf, ("fields of another shape, or not finite",))
    eigenvalues = found.eigenvalues / variance
    count = len(eigenvalues)
    kept = eigenvalues > 0  # Eigenvalues within rounding may be stated as zero, and then have no vector.
    scaled = found.modes.reshape(count, -1) / problem.covariance.rms_height_m
    vectors = scaled[kept] / np.sqrt(eigenvalues[kept])[:, None]
    conditions = judge_modes(
        problem, eigenvalues[kept], vectors, found.residuals[kept], bool(kept.all()) and count == grid.size
    )
    exact = np.maximum(scipy.linalg.eigvalsh(matrix_of(problem))[::-1], 0.0)
    slack = SHARE_ROUNDING + MATRIX_ROUNDING * grid.size
    carried = np.cumsum(exact) / grid.size
    i, j = grid.centre
    conditions |= {
        "modes stated as zero": (
            np.max(exact[:count][~kept], initial=0.0),
            (TOLERANCE + MATRIX_ROUNDING * grid.size) * exact[0],
        ),
        "captured variance": (abs(found.captured_variance - carried[count - 1]), slack),
        "captured at the centre": (abs(found.captured_at((i, j)) - np.sum(scaled[:, i * grid.ny + j] ** 2)), slack),
        "variance": (np.abs(found.variance().ravel() / variance - np.sum(scaled**2, axis=0)).max(), 1e-12),
        "the largest entry is positive": (np.max(-vectors.min(axis=1) - vectors.max(axis=1), initial=0.0), 1e-8),
    }
    if problem.order is not None:
        conditions["its order"] = (abs(count - problem.order), 0)
    else:
        conditions["carries the share"] = (problem.share - carried[count - 1], slack)
        conditions["with no mode too many"] = ((carried[count - 2] if count > 1 else 0.0) - problem.share, slack)
    return verdict_of(conditions)


class Noise:
    """A generator that returns given normal variables."""

    def __init__(self, values: np.ndarray) -> None:
        self.values = values

    def standard_normal(self, size: tuple[int, int]) -> np.ndarray:
        if size != self.values.shape:
            raise ValueError(f"the noise has the shape {self.values.shape}, the sampler needs {size}")
        return self.values.copy()


def response(embedding: Embedding) -> np.ndarray:
    """Return heights (torus) [m] from one unit of noise, lag zero first, read through windows of the mesh.

    For a torus of more than MOST_WINDOWS windows this is the transform of the root.
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


def judge_embedding(problem: FieldProblem, embedding: Embedding) -> Verdict:
    """Return the verdict on the covariance of samples, at random lags of the mesh and at its corners."""
    grid, rms = problem.grid, problem.covariance.rms_height_m
    generator = np.random.default_rng([problem.number, 3])
    filter_ = response(embedding) / rms
    noise = generator.standard_normal(embedding.torus)
    heights = embedding.sample(Noise(noise)) / rms  # type: ignore[arg-type]
    if heights.shape != grid.shape or not (np.isfinite(heights).all() and np.isfinite(filter_).all()):
        return Verdict(math.inf, ("heights of another shape, or not finite",))
    node = tuple(int(generator.integers(n)) for n in grid.shape)
    turned = np.roll(filter_[::-1, ::-1], (node[0] + 1, node[1] + 1), (0, 1))  # the weights of the noise at the node
    i = np.append(generator.integers(0, grid.nx, LAGS), [0, 0, grid.nx - 1, grid.nx - 1, grid.nx - 1])
    j = np.append(generator.integers(1 - grid.ny, grid.ny, LAGS), [0, grid.ny - 1, 0, grid.ny - 1, 1 - grid.ny])
    asked = correlation(problem.covariance, i * grid.dx, j * grid.dy)
    found = np.array([np.sum(filter_ * np.roll(filter_, (k, m), (0, 1))) for k, m in zip(i, j, strict=True)])
    limit = ROUNDING * math.log2(filter_.size + 2) + 3 * embedding.clipped_variance
    lags = (np.arange(grid.nx) * grid.dx)[:, None], (np.arange(1 - grid.ny, grid.ny) * grid.dy)[None, :]
    fall = float(1 - correlation(problem.covariance, *lags).min())
    limit += IMAGES * embedding.image_share * fall
    conditions = {
        "the covariance": (np.abs(found - asked).max(), limit),
        "linear in its noise": (abs(heights[node] - np.sum(turned * noise)), 1e-12 * math.sqrt(filter_.size)),
        "clipped variance": (embedding.clipped_variance, 1e-6),
        "image share": (embedding.image_share, IMAGE_SHARE),
    }
    return verdict_of(conditions)


if __name__ == "__main__":
    sys.exit(runner.command(__doc__, STAGE, row_of, PROBLEMS))
