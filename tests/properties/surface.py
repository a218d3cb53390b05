"""Surfaces: random fields on meshes, each answer judged.

Heights and cells are drawn from 1e-12 m to 1e3 m, each for itself. Expansions are judged by the covariance matrix of
all nodes. Embeddings are judged by the filter of the sampler, a field as wide as the torus. Random noise shows that
heights are this filter convolved with the noise. Their covariance is then the sum of products of the filter with
itself.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg

from roughslip.errors import IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.surface.covariance import Covariance
from roughslip.surface.embedding import IMAGE_SHARE, MOST_FOLDS, embed
from roughslip.surface.models import MODELS, covariance_of
from roughslip.surface.modes import KarhunenLoeve, karhunen_loeve, leading_modes
from tests.properties.campaign import Trial, choose, log_uniform

ENTRIES, ENTRY_SHARES = ("expansion", "lanczos", "embedding"), (0.5, 0.2, 0.3)
MOST_NODES, LONGEST_LINE = 24, 200  # on an axis of a mesh, and of a line
MOST_EMBEDDED = 60_000  # nodes of a torus that holds the reach of the covariance on both sides

TOLERANCE = 1e-10  # of eigenvalues and residuals, relative to the largest eigenvalue
MATRIX_ROUNDING = 1e-13  # of an entry of the matrix; eigenvalues move by as much for each node
SHARE_ROUNDING = 1e-9  # of a share, within which the number of modes may be one more or less
LAG_ROUNDING = 1e-12  # of a correlation
LARGEST_SHAPE = 100.0  # of a covariance, where its model bears any
LAGS, NODES = 20, 3
IMAGES = 1.1  # of the image share: on lines longer than 64 nodes the package does not try every lag


def attempt(trial: Trial) -> None:
    """Expand or embed a field."""
    rng, entry = trial.rng, choose(trial.rng, ENTRIES, ENTRY_SHARES)
    while True:
        grid = draw_mesh(rng, 4 if entry == "lanczos" else 1)
        covariance = draw_covariance(rng, grid)
        if entry != "embedding" or largest_torus(covariance, grid) <= MOST_EMBEDDED:
            break
    trial.case |= {"entry": entry, "covariance": covariance.kind, "nx": grid.nx, "ny": grid.ny}
    if entry == "embedding":
        judge_embedding(trial, covariance, grid)
    elif entry == "lanczos":
        trial.case["order"] = order = int(rng.integers(1, grid.size // 4 + 1))
        judge_modes(trial, *spectrum(covariance, grid), *leading_modes(covariance, grid, order))
    else:
        order = grid.size if rng.random() < 0.3 else int(rng.integers(1, grid.size + 1))
        trial.case["order"] = order
        judge_expansion(trial, covariance, karhunen_loeve(covariance, grid, order), grid, order)


def draw_covariance(rng: np.random.Generator, grid: Grid) -> Covariance:
    """Draw a covariance of any kind, from far shorter than a cell to far longer than the mesh."""
    kind, cell = choose(rng, tuple(MODELS)), math.sqrt(grid.cell_area)
    length = cell * log_uniform(rng, -1, 2) if rng.random() < 0.9 else cell * log_uniform(rng, -3, 4)
    across = length * log_uniform(rng, -1.5, 1.5) if rng.random() < 0.4 else length
    lay = choose(rng, (0.0, math.pi / 2, math.pi / 4, float(rng.uniform(-4, 4))), (0.4, 0.1, 0.1, 0.4))
    shapes = {}
    for name, (low, high) in MODELS[kind].shapes.items():
        most = min(high, LARGEST_SHAPE)
        shapes[name] = choose(rng, (low, most, low * (most / low) ** rng.random()), (0.05, 0.05, 0.9))
    return covariance_of(kind, log_uniform(rng, -12, 3), length, across, lay, **shapes)


def draw_mesh(rng: np.random.Generator, minimum: int) -> Grid:
    """Draw rectangles, lines and squares; cells of aspect 1/30 to 30, of 1e-12 to 1e3 m."""
    nx = ny = 0
    while nx * ny < minimum:
        kind = rng.random()
        nx, ny = (round(MOST_NODES ** rng.random()) for _ in range(2))
        if kind < 0.2:
            line = round(LONGEST_LINE ** rng.random())
            nx, ny = (1, line) if rng.random() < 0.5 else (line, 1)
        elif kind < 0.45:
            ny = nx
    edge = log_uniform(rng, -12, 3)
    aspect = 1.0 if rng.random() < 0.5 else log_uniform(rng, -1.5, 1.5)
    return Grid(nx, ny, edge * max(aspect, 1.0), edge * max(1 / aspect, 1.0))


def largest_torus(covariance: Covariance, grid: Grid) -> float:
    """Return about the number of nodes of the largest torus that an embedding may reach."""
    if covariance.kind == "self_affine":
        longest, edge = max(covariance.rolloff_wavelengths_m), min(grid.nx * grid.dx, grid.ny * grid.dy)
        return 10.0 * grid.size * max(1.0, longest / edge) ** 2
    reach = covariance.reach_m
    return (grid.nx + 2 * reach[0] / grid.dx) * (grid.ny + 2 * reach[1] / grid.dy)


def correlations(covariance: Covariance, grid: Grid) -> np.ndarray:
    """Return (2 nx - 1, 2 ny - 1) [-] correlations at all lags of the mesh, lag zero in the middle."""
    x, y = np.arange(1 - grid.nx, grid.nx) * grid.dx, np.arange(1 - grid.ny, grid.ny) * grid.dy
    return covariance(x[:, None], y) / covariance.rms_height_m**2


def spectrum(covariance: Covariance, grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrix (nx ny, nx ny) [-] of correlations of the nodes, and its eigenvalues, descending."""
    rows, columns = (np.subtract.outer(np.arange(n), np.arange(n)) + n - 1 for n in grid.shape)
    table = correlations(covariance, grid)
    matrix = table[rows[:, None, :, None], columns[None, :, None, :]].reshape(grid.size, grid.size)
    return matrix, scipy.linalg.eigvalsh(matrix)[::-1]


