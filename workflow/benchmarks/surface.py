"""Surfaces measured: modes and exact samples of large meshes, and what accuracy costs beside public generators.

All in one process and one thread, by turns. Modes are judged by their residual, samples by their covariance, both apart
from the code that made them. Not timed: what is set up once for a mesh, such as the embedding; rows tell it as
`setup_seconds`.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.surface.covariance import Covariance, StationaryCovariance
from roughslip.surface.embedding import Embedding, embed
from roughslip.surface.karhunen_loeve import karhunen_loeve
from workflow.benchmarks import measure
from workflow.benchmarks.measure import OURS, Contender, Row, case, row
from workflow.benchmarks.surface_peers import SAMPLERS, SEED, Embedded, Sampler, dense_modes
from workflow.benchmarks.surface_problem import (
    OTHERS,
    SEPARABLE,
    General,
    Lags,
    covariance_of,
    residual,
    root_mean_square,
    square,
)
from workflow.benchmarks.surface_summary import summary

PACKAGES = ("numpy", "scipy", "numba", "ducc0", "gstools", "gstools-cython", "gstools-core")

# What the project promises [s].
LIMITS = {"separable": 2.0, "other": 10.0, "sample": 1.0}
RESIDUAL = "1e-9"
GENERAL, DENSE = "roughslip/lanczos", "scipy/eigh"

# Waves of the randomization, waves an axis of the Fourier method; the larger ones on meshes that their time allows.
WAVES = {"gstools/randomization": (100, 1000, 10_000), "gstools/fourier": (16, 32, 64)}
MOST_TERMS = 5e8  # waves times nodes of a sample: some 10 s


@dataclass(frozen=True)
class Campaign:
    """What is measured, and on which meshes.

    leading : nodes on an edge and number of modes, every covariance
    sampled : exact samples, every covariance
    expanded : orders of the expansion against time
    dense : of these meshes the one on which LAPACK takes part
    compared : sample covariances beside the peers
    budget : [s] of samples for the error of a method on a mesh
    quick : one turn each, to show that everything works
    """

    leading: tuple[int, int] = (512, 101)
    sampled: int = 2048
    expanded: tuple[int, ...] = (64, 128)
    dense: int = 64
    orders: tuple[int, ...] = (10, 25, 50, 100, 200, 400)
    compared: tuple[int, ...] = (64, 256)
    most_samples: int = 4096
    budget: float = 10.0
    quick: bool = False

    def turns(self, seconds: float, least: int = 1) -> int:
        return 1 if self.quick else max(least, measure.turns(seconds))


QUICK = Campaign((48, 11), 64, (16, 24), 16, (4, 16), (32,), most_samples=16, budget=0.2, quick=True)


def leading_modes(campaign: Campaign) -> list[Row]:
    """The modes that a study needs on a fine mesh, with the residual of the worst."""
    n, order = campaign.leading
    grid, rows = square(n), []
    for name in SEPARABLE + OTHERS:
        covariance = covariance_of(name, grid)
        call = partial(karhunen_loeve, covariance, grid, order)
        seconds, found = measure.timed(call)
        contender = Contender(call, seconds, campaign.turns(seconds, 3))
        times = measure.race({OURS: contender})[OURS]
        limit = LIMITS["separable" if covariance.separable else "other"]
        error = residual(covariance, found)
        label = case(n=n, covariance=name, modes=order, tolerance=RESIDUAL)
        rows.append(row(label, OURS, error, times, order, limit=limit, captured_variance=found.captured_variance))
        _tell(rows[-1:])
    return rows


def exact_samples(campaign: Campaign) -> tuple[list[Row], dict[str, str]]:
    """Samples of a large mesh, with the error of their ensemble's covariance over all lags; why others were refused."""
    grid, rows, refused = square(campaign.sampled), [], {}
    for name in SEPARABLE + OTHERS:
        covariance = covariance_of(name, grid)
        label = case(n=grid.nx, covariance=name, quantity="sample")
        try:
            setup, embedding = measure.timed(partial(embed, covariance, grid))
        except IllPosedError as error:
            refused[label] = str(error)
            measure.say(f"{label}: {error}")
            continue
        call = partial(embedding.sample, np.random.default_rng([SEED, grid.nx]))
        seconds, _ = measure.timed(call)
        times = measure.race({OURS: Contender(call, seconds, campaign.turns(seconds, 3))})[OURS]
        error = ensemble_error(covariance, embedding)
        more = {"limit": LIMITS["sample"], "setup_seconds": setup, "torus": list(embedding.torus)}
        rows.append(row(label, OURS, error, times, 1, **more))
        _tell(rows[-1:])
        del embedding, call  # a quarter of a gigabyte
    return rows, refused


