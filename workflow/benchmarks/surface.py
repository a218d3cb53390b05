"""Measure surfaces: leading modes and exact samples of large meshes, and samples against public generators.

One process, one thread, in turns. The residual judges modes and the sample covariance judges samples; neither shares
code with what it judges. What is set up once for a mesh is not timed; rows list it as `setup_seconds`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.surface.covariance import StationaryCovariance
from roughslip.surface.embedding import Embedding, embed
from roughslip.surface.karhunen_loeve import karhunen_loeve
from workflow.benchmarks.runner import OURS, make_row, race, report_progress, report_rows, run_command, timed
from workflow.benchmarks.surface_problem import (
    COVARIANCES,
    PEERS,
    SEED,
    Lags,
    Sampler,
    covariance_of,
    residual,
    root_mean_square,
    set_up_embedding,
    square,
)
from workflow.evidence.rows import Row, case

PACKAGES = ("ducc0", "gstools", "gstools-cython", "gstools-core")
RESIDUAL = "1e-9"

# Waves of the randomization, and waves on an axis of the Fourier method.
WAVES = {"gstools/randomization": (100, 1000, 10_000), "gstools/fourier": (16, 32, 64)}
MOST_TERMS = 5e8  # waves times nodes of a sample, about 10 s


@dataclass(frozen=True)
class Sizes:
    """What is measured, and on which meshes.

    leading : nodes on an edge and number of modes, every covariance
    sampled : nodes on an edge of exact samples, every covariance
    compared : nodes on an edge of the comparison with the peers
    budget : [s] of samples for the error of a method
    quick : one turn each
    """

    leading: tuple[int, int] = (512, 101)
    sampled: int = 2048
    compared: int = 256
    most_samples: int = 4096
    budget: float = 10.0
    quick: bool = False


QUICK = Sizes((48, 11), 64, 32, most_samples=16, budget=0.2, quick=True)


def leading_modes(sizes: Sizes) -> list[Row]:
    """Return rows of the leading modes on a fine mesh; the error is the residual of the worst mode."""
    n, order = sizes.leading
    grid, rows = square(n), []
    for name in COVARIANCES:
        covariance = covariance_of(name, grid)
        seconds, results = race({OURS: partial(karhunen_loeve, covariance, grid, order)}, sizes.quick, least=3)
        label = case(n=n, covariance=name, modes=order, tolerance=RESIDUAL)
        rows.append(make_row(label, OURS, residual(covariance, results[OURS]), seconds[OURS], order))
        report_rows(rows[-1:])
    return rows


def exact_samples(sizes: Sizes) -> tuple[list[Row], dict[str, str]]:
    """Return rows of samples of a large mesh, and why others were refused.

    The error is that of the covariance of the ensemble over all lags of the mesh.
    """
    grid, rows, refused = square(sizes.sampled), [], {}
    for name in COVARIANCES:
        covariance = covariance_of(name, grid)
        label = case(n=grid.nx, covariance=name, quantity="sample")
        try:
            setup, embedding = timed(partial(embed, covariance, grid))
        except IllPosedError as error:
            refused[label] = str(error)
            report_progress(f"{label}: {error}")
            continue
        call = partial(embedding.sample, np.random.default_rng([SEED, grid.nx]))
        times = race({OURS: call}, sizes.quick).seconds[OURS]
        error = ensemble_error(covariance, embedding)
        more = {"setup_seconds": setup, "torus": list(embedding.torus)}
        rows.append(make_row(label, OURS, error, times, 1, **more))
        report_rows(rows[-1:])
        del embedding, call  # a quarter of a gigabyte
    return rows, refused


def ensemble_error(covariance: StationaryCovariance, embedding: Embedding) -> float:
    """Return the RMS difference, over Sq^2 and all lags of the mesh, of the torus's covariance from the model's."""
    grid = embedding.grid
    torus = np.fft.irfft2(embedding.root**2, embedding.torus)
    squares = 0.0
    y = np.concatenate((np.arange(grid.ny), np.arange(1 - grid.ny, 0)))
    for i in range(grid.nx):  # by rows: all lags of 2048 x 2048 nodes at once would take several arrays of 64 MB
        asked = covariance(np.array(i * grid.dx), y * grid.dy)
        squares += float(np.sum((torus[i, y] - asked) ** 2))
    return math.sqrt(squares / (grid.nx * len(y))) / covariance.rms_height_m**2


def compare_samplers(name: str, sizes: Sizes, peers: Sequence[str]) -> list[Row]:
    """Return rows of 1, 4, 16, ... samples of every method: the time for them and the error of their covariance.

    error : RMS over the lags, and over all available sets of so many samples, of covariance minus model
    floor : the expected error of as many exact samples
    """
    grid = square(sizes.compared)
    covariance = covariance_of(name, grid)
    samplers, setups, calls = {}, {}, {}
    for key in settings(grid, sizes.quick, peers):
        make = PEERS.get(key[0], set_up_embedding)
        setups[key], samplers[key] = timed(partial(make, covariance, grid, key[1]))
        calls[key] = partial(_next_sample, samplers[key], itertools.count())
        calls[key]()  # includes what is loaded at the first sample
    times = race(calls, sizes.quick).seconds
    lags, label = Lags.of(grid), case(n=grid.nx, covariance=name, quantity="covariance")
    floor, asked, rows = lags.floor(covariance), covariance(lags.x, lags.y), []
    for key, sampler in samplers.items():
        count = int(min(max(sizes.budget / min(times[key]), 4), sizes.most_samples))
        differences = sample_covariances(sampler, lags, count) - asked
        samples = 1
        while 4 * samples <= count or samples == 1:
            sets = differences[: count // samples * samples].reshape(-1, samples, differences.shape[1]).mean(axis=1)
            whole = [setups[key] + samples * seconds for seconds in times[key]]
            more = {"setting": key[1], "samples": samples, "setup_seconds": setups[key]}
            error, least = root_mean_square(sets), floor / math.sqrt(samples)
            rows.append(make_row(label, key[0], error, whole, samples, floor=least, **more))
            samples *= 4
    report_rows([row for row in rows if row["samples"] == 1])
    return rows


def _next_sample(sampler: Sampler, numbers: itertools.count) -> np.ndarray:
    return sampler(next(numbers))


def settings(grid: Grid, quick: bool, peers: Sequence[str]) -> list[tuple[str, int]]:
    """Return methods with their settings; the number of waves is limited by their time on this mesh."""
    found = [(OURS, 0)]
    for peer in peers:
        for setting in WAVES[peer][: 2 if quick else None]:
            waves = setting**2 if peer == "gstools/fourier" else setting
            if waves * grid.size <= MOST_TERMS:
                found.append((peer, setting))
    return found


def sample_covariances(sampler: Sampler, lags: Lags, count: int) -> np.ndarray:
    """Return the covariances (count, lags) of samples 1, 2, ..."""
    return np.array([lags.covariance(sampler(number)) for number in range(1, count + 1)])


def measure_sizes(sizes: Sizes, peers: Sequence[str]) -> dict[str, object]:
    """Return the summary and the rows of these sizes."""
    samples, refused = exact_samples(sizes)
    rows = leading_modes(sizes) + samples
    for name in ("gaussian", "exponential"):
        rows += compare_samplers(name, sizes, peers)
    return {"summary": {"refused": refused}, "rows": rows}


def measure(quick: bool, peers: bool) -> dict[str, object]:
    """Return the summary and the rows."""
    if peers:
        import gstools  # noqa: F401  takes a second, which is not set-up of a sampler
    return measure_sizes(QUICK if quick else Sizes(), tuple(PEERS) if peers else ())


if __name__ == "__main__":
    run_command(__doc__, measure, PACKAGES, ("gstools",))
