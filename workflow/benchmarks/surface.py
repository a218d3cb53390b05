"""Measure samples of surfaces against those of public generators.

One process, one thread, in turns. The sample covariance judges, which shares no code with what it judges. The unit of
height is Sq and that of length the edge of the mesh. What is set up once for a mesh is timed once; rows list it as
`setup_seconds`. The generators of GSTools are used as documented.
"""

import itertools
import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy import fft

from roughslip.grid import Grid
from roughslip.surface.covariance import Covariance
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of
from workflow.benchmarks.rows import OURS, Row, case, make_row, race, timed, write

COVARIANCES = ("gaussian", "exponential")
LENGTH = 0.1
LAGS, LAGS_A_SIDE = 0.3, 32  # sample covariances: up to three correlation lengths, the same lags on every mesh
SEED = 20260
# Waves of the randomization, and waves on an axis of the Fourier method.
PEERS = {"gstools/randomization": (100, 1000), "gstools/fourier": (16, 32, 64)}
PERIOD = 1.5  # period of the Fourier method over the edge; images are at least half an edge away
NODES = 256  # on an edge of the mesh
MOST_SAMPLES, BUDGET_S = 4096, 10.0  # for the error of a method


def lags_of(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the lags in nodes, i >= 0 and j of both signs."""
    step = max(1, n // LAGS_A_SIDE)
    most = int(LAGS * n) // step
    i, j = np.meshgrid(np.arange(most + 1), np.arange(-most, most + 1), indexing="ij")
    return step * i, step * j


def sample_covariance(heights: np.ndarray, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Return the mean of z(x) z(x + l) over the pairs of one sample (nx, ny) of zero mean, at the lags i, j."""
    (nx, ny), sizes = heights.shape, [fft.next_fast_len(2 * n, real=True) for n in heights.shape]
    sums = fft.irfft2(np.abs(fft.rfft2(heights, sizes)) ** 2, sizes)
    return sums[i, j] / ((nx - i) * (ny - np.abs(j)))


def sampler(covariance: Covariance, grid: Grid, method: str, waves: int) -> Callable[[int], np.ndarray]:
    """Set up a generator of the sample of a number: circulant embedding, ours, or one of GSTools on one thread.

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
        options = {"generator": "Fourier", "period": [PERIOD * grid.nx * grid.dx] * 2, "mode_no": [waves, waves]}
    kinds = {"gaussian": gstools.Gaussian, "exponential": gstools.Exponential}
    length, variance = covariance.correlation_length_m, covariance.rms_height_m**2
    model = kinds[covariance.kind](dim=2, var=variance, len_scale=length, rescale=1.0)  # len_scale is our 1/e length
    field, axes = gstools.SRF(model, **options), (grid.x(), grid.y())
    return lambda number: field.structured(axes, seed=number, store=False)


def compare_samplers(name: str, peers: bool) -> list[Row]:
    """Return rows of 1, 4, 16, ... samples of every method: the time for them and the error of their covariance.

    The error is the RMS over the lags, and over all available sets of so many samples, of covariance minus model.
    """
    grid, rows, (i, j) = Grid(NODES, NODES, 1 / NODES, 1 / NODES), [], lags_of(NODES)
    covariance, label = covariance_of(name, 1.0, LENGTH), case(n=NODES, covariance=name, quantity="covariance")
    asked = covariance(i * grid.dx, j * grid.dy)
    keys = [(OURS, 0), *((peer, waves) for peer in PEERS for waves in PEERS[peer] if peers)]
    made = {key: timed(partial(sampler, covariance, grid, *key)) for key in keys}
    calls = {key: partial(lambda draw, nos: draw(next(nos)), made[key][1], itertools.count()) for key in keys}
    for (method, setting), turns in race(calls)[0].items():
        setup, draw = made[method, setting]
        count = int(min(max(BUDGET_S / min(turns), 4), MOST_SAMPLES))
        errors = np.array([sample_covariance(draw(number), i, j) - asked for number in range(1, count + 1)])
        for samples in (4**power for power in range((count.bit_length() + 1) // 2)):
            sets = errors[: count // samples * samples].reshape(-1, samples, *asked.shape).mean(axis=1)
            whole, error = [setup + samples * seconds for seconds in turns], math.sqrt(np.mean(sets**2))
            more = {"setting": setting, "samples": samples, "setup_seconds": setup}
            rows.append(make_row(label, method, error, whole, samples, **more))
    return rows


def measure(peers: bool) -> dict[str, object]:
    """Return the rows."""
    if peers:
        import gstools  # noqa: F401  takes a second, which is not set-up of a sampler
    return {"rows": [row for name in COVARIANCES for row in compare_samplers(name, peers)]}


if __name__ == "__main__":
    write("surface", measure)