def ensemble_error(covariance: StationaryCovariance, embedding: Embedding) -> float:
    """RMS over the lags of the mesh, over Sq^2: the covariance of the torus from the one asked for."""
    grid = embedding.grid
    torus = np.fft.irfft2(embedding.root**2, embedding.torus)
    squares = 0.0
    y = np.concatenate((np.arange(grid.ny), np.arange(1 - grid.ny, 0)))
    for i in range(grid.nx):  # by rows: all lags of 2048 x 2048 nodes at once would take several arrays of 64 MB
        asked = covariance(np.array(i * grid.dx), y * grid.dy)
        squares += float(np.sum((torus[i, y] - asked) ** 2))
    return math.sqrt(squares / (grid.nx * len(y))) / covariance.rms_height_m**2


def expansions(campaign: Campaign) -> list[Row]:
    """Variance that an expansion leaves out against its time: by axes, by Lanczos, and the whole matrix by LAPACK."""
    rows = []
    for n in campaign.expanded:
        for name in ("gaussian", "exponential"):
            grid = square(n)
            ways = ways_to_expand(covariance_of(name, grid), grid, dense=n == campaign.dense)
            label = case(n=n, covariance=name, quantity="uncaptured_variance")
            contenders, errors = {}, {}
            for order, (method, way) in itertools.product(campaign.orders, ways.items()):
                call = partial(way, order)
                seconds, eigenvalues = measure.timed(call)
                errors[method, order] = 1.0 - float(eigenvalues.sum()) / grid.size
                slow = method == DENSE
                contenders[method, order] = Contender(call, seconds, 1 if slow else campaign.turns(seconds), keep=slow)
            times = measure.race(contenders)
            found = [row(label, method, errors[method, m], times[method, m], m, setting=m) for method, m in contenders]
            rows += found
            _tell(found)
    return rows


def ways_to_expand(covariance: Covariance, grid: Grid, dense: bool) -> dict[str, Callable[[int], np.ndarray]]:
    """Method -> order -> its eigenvalues (order,), the vectors being computed as well."""
    general, ways = General(covariance), {}
    if covariance.separable:
        ways[OURS] = lambda order: karhunen_loeve(covariance, grid, order).eigenvalues
    ways[GENERAL] = lambda order: karhunen_loeve(general, grid, order).eigenvalues
    if dense:
        ways[DENSE] = lambda order: dense_modes(covariance, grid, order)
    return ways


def sampling(campaign: Campaign, peers: Sequence[str]) -> list[Row]:
    """Error of the covariance of N samples against the time for them, ours beside the peers at several settings."""
    rows = []
    for n in campaign.compared:
        grid = square(n)
        for name in ("gaussian", "exponential"):
            found = compare(covariance_of(name, grid), grid, name, campaign, peers)
            rows += found
            _tell([entry for entry in found if entry["samples"] == 1])
    return rows


