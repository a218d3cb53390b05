"""Stress campaign of surfaces: random fields on meshes, each answer judged. One in ten is a fit (`surface_fit`).

Heights and cells are drawn from 1e-12 m to 1e3 m, each for itself. The problem is linear in the variance, and only
lengths over cells count.

The judge of expansions solves the covariance matrix of all nodes. The judge of embeddings takes the filter of the
sampler, a field as wide as the torus. Random noise shows that heights are this filter convolved with the noise. Their
covariance is then the sum of products of the filter with itself.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from roughslip.errors import IllPosedError, ParameterError, RoughslipError
from roughslip.grid import Grid
from roughslip.surface.covariance import Covariance
from roughslip.surface.embedding import IMAGE_SHARE, MOST_FOLDS, Embedding, embed
from roughslip.surface.lanczos import leading_modes
from roughslip.surface.models import KINDS, covariance_of
from roughslip.surface.modes import KarhunenLoeve, karhunen_loeve
from workflow.evidence.rows import Row
from workflow.stress import runner, surface_fit
from workflow.stress.runner import Conditions, Verdict, choose, has_advice, log_uniform, verdict_of

STAGE = "surface"
PROBLEMS = 2000
FITS = 10  # One problem in so many is a fit.

ENTRIES = ("expansion", "lanczos", "embedding")
ENTRY_SHARES = (0.5, 0.2, 0.3)
MOST_NODES = 24  # on an axis of a mesh
LONGEST_LINE = 200
MOST_EMBEDDED = 60_000  # nodes of a torus that holds the reach of the covariance on both sides

TOLERANCE = 1e-10  # of eigenvalues and residuals, relative to the largest eigenvalue
MATRIX_ROUNDING = 1e-13  # of an entry of the matrix; eigenvalues move by as much for each node
SHARE_ROUNDING = 1e-9  # of a share, within which the number of modes may be one more or less
LAG_ROUNDING = 1e-12  # of a correlation
LAGS, NODES = 20, 3
IMAGES = 1.1  # of the image share: on lines longer than 64 nodes the package does not try every lag


@dataclass(frozen=True)
class FieldProblem:
    """A field on a mesh.

    number, entry : of the problem, of ENTRIES
    grid, covariance : of the field
    order, share : of the expansion, one of them; both None for an embedding
    """

    number: int
    entry: str
    grid: Grid
    covariance: Covariance
    order: int | None
    share: float | None


def random_problem(seed: int, number: int) -> FieldProblem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number])
    entry = choose(generator, ENTRIES, ENTRY_SHARES)
    while True:
        grid = _mesh(generator, 4 if entry == "lanczos" else 1)
        covariance = _covariance(generator, grid)
        if entry != "embedding" or _torus(covariance, grid) <= MOST_EMBEDDED:
            break
    order = share = None
    if entry == "lanczos":
        order = int(generator.integers(1, grid.size // 4 + 1))
    elif entry == "expansion":
        if generator.random() < 0.35:
            share = choose(generator, (1.0, float(generator.uniform(1e-6, 1.0)), 1.0 - log_uniform(generator, -9, -1)))
        else:
            order = grid.size if generator.random() < 0.3 else int(generator.integers(1, grid.size + 1))
    return FieldProblem(number, entry, grid, covariance, order, share)


def _covariance(generator: np.random.Generator, grid: Grid) -> Covariance:
    """Draw a covariance of any kind, from far shorter than a cell to far longer than the mesh."""
    kind = choose(generator, KINDS)
    cell = math.sqrt(grid.cell_area)
    length = cell * log_uniform(generator, -1, 2) if generator.random() < 0.9 else cell * log_uniform(generator, -3, 4)
    across = length * log_uniform(generator, -1.5, 1.5) if generator.random() < 0.4 else length
    lay = choose(generator, (0.0, math.pi / 2, math.pi / 4, float(generator.uniform(-4, 4))), (0.4, 0.1, 0.1, 0.4))
    shapes: dict[str, float] = {}
    if kind == "matern":
        shapes["smoothness"] = choose(generator, (0.05, 0.5, 1.5, 20.0, log_uniform(generator, -1.3, 1.3)))
    elif kind == "self_affine":
        shapes["hurst"] = choose(generator, (0.01, 0.5, 1.0, float(generator.uniform(0.01, 1.0))), (0.1, 0.1, 0.1, 0.7))
        narrow = generator.random() < 0.05
        shapes["bandwidth"] = 1.0 + (log_uniform(generator, -5, -1) if narrow else log_uniform(generator, -1, 2))
    return covariance_of(kind, log_uniform(generator, -12, 3), length, across, lay, **shapes)


def _mesh(generator: np.random.Generator, least: int) -> Grid:
    """Draw rectangles, lines and squares; cells of aspect 1/30 to 30, of 1e-12 to 1e3 m."""
    nx = ny = 0
    while nx * ny < least:
        kind = generator.random()
        nx, ny = (round(MOST_NODES ** generator.random()) for _ in range(2))
        if kind < 0.2:
            line = round(LONGEST_LINE ** generator.random())
            nx, ny = (1, line) if generator.random() < 0.5 else (line, 1)
        elif kind < 0.45:
            ny = nx
    edge = log_uniform(generator, -12, 3)
    aspect = 1.0 if generator.random() < 0.5 else log_uniform(generator, -1.5, 1.5)
    return Grid(nx, ny, edge * max(aspect, 1.0), edge * max(1 / aspect, 1.0))


def _torus(covariance: Covariance, grid: Grid) -> float:
    """Return about the number of nodes of the largest torus that an embedding may reach."""
    if covariance.kind == "self_affine":
        longest, edge = max(covariance.rolloff_wavelengths_m), min(grid.nx * grid.dx, grid.ny * grid.dy)
        return 10.0 * grid.size * max(1.0, longest / edge) ** 2
    reach = covariance.reach_m
    return (grid.nx + 2 * reach[0] / grid.dx) * (grid.ny + 2 * reach[1] / grid.dy)


def row_of(seed: int, number: int) -> Row:
    """Return the row of the problem of this number."""
    if number % FITS == FITS - 1:
        fit = surface_fit.random_problem(seed, number)
        return runner.problem_row(STAGE, fit, surface_fit.judged, surface_fit.is_answer)
    return runner.problem_row(STAGE, random_problem(seed, number), judged, is_answer)


def is_answer(problem: FieldProblem, error: RoughslipError) -> bool:
    """Whether an error answers a problem: waves of a self-affine field far longer than the mesh, or below its cells."""
    covariance, grid = problem.covariance, problem.grid
    if problem.entry != "embedding" or covariance.kind != "self_affine" or not has_advice(error):
        return False
    longest, shortest = max(covariance.rolloff_wavelengths_m), min(covariance.cutoff_wavelengths_m)
    folds = max(grid.dx, grid.dy) / shortest > MOST_FOLDS
    far = longest > min(grid.nx * grid.dx, grid.ny * grid.dy)
    return folds if isinstance(error, ParameterError) else isinstance(error, IllPosedError) and far


def judged(problem: FieldProblem) -> Verdict:
    """Expand or embed the field and judge the result."""
    covariance, grid = problem.covariance, problem.grid
    if problem.entry == "embedding":
        return judge_embedding(problem, embed(covariance, grid))
    if problem.entry == "expansion":
        return judge_expansion(problem, karhunen_loeve(covariance, grid, problem.order, share=problem.share))
    return verdict_of(judge_modes(problem, *leading_modes(covariance, grid, problem.order or 1)))


def correlations(problem: FieldProblem) -> np.ndarray:
    """Return (2 nx - 1, 2 ny - 1) [-] correlations at all lags of the mesh, lag zero in the middle."""
    grid, covariance = problem.grid, problem.covariance
    x, y = np.arange(1 - grid.nx, grid.nx) * grid.dx, np.arange(1 - grid.ny, grid.ny) * grid.dy
    return covariance(x[:, None], y) / covariance.rms_height_m**2


def matrix_of(problem: FieldProblem) -> np.ndarray:
    """Return (nx ny, nx ny) [-] correlations of the nodes."""
    grid, table = problem.grid, correlations(problem)
    rows, columns = (np.subtract.outer(np.arange(n), np.arange(n)) + n - 1 for n in grid.shape)
    return table[rows[:, None, :, None], columns[None, :, None, :]].reshape(grid.size, grid.size)


def judge_modes(
    problem: FieldProblem, eigenvalues: np.ndarray, vectors: np.ndarray, residuals: np.ndarray
) -> Conditions:
    """Return conditions on eigenpairs.

    eigenvalues : (M,) [-] over Sq^2
    vectors : (M, nx ny) of unit norm
    residuals : (M,) as the package states them
    """
    matrix = matrix_of(problem)
    exact = scipy.linalg.eigvalsh(matrix)
    largest, count = float(exact[-1]), len(eigenvalues)
    rounding = MATRIX_ROUNDING * problem.grid.size / largest
    allowed = TOLERANCE + rounding
    wrong = np.linalg.norm(vectors @ matrix - eigenvalues[:, None] * vectors, axis=1) / largest
    return {
        "the residual": (wrong.max(), allowed),
        "its residuals": (np.max(wrong - residuals), TOLERANCE / 10 + rounding),
        "eigenvalues": (np.max(np.abs(eigenvalues - exact[::-1][:count])) / largest, allowed),
        "descending": (np.max(np.diff(eigenvalues), initial=0.0) / largest, allowed),
        "orthonormal": (np.abs(vectors @ vectors.T - np.eye(count)).max(), 1e-10),
    }


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
    conditions = judge_modes(problem, eigenvalues[kept], vectors, found.residuals[kept])
    exact = np.maximum(scipy.linalg.eigvalsh(matrix_of(problem))[::-1], 0.0)
    rounding = MATRIX_ROUNDING * grid.size
    slack = SHARE_ROUNDING + rounding
    carried = np.cumsum(exact) / grid.size
    i, j = grid.centre
    conditions |= {
        "modes stated as zero": (np.max(exact[:count][~kept], initial=0.0), (TOLERANCE + rounding) * exact[0]),
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


def judge_embedding(problem: FieldProblem, embedding: Embedding) -> Verdict:
    """Return the verdict on the covariance of samples, at random lags of the mesh and at its corners."""
    grid, rms = problem.grid, problem.covariance.rms_height_m
    generator = np.random.default_rng([problem.number, 3])
    filter_ = np.fft.irfft2(embedding.root, s=embedding.torus) / rms
    noise = generator.standard_normal(embedding.torus)
    heights = embedding.sample(Noise(noise)) / rms  # type: ignore[arg-type]
    if heights.shape != grid.shape or not (np.isfinite(heights).all() and np.isfinite(filter_).all()):
        return Verdict(math.inf, ("heights of another shape, or not finite",))
    nodes = [tuple(int(generator.integers(n)) for n in grid.shape) for _ in range(NODES)]
    weights = (np.roll(filter_[::-1, ::-1], (i + 1, j + 1), (0, 1)) for i, j in nodes)  # of the noise at a node
    unlike = [abs(heights[node] - np.sum(weight * noise)) for node, weight in zip(nodes, weights, strict=True)]
    i = np.append(generator.integers(0, grid.nx, LAGS), [0, 0, grid.nx - 1, grid.nx - 1, grid.nx - 1])
    j = np.append(generator.integers(1 - grid.ny, grid.ny, LAGS), [0, grid.ny - 1, 0, grid.ny - 1, 1 - grid.ny])
    table = correlations(problem)
    asked = table[i + grid.nx - 1, j + grid.ny - 1]
    found = np.array([np.sum(filter_ * np.roll(filter_, (k, m), (0, 1))) for k, m in zip(i, j, strict=True)])
    limit = LAG_ROUNDING * math.log2(filter_.size + 2) + 3 * embedding.clipped_variance
    conditions: Conditions = {
        "the covariance": (np.abs(found - asked).max(), limit + IMAGES * embedding.image_share * (1 - table.min())),
        "the filtered noise": (max(unlike), 1e-12 * math.sqrt(filter_.size)),
        "clipped variance": (embedding.clipped_variance, 1e-6),
        "image share": (embedding.image_share, IMAGE_SHARE),
    }
    return verdict_of(conditions)


if __name__ == "__main__":
    sys.exit(runner.command(__doc__, STAGE, row_of, PROBLEMS))
