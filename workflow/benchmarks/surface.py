"""Measure surfaces: leading modes and exact samples of large meshes, and samples against public generators.

One process, one thread, in turns. The residual judges modes and the sample covariance judges samples; neither shares
code with what it judges. The unit of height is Sq and that of length the edge of the mesh. What is set up once for a
mesh is not timed; rows list it as `setup_seconds`. The generators of GSTools are used as documented.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy import fft
from scipy.signal import fftconvolve

from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.surface import models
from roughslip.surface.covariance import StationaryCovariance
from roughslip.surface.embedding import Embedding, embed
from roughslip.surface.modes import KarhunenLoeve, karhunen_loeve
from workflow.benchmarks.runner import OURS, make_row, race, run_command, timed
from workflow.evidence.rows import Row, case

PACKAGES = ("ducc0", "gstools", "gstools-cython", "gstools-core")
COVARIANCES = ("gaussian", "separable_exponential", "exponential", "matern", "rotated", "self_affine")
LENGTH = 0.1
RESIDUAL = "1e-9"
LAGS, LAGS_A_SIDE = 0.3, 32  # sample covariances: up to three correlation lengths, the same lags on every mesh
SEED = 20260
# Waves of the randomization, and waves on an axis of the Fourier method.
PEERS = {"gstools/randomization": (100, 1000), "gstools/fourier": (16, 32, 64)}
PERIOD = 1.5  # period of the Fourier method over the edge; images are at least half an edge away

Sampler = Callable[[int], np.ndarray]  # heights (nx, ny) of the sample of a number


class Sizes(NamedTuple):
    """What is measured, on meshes of so many nodes on an edge.

    leading : nodes and number of modes, every covariance
    sampled, compared : nodes of exact samples, every covariance, and of the comparison with the peers
    budget : [s] of samples for the error of a method
    """

    leading: tuple[int, int] = (512, 101)
    sampled: int = 2048
    compared: int = 256
    most_samples: int = 4096
    budget: float = 10.0
    quick: bool = False


QUICK = Sizes((48, 11), 64, 32, most_samples=16, budget=0.2, quick=True)


def square(n: int) -> Grid:
    return Grid(n, n, 1 / n, 1 / n)


def covariance_of(name: str, grid: Grid) -> StationaryCovariance:
    """Return the covariance of that name; the self-affine spectrum ends at the shortest waves of the mesh."""
    if name == "matern":
        return models.covariance_of("matern", 1.0, LENGTH, smoothness=1.5)
    if name == "rotated":
        return models.covariance_of("exponential", 1.0, 2 * LENGTH, LENGTH / 2, 0.5)
    if name == "self_affine":
        return models.self_affine(1.0, 0.8, 0.5, 2 * max(grid.dx, grid.dy))
    return models.covariance_of(name, 1.0, LENGTH)  # type: ignore[arg-type]


# Judges.


def all_lags(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Return the lags (2 nx - 1, 1) along x and (1, 2 ny - 1) along y between the nodes of a mesh."""
    x, y = (np.arange(1 - n, n) * cell for n, cell in zip(grid.shape, (grid.dx, grid.dy), strict=True))
    return x[:, None], y[None, :]


def residual(covariance: StationaryCovariance, found: KarhunenLoeve) -> float:
    """Return the largest |C phi - lambda phi| / lambda_1 of the modes, with phi of unit norm."""
    kernel, worst = covariance(*all_lags(found.grid)), 0.0
    for eigenvalue, mode in zip(found.eigenvalues, found.modes, strict=True):
        difference = fftconvolve(kernel, mode, mode="valid") - eigenvalue * mode
        worst = max(worst, float(np.linalg.norm(difference) / np.linalg.norm(mode) / found.eigenvalues[0]))
    return worst


def ensemble_error(covariance: StationaryCovariance, embedding: Embedding) -> float:
    """Return the RMS difference, over Sq^2 and all lags of the mesh, of the torus's covariance from the model's."""
    torus, squares = np.fft.irfft2(embedding.root**2, embedding.torus), 0.0
    x, y = all_lags(embedding.grid)
    nx, ny = embedding.grid.shape
    for i in range(nx):  # by rows: all lags of 2048 x 2048 nodes at once would take several arrays of 64 MB
        squares += float(np.sum((torus[i, np.arange(1 - ny, ny)] - covariance(x[nx - 1 + i], y[0])) ** 2))
    return math.sqrt(squares / (nx * y.size)) / covariance.rms_height_m**2


