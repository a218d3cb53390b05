"""Campaign of surfaces: random fields on meshes, each answer judged; one problem in ten is a fit to a table of lags.

Heights and cells are drawn from 1e-12 m to 1e3 m, each for itself. The problem is linear in the variance, and only
lengths over cells count.

The judge of expansions solves the covariance matrix of all nodes. The judge of embeddings takes the filter of the
sampler, a field as wide as the torus. Random noise shows that heights are this filter convolved with the noise. Their
covariance is then the sum of products of the filter with itself.

Without errors a fit must return the model where the lags determine it. In all fits the answer must be a minimum of the
squares: no step of a parameter may lower them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import scipy.linalg

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError, RoughslipError
from roughslip.grid import Grid
from roughslip.scan.covariance_fit import CovarianceFit, fit_covariance
from roughslip.scan.fit_data import Estimates, estimates
from roughslip.surface.covariance import Covariance
from roughslip.surface.embedding import IMAGE_SHARE, MOST_FOLDS, Embedding, embed
from roughslip.surface.lanczos import leading_modes
from roughslip.surface.models import KINDS, Matern, covariance_of
from roughslip.surface.modes import KarhunenLoeve, karhunen_loeve
from workflow.stress.runner import Conditions, Problem, Verdict, choose, has_advice, log_uniform, unless, verdict_of

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

SOURCES, SOURCE_SHARES = ("exact", "noise", "nonsense"), (0.45, 0.45, 0.1)
STEPS = (-0.02, 0.02)  # of a logarithm or a radian
STATIONARY = 1e-5  # of the squares, by which a step may lower them


def problem(seed: int, number: int) -> Problem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number])
    return (fit_problem if number % FITS == FITS - 1 else field_problem)(generator, number)


def field_problem(generator: np.random.Generator, number: int) -> Problem:
    """Draw a field to expand or to embed."""
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
    case = {"entry": entry, "covariance": covariance.kind, "nx": grid.nx, "ny": grid.ny, "order": order, "share": share}
    if entry == "expansion":
        solve = partial(karhunen_loeve, covariance, grid, order, share=share)
        return Problem(case, solve, partial(judge_expansion, covariance, grid, order, share), unless(True))
    if entry == "lanczos":
        solve = partial(leading_modes, covariance, grid, order or 1)
        return Problem(case, solve, lambda found: verdict_of(judge_modes(covariance, grid, *found)), unless(True))
    judge = partial(judge_embedding, covariance, grid, number)
    return Problem(case, partial(embed, covariance, grid), judge, partial(is_refused, covariance, grid))


def is_refused(covariance: Covariance, grid: Grid, error: RoughslipError) -> bool:
    """Whether an error answers an embedding: waves of a self-affine field far longer than the mesh, or below cells."""
    if covariance.kind != "self_affine" or not has_advice(error):
        return False
    folds = max(grid.dx, grid.dy) / min(covariance.cutoff_wavelengths_m) > MOST_FOLDS
    far = max(covariance.rolloff_wavelengths_m) > min(grid.nx * grid.dx, grid.ny * grid.dy)
    return folds if isinstance(error, ParameterError) else isinstance(error, IllPosedError) and far


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


def correlations(covariance: Covariance, grid: Grid) -> np.ndarray:
    """Return (2 nx - 1, 2 ny - 1) [-] correlations at all lags of the mesh, lag zero in the middle."""
    x, y = np.arange(1 - grid.nx, grid.nx) * grid.dx, np.arange(1 - grid.ny, grid.ny) * grid.dy
    return covariance(x[:, None], y) / covariance.rms_height_m**2


def matrix_of(covariance: Covariance, grid: Grid) -> np.ndarray:
    """Return (nx ny, nx ny) [-] correlations of the nodes."""
    rows, columns = (np.subtract.outer(np.arange(n), np.arange(n)) + n - 1 for n in grid.shape)
    table = correlations(covariance, grid)
    return table[rows[:, None, :, None], columns[None, :, None, :]].reshape(grid.size, grid.size)


def judge_modes(
    covariance: Covariance, grid: Grid, eigenvalues: np.ndarray, vectors: np.ndarray, residuals: np.ndarray
) -> Conditions:
    """Return conditions on eigenpairs.

    eigenvalues : (M,) [-] over Sq^2
    vectors : (M, nx ny) of unit norm
    residuals : (M,) as the package states them
    """
    matrix = matrix_of(covariance, grid)
    exact = scipy.linalg.eigvalsh(matrix)
    largest, count = float(exact[-1]), len(eigenvalues)
    rounding = MATRIX_ROUNDING * grid.size / largest
    allowed = TOLERANCE + rounding
    wrong = np.linalg.norm(vectors @ matrix - eigenvalues[:, None] * vectors, axis=1) / largest
    return {
        "the residual": (wrong.max(), allowed),
        "its residuals": (np.max(wrong - residuals), TOLERANCE / 10 + rounding),
        "eigenvalues": (np.max(np.abs(eigenvalues - exact[::-1][:count])) / largest, allowed),
        "descending": (np.max(np.diff(eigenvalues), initial=0.0) / largest, allowed),
        "orthonormal": (np.abs(vectors @ vectors.T - np.eye(count)).max(), 1e-10),
    }


def judge_expansion(
    covariance: Covariance, grid: Grid, order: int | None, share: float | None, found: KarhunenLoeve
) -> Verdict:
    """Return the verdict on an expansion: its eigenpairs, its variance and its number of modes."""
    variance = covariance.rms_height_m**2
    shapes = (
        found.modes.shape == (len(found.eigenvalues), *grid.shape) and found.residuals.shape == found.eigenvalues.shape
    )
    if not (shapes and all(np.isfinite(a).all() for a in (found.modes, found.eigenvalues, found.residuals))):
        return Verdict(math.inf, ("fields of another shape, or not finite",))
    eigenvalues = found.eigenvalues / variance
    count = len(eigenvalues)
    kept = eigenvalues > 0  # Eigenvalues within rounding may be stated as zero, and then have no vector.
    scaled = found.modes.reshape(count, -1) / covariance.rms_height_m
    vectors = scaled[kept] / np.sqrt(eigenvalues[kept])[:, None]
    conditions = judge_modes(covariance, grid, eigenvalues[kept], vectors, found.residuals[kept])
    exact = np.maximum(scipy.linalg.eigvalsh(matrix_of(covariance, grid))[::-1], 0.0)
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
    if order is not None:
        conditions["its order"] = (abs(count - order), 0)
    if share is not None:
        conditions["carries the share"] = (share - carried[count - 1], slack)
        conditions["with no mode too many"] = ((carried[count - 2] if count > 1 else 0.0) - share, slack)
    return verdict_of(conditions)


def judge_embedding(covariance: Covariance, grid: Grid, number: int, embedding: Embedding) -> Verdict:
    """Return the verdict on the covariance of samples, at random lags of the mesh and at its corners."""
    rms, generator = covariance.rms_height_m, np.random.default_rng([number, 3])
    filter_ = np.fft.irfft2(embedding.root, s=embedding.torus) / rms
    noise = generator.standard_normal(embedding.torus)
    heights = embedding.sample(np.random.default_rng([number, 3])) / rms  # of the same noise
    if heights.shape != grid.shape or not (np.isfinite(heights).all() and np.isfinite(filter_).all()):
        return Verdict(math.inf, ("heights of another shape, or not finite",))
    nodes = [tuple(int(generator.integers(n)) for n in grid.shape) for _ in range(NODES)]
    weights = (np.roll(filter_[::-1, ::-1], (i + 1, j + 1), (0, 1)) for i, j in nodes)  # of the noise at a node
    unlike = [abs(heights[node] - np.sum(weight * noise)) for node, weight in zip(nodes, weights, strict=True)]
    i = np.append(generator.integers(0, grid.nx, LAGS), [0, 0, grid.nx - 1, grid.nx - 1, grid.nx - 1])
    j = np.append(generator.integers(1 - grid.ny, grid.ny, LAGS), [0, grid.ny - 1, 0, grid.ny - 1, 1 - grid.ny])
    table = correlations(covariance, grid)
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


def fit_problem(generator: np.random.Generator, _: int) -> Problem:
    """Draw a table of lags, exact, with noise or without sense, and the kind of model to fit to it."""
    source, kind = choose(generator, SOURCES, SOURCE_SHARES), choose(generator, KINDS)
    of_truth = kind if source == "exact" or generator.random() < 0.6 else "gaussian"
    unit, anisotropic = log_uniform(generator, -12, 3), bool(generator.random() < 0.6)
    steps = tuple(int(n) for n in generator.integers(3, 9, 2)) if generator.random() < 0.9 else (0, 6)
    length = log_uniform(generator, -0.3, 0.8)
    across = length * log_uniform(generator, -0.4, 0.4) if anisotropic else length
    lay = float(generator.uniform(-1.5, 1.5)) if anisotropic and of_truth != "separable_exponential" else 0.0
    shapes: dict[str, float] = {}
    if of_truth == "matern":
        shapes["smoothness"] = log_uniform(generator, -0.7, 0.7)
    elif of_truth == "self_affine":
        shapes |= {"hurst": float(generator.uniform(0.2, 0.9)), "bandwidth": log_uniform(generator, 0.4, 1.5)}
    truth = covariance_of(of_truth, log_uniform(generator, -12, 3), unit * length, unit * across, lay, **shapes)
    cutoff = None
    if kind == "self_affine":
        cutoff = math.sqrt(math.prod(truth.cutoff_wavelengths_m)) if of_truth == kind else 2 * unit
    x, y = (np.arange(-n, n + 1) * unit for n in steps)
    r = truth(x[:, None], y) / truth.rms_height_m**2
    level = log_uniform(generator, -4, -1)
    if source == "noise":
        noise = level * generator.standard_normal(r.shape)
        r = r + (noise + noise[::-1, ::-1]) / math.sqrt(2)
    elif source == "nonsense":
        r = generator.uniform(-1, 1, r.shape)
    data = estimates(x[:, None], y[None, :], r, np.full(r.shape, level))
    # Exact lags determine their own model; they do so to a fit with enough of them below and beyond its lengths.
    determined = source == "exact" and kind == of_truth
    short = min(truth.lengths_m) > 1.5 * float(np.min(np.hypot(data.x, data.y)))
    enough = short and int((data.correlation > 0.3).sum()) > 8 and float(data.correlation.min()) < 0.2
    return Problem(
        {"source": source, "kind": kind, "truth": of_truth, "lags": data.x.size},
        partial(fit_covariance, kind, data, truth.rms_height_m, cutoff_wavelength_m=cutoff),
        partial(judge_fit, data, truth if determined else None),
        unless(determined and enough, IllPosedError, ConvergenceError),
    )


def judge_fit(data: Estimates, truth: Covariance | None, found: CovarianceFit) -> Verdict:
    """Return the verdict on a fit. truth : the model that the lags determine, None if they do not"""
    if not np.isfinite([*found.parameters.values(), found.misfit]).all():
        return Verdict(math.inf, ("parameters are not finite",))
    least = squares(data, found.covariance)
    nearby = min((squares(data, near) for near in neighbours(found)), default=math.inf)
    misfit = math.sqrt(least / len(data.x))
    conditions: Conditions = {
        "its misfit": (abs(found.misfit - misfit), 1e-6 * misfit + 1e-9),
        "errors are not negative": (-min(found.standard_errors.values()), 0),
        "fewer squares nearby": (least - nearby, STATIONARY * least + 1e-9),
    }
    if truth is not None and not found.at_bound:
        off = np.abs(correlation(found.covariance, data) - correlation(truth, data)).max()
        conditions["the model comes back"] = (off, 1e-5)
    return verdict_of(conditions)


def correlation(model: Covariance, data: Estimates) -> np.ndarray:
    """Return correlations [-] of a model at the lags."""
    return model(data.x, data.y) / model.rms_height_m**2


def squares(data: Estimates, model: Covariance) -> float:
    """Return the sum of the squared residuals of a model over the lags."""
    return float(np.sum(((correlation(model, data) - data.correlation) / data.standard_error) ** 2))


def neighbours(found: CovarianceFit) -> list[Covariance]:
    """Return models a step away in each free parameter; no model if a parameter is at its bound."""
    model = found.covariance
    if found.at_bound or model.kind == "self_affine":  # Lengths, bandwidth and cut-off move together.
        return []
    along, across = model.lengths_m
    near = []
    for step in STEPS:
        factor = math.exp(step)
        near += [
            replace(model, correlation_length_m=along * factor, correlation_length_across_m=across),
            replace(model, correlation_length_across_m=across * factor),
        ]
        if model.kind != "separable_exponential":
            near.append(replace(model, lay_rad=model.lay_rad + step))
        if isinstance(model, Matern) and 0.05 < model.smoothness * factor < 20:
            near.append(replace(model, smoothness=model.smoothness * factor))
    return near