def judge_modes(
    trial: Trial, matrix: np.ndarray, exact: np.ndarray, eigenvalues: np.ndarray, vectors: np.ndarray
) -> None:
    """Check eigenvalues (M,) [-] over Sq^2, their vectors (M, nx ny) of unit norm."""
    largest, count = exact[0], len(eigenvalues)
    rounding = MATRIX_ROUNDING * len(matrix) / largest
    allowed = TOLERANCE + rounding
    wrong = np.linalg.norm(vectors @ matrix - eigenvalues[:, None] * vectors, axis=1) / largest
    trial.check("the residual", wrong.max(), allowed)
    trial.check("eigenvalues", np.max(np.abs(eigenvalues - exact[:count])) / largest, allowed)
    trial.check("descending", np.max(np.diff(eigenvalues), initial=0.0) / largest, allowed)
    trial.check("orthonormal", np.abs(vectors @ vectors.T - np.eye(count)).max(), 1e-10)


def judge_expansion(trial: Trial, covariance: Covariance, expansion: KarhunenLoeve, grid: Grid, order: int) -> None:
    """Check an expansion: its eigenpairs, its variance and its number of modes."""
    rms, count = covariance.rms_height_m, len(expansion.eigenvalues)
    assert expansion.modes.shape == (count, *grid.shape), "fields of another shape"
    assert all(np.isfinite(a).all() for a in (expansion.modes, expansion.eigenvalues)), "not finite"
    eigenvalues, scaled = expansion.eigenvalues / rms**2, expansion.modes.reshape(count, -1) / rms
    kept = eigenvalues > 0  # Eigenvalues within rounding may be stated as zero, and then have no vector.
    vectors = scaled[kept] / np.sqrt(eigenvalues[kept])[:, None]
    matrix, exact = spectrum(covariance, grid)
    judge_modes(trial, matrix, exact, eigenvalues[kept], vectors)
    exact, (i, j), rounding = np.maximum(exact, 0.0), grid.centre, MATRIX_ROUNDING * grid.size
    slack, carried = SHARE_ROUNDING + rounding, np.cumsum(exact) / grid.size
    at_centre = np.sum(scaled[:, i * grid.ny + j] ** 2)
    zero = np.max(exact[:count][~kept], initial=0.0)
    trial.check("modes stated as zero", zero, (TOLERANCE + rounding) * exact[0])
    trial.check("captured variance", abs(expansion.captured_variance - carried[count - 1]), slack)
    trial.check("captured at the centre", abs(expansion.captured_at((i, j)) - at_centre), slack)
    trial.check("the largest entry is positive", np.max(-vectors.min(axis=1) - vectors.max(axis=1), initial=0.0), 1e-8)
    trial.check("its order", abs(count - order))


def judge_embedding(trial: Trial, covariance: Covariance, grid: Grid) -> None:
    """Check the covariance of samples, at random lags of the mesh and at its corners.

    A self-affine field may be refused if its waves are far longer than the mesh, or below its cells.
    """
    if covariance.kind == "self_affine":
        folds = max(grid.dx, grid.dy) / min(covariance.cutoff_wavelengths_m) > MOST_FOLDS
        far = max(covariance.rolloff_wavelengths_m) > min(grid.nx * grid.dx, grid.ny * grid.dy)
        trial.answers = (ParameterError,) * folds + (IllPosedError,) * far
    embedding, rng = embed(covariance, grid), np.random.default_rng([trial.number, 3])
    trial.answers, rms = (), covariance.rms_height_m
    filter_ = np.fft.irfft2(embedding.root, s=embedding.torus) / rms
    noise = rng.standard_normal(embedding.torus)
    heights = embedding.sample(np.random.default_rng([trial.number, 3])) / rms  # of the same noise
    assert heights.shape == grid.shape, "heights of another shape"
    assert all(np.isfinite(field).all() for field in (heights, filter_)), "heights that are not finite"
    nodes = [tuple(int(rng.integers(n)) for n in grid.shape) for _ in range(NODES)]
    weights = (np.roll(filter_[::-1, ::-1], (i + 1, j + 1), (0, 1)) for i, j in nodes)  # of the noise at a node
    unlike = [abs(heights[node] - np.sum(weight * noise)) for node, weight in zip(nodes, weights, strict=True)]
    i = np.append(rng.integers(0, grid.nx, LAGS), [0, 0, grid.nx - 1, grid.nx - 1, grid.nx - 1])
    j = np.append(rng.integers(1 - grid.ny, grid.ny, LAGS), [0, grid.ny - 1, 0, grid.ny - 1, 1 - grid.ny])
    table = correlations(covariance, grid)
    asked = table[i + grid.nx - 1, j + grid.ny - 1]
    covariances = np.array([np.sum(filter_ * np.roll(filter_, (k, m), (0, 1))) for k, m in zip(i, j, strict=True)])
    limit = LAG_ROUNDING * math.log2(filter_.size + 2) + 3 * embedding.clipped_variance
    limit += IMAGES * embedding.image_share * (1 - table.min())
    trial.check("the covariance", np.abs(covariances - asked).max(), limit)
    trial.check("the filtered noise", max(unlike), 1e-12 * math.sqrt(filter_.size))
    trial.check("clipped variance", embedding.clipped_variance, 1e-6)
    trial.check("image share", embedding.image_share, IMAGE_SHARE)