def lags_of(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Return the lags in nodes, i >= 0 and j of both signs, at which sample covariances are compared."""
    step = max(1, grid.nx // LAGS_A_SIDE), max(1, grid.ny // LAGS_A_SIDE)
    most = int(LAGS * grid.nx) // step[0], int(LAGS * grid.ny) // step[1]
    i, j = np.meshgrid(np.arange(most[0] + 1), np.arange(-most[1], most[1] + 1), indexing="ij")
    return step[0] * i, step[1] * j


def sample_covariance(heights: np.ndarray, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Return the mean of z(x) z(x + l) over the pairs of one sample (nx, ny) of zero mean, at the lags i, j."""
    (nx, ny), sizes = heights.shape, [fft.next_fast_len(2 * n, real=True) for n in heights.shape]
    sums = fft.irfft2(np.abs(fft.rfft2(heights, sizes)) ** 2, sizes)
    return sums[i, j] / ((nx - i) * (ny - np.abs(j)))


def sampler(covariance: StationaryCovariance, grid: Grid, method: str, waves: int) -> Sampler:
    """Set up a generator: circulant embedding, ours, or one of GSTools on one thread.

    Randomization takes plane waves of random wave vectors from the spectrum, redrawn for each sample (F. Hesse et al.,
    Environ. Model. Softw. 55 (2014) 32). Its ensemble has the model's covariance; one sample has that of its few waves.
    The Fourier method sums waves x waves equidistant wave vectors at every node, of a period of PERIOD edges. Waves
    beyond the last one and between two are missing, which is a systematic error.
    """
    if method == OURS:
        embedding = embed(covariance, grid)
        return lambda number: embedding.sample(np.random.default_rng([SEED, number]))
    import gstools

    gstools.config.NUM_THREADS = 1
    options: dict[str, Any] = {"generator": "RandMeth", "mode_no": waves}
    if method == "gstools/fourier":
        periods = [PERIOD * grid.nx * grid.dx, PERIOD * grid.ny * grid.dy]
        options = {"generator": "Fourier", "period": periods, "mode_no": [waves, waves]}
    kinds = {"gaussian": gstools.Gaussian, "exponential": gstools.Exponential}
    length, variance = covariance.correlation_length_m, covariance.rms_height_m**2
    model = kinds[covariance.kind](dim=2, var=variance, len_scale=length, rescale=1.0)  # len_scale is our 1/e length
    field, axes = gstools.SRF(model, **options), (grid.x(), grid.y())
    return lambda number: field.structured(axes, seed=number, store=False)


# What is measured.


def leading_modes(sizes: Sizes) -> list[Row]:
    """Return rows of the leading modes on a fine mesh; the error is the residual of the worst mode."""
    n, order = sizes.leading
    grid, rows = square(n), []
    for name in COVARIANCES:
        covariance = covariance_of(name, grid)
        seconds, results = race({OURS: partial(karhunen_loeve, covariance, grid, order)}, sizes.quick, least=3)
        label = case(n=n, covariance=name, modes=order, tolerance=RESIDUAL)
        rows.append(make_row(label, OURS, residual(covariance, results[OURS]), seconds[OURS], order))
    return rows


def exact_samples(sizes: Sizes) -> tuple[list[Row], dict[str, str]]:
    """Return rows of samples of a large mesh, and why others were refused.

    The error is that of the covariance of the ensemble over all lags of the mesh.
    """
    grid, rows, refused = square(sizes.sampled), [], {}
    for name in COVARIANCES:
        covariance, label = covariance_of(name, grid), case(n=grid.nx, covariance=name, quantity="sample")
        try:
            setup, embedding = timed(partial(embed, covariance, grid))
        except IllPosedError as error:
            refused[label] = str(error)
            continue
        call = partial(embedding.sample, np.random.default_rng([SEED, grid.nx]))
        turns, error = race({OURS: call}, sizes.quick)[0][OURS], ensemble_error(covariance, embedding)
        rows.append(make_row(label, OURS, error, turns, 1, setup_seconds=setup, torus=list(embedding.torus)))
        del embedding, call  # a quarter of a gigabyte
    return rows, refused


def compare_samplers(name: str, sizes: Sizes, peers: bool) -> list[Row]:
    """Return rows of 1, 4, 16, ... samples of every method: the time for them and the error of their covariance.

    The error is the RMS over the lags, and over all available sets of so many samples, of covariance minus model.
    """
    grid, rows = square(sizes.compared), []
    covariance, label = covariance_of(name, grid), case(n=grid.nx, covariance=name, quantity="covariance")
    i, j = lags_of(grid)
    asked = covariance(i * grid.dx, j * grid.dy)
    keys = [(OURS, 0), *((peer, waves) for peer in PEERS for waves in PEERS[peer] if peers)]
    made = {key: timed(partial(sampler, covariance, grid, *key)) for key in keys}
    calls = {
        key: partial(lambda draw, numbers: draw(next(numbers)), draw, itertools.count())
        for key, (_, draw) in made.items()
    }
    for (method, setting), turns in race(calls, sizes.quick)[0].items():
        setup, draw = made[method, setting]
        count = int(min(max(sizes.budget / min(turns), 4), sizes.most_samples))
        found = np.array([sample_covariance(draw(number), i, j) - asked for number in range(1, count + 1)])
        for samples in (4**power for power in range((count.bit_length() + 1) // 2)):
            sets = found[: count // samples * samples].reshape(-1, samples, *asked.shape).mean(axis=1)
            whole, error = [setup + samples * seconds for seconds in turns], math.sqrt(np.mean(sets**2))
            more = {"setting": setting, "samples": samples, "setup_seconds": setup}
            rows.append(make_row(label, method, error, whole, samples, **more))
    return rows


def measure(quick: bool, peers: bool) -> dict[str, object]:
    """Return the summary and the rows."""
    if peers:
        import gstools  # noqa: F401  takes a second, which is not set-up of a sampler
    sizes = QUICK if quick else Sizes()
    samples, refused = exact_samples(sizes)
    rows = leading_modes(sizes) + samples
    rows += [row for name in ("gaussian", "exponential") for row in compare_samplers(name, sizes, peers)]
    return {"summary": {"refused": refused}, "rows": rows}


if __name__ == "__main__":
    run_command(__doc__, measure, PACKAGES, ("gstools",))