def compare(covariance: Covariance, grid: Grid, name: str, campaign: Campaign, peers: Sequence[str]) -> list[Row]:
    """Times of a sample by turns, then as many samples as fit the budget; rows for 1, 4, 16 ... of them.

    error : RMS over the lags, and over as many sets of N as there are, of their covariance from the one asked for
    floor : what N exact samples would have
    systematic : what no number of samples removes
    """
    samplers, setups, contenders = {}, {}, {}
    for method, setting in _settings(grid, campaign, peers):
        make = SAMPLERS.get(method, Embedded)
        key = method, setting
        setups[key], samplers[key] = measure.timed(partial(make, covariance, grid, setting))
        call = partial(_next_sample, samplers[key], itertools.count())
        call()  # what is loaded or compiled at the first one
        seconds, _ = measure.timed(call)
        contenders[key] = Contender(call, seconds, campaign.turns(seconds))
    times = measure.race(contenders)
    lags, label = Lags.of(grid), case(n=grid.nx, covariance=name, quantity="covariance")
    floor, asked, rows = lags.floor(covariance), covariance(lags.x, lags.y), []
    for (method, setting), sampler in samplers.items():
        count = int(min(max(campaign.budget / min(times[method, setting]), 4), campaign.most_samples))
        differences = sample_covariances(sampler, lags, count) - asked
        systematic = root_mean_square(sampler.ensemble(lags) - asked)
        samples = 1
        while 4 * samples <= count or samples == 1:
            sets = differences[: count // samples * samples].reshape(-1, samples, differences.shape[1]).mean(axis=1)
            whole = [setups[method, setting] + samples * seconds for seconds in times[method, setting]]
            more = {"setting": setting, "samples": samples, "setup_seconds": setups[method, setting]}
            more |= {"floor": floor / math.sqrt(samples), "systematic": systematic}
            rows.append(row(label, method, root_mean_square(sets), whole, samples, **more))
            samples *= 4
    return rows


def _next_sample(sampler: Sampler, numbers: Iterator[int]) -> np.ndarray:
    return sampler.sample(next(numbers))


def _settings(grid: Grid, campaign: Campaign, peers: Sequence[str]) -> list[tuple[str, int]]:
    found = [(OURS, 0)]
    for peer in peers:
        settings = WAVES[peer][:2] if campaign.quick else WAVES[peer]
        waves = [setting**2 if peer == "gstools/fourier" else setting for setting in settings]
        found += [(peer, s) for s, w in zip(settings, waves, strict=True) if w * grid.size <= MOST_TERMS]
    return found


def sample_covariances(sampler: Sampler, lags: Lags, count: int) -> np.ndarray:
    """(count, lags) of samples 1, 2, ..."""
    return np.array([lags.covariance(sampler.sample(number)) for number in range(1, count + 1)])


def checks() -> dict[str, float]:
    """Largest differences of leading eigenvalues by two ways, over the first: whether one of them misses a mode."""

    def difference(first: str, second: str, name: str, n: int, order: int) -> float:
        ways = ways_to_expand(covariance_of(name, square(n)), square(n), dense=True)
        values, expected = ways[first](order), ways[second](order)
        return float(np.abs(values - expected).max() / expected[0])

    # Lanczos needs more than 1024 nodes to be taken; of 10 modes of the gaussian field two pairs have equal values
    return {
        "axes_from_whole_matrix": difference(OURS, DENSE, "gaussian", 24, 40),
        "lanczos_from_whole_matrix": difference(GENERAL, DENSE, "exponential", 34, 40),
        "lanczos_from_axes": difference(GENERAL, OURS, "gaussian", 34, 40),
        "lanczos_from_axes_10": difference(GENERAL, OURS, "gaussian", 34, 10),
    }


def run(campaign: Campaign, peers: Sequence[str]) -> dict[str, object]:
    """The whole benchmark as it stands in the file."""
    checked = checks()
    samples, refused = exact_samples(campaign)
    rows = leading_modes(campaign) + samples + expansions(campaign) + sampling(campaign, peers)
    return {
        "machine": measure.machine(),
        "versions": measure.versions(PACKAGES),
        "checks": {"eigenvalues": checked},
        "summary": {**summary(rows), "refused": refused},
        "rows": rows,
    }


def _tell(rows: Sequence[Row]) -> None:
    times = ", ".join(
        f"{entry['method']} {entry.get('setting', '')} {1e3 * entry['seconds']:.3g} ms {entry['error']:.1e}"
        for entry in rows
    )
    measure.say(f"{rows[0]['case']}: {times}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True, help="the JSON file")
    parser.add_argument("--peers", action="store_true", help="beside GSTools, which must be installed")
    parser.add_argument("--quick", action="store_true", help="tiny meshes, one turn each")
    arguments = parser.parse_args()
    if arguments.peers and find_spec("gstools") is None:
        parser.error("not installed: gstools; `make benchmark PEERS=1` sets up an environment with it")
    if arguments.peers:
        import_module("gstools")  # a second that is not the set-up of its first field
    campaign = QUICK if arguments.quick else Campaign()
    measure.write(arguments.output, run(campaign, tuple(SAMPLERS) if arguments.peers else ()))


if __name__ == "__main__":
    main()
