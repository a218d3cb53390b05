"""What expansions leave out, beside expansions of everything: terms, and solves once the error asked is reached.

Neither result is the same to the bit: a fit without terms that are zero by symmetry has less scatter, and fewer solves
err by as much as was asked. So the tolerance is the error that the expansion tells of itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from roughslip.chaos.distribution import kolmogorov_distance
from roughslip.chaos.enrichment import enrich
from roughslip.chaos.local import LocalExpansion, Samples, fit_local, jackknife_deviations
from roughslip.contact.solve import solve
from roughslip.stages.from_scene import geometry
from roughslip.stages.runtime import skip_reasons
from workflow.benchmarks.chain_square import LEVEL
from workflow.benchmarks.chaos_problem import Square
from workflow.benchmarks.skips_problem import Skip

SIGMAS = 3.0  # of the error told of the mean
DRAWS = 2**15


def samples_of(square: Square, xi: np.ndarray) -> Samples:
    """The surfaces of xi : (K, M), solved at the median."""
    pressure, gap = np.empty((2, len(xi), len(square.nodes.x)))
    for row, one in enumerate(xi):
        found = solve(square.influence, square.surface(one) - square.planes[LEVEL], 1e-10)
        pressure[row], gap[row] = (field[square.nodes.x, square.nodes.y] for field in (found.pressure, found.gap))
    variables = np.einsum("km,nvm->knv", xi, square.directions)
    return Samples(variables, square.nodes.distance2, pressure, gap, square.odd)


def drawn(square: Square, expansion: LocalExpansion, left_out: bool = False) -> np.ndarray:
    """Pressures of the same draws for every expansion."""
    generator = np.random.default_rng([square.seed, geometry.STREAM_DRAWS])
    return expansion.draw(generator, DRAWS, left_out=skip_reasons)


def skips(surfaces: int, scene: str, asked: float, most: int) -> Iterator[Skip]:
    """Terms, of so many surfaces of the paper's square, and solves of a scene's square for a Kolmogorov error."""
    yield _terms(Square.of("paper"), surfaces)
    yield _solves(Square.of(scene), asked, most)


def _terms(square: Square, surfaces: int) -> Skip:
    degree = square.configuration["expansion"]["degree"]
    samples = samples_of(square, square.design("latin_hypercube", surfaces, 0))
    every = replace(samples, odd=np.zeros((0, 0), dtype=np.int64))
    members = drawn(square, fit_local(every, degree, square.target), left_out=True).mean(axis=1)
    told = float(np.linalg.norm(jackknife_deviations(members[1:]))) / members[0]

    def fitted(of: Samples) -> tuple[np.ndarray, int]:
        found = fit_local(of, degree, square.target)
        return drawn(square, found), len(found.indices)

    return Skip(
        skip_reasons.SYMMETRIC,
        f"paper-{surfaces}-surfaces",
        SIGMAS * told,
        lambda: fitted(samples),
        lambda: fitted(every),
        lambda one, other: abs(float(one.mean() / other.mean()) - 1.0),
    )


def _solves(square: Square, asked: float, most: int) -> Skip:
    degree = square.configuration["expansion"]["degree"]

    def solved(first: int, last: int) -> Samples:
        return samples_of(square, square.design("sobol", last, 0)[first:])

    def fit(of: Samples) -> tuple[LocalExpansion, Samples]:
        return fit_local(of, degree, square.target), of

    def until_it_serves() -> tuple[np.ndarray, int]:
        found = enrich(solved, fit, asked, least=128, most=most, seed=[square.seed, geometry.STREAM_ENRICHMENT])
        return drawn(square, found.expansion), len(found.samples.pressure)

    def all_of_them() -> tuple[np.ndarray, int]:
        return drawn(square, fit(solved(0, most))[0]), most

    name = f"{square.name}-to-{asked:g}"
    return Skip(skip_reasons.ENOUGH_SOLVES, name, asked, until_it_serves, all_of_them, kolmogorov_distance)
