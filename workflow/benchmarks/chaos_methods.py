"""Ways from solves of the square to the distribution of the pressure at its centre."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from roughslip.chaos.hermite import hermite_basis
from roughslip.chaos.local import Samples, fit_local
from roughslip.stages.from_scene import geometry
from roughslip.stages.result_tables.centre_distribution import Expansion, draw
from workflow.benchmarks.chaos_problem import Solved, Square
from workflow.benchmarks.measure import OURS

Drawn = Callable[[int, int], np.ndarray]  # number of draws, and of their stream -> pressures : (n,) [Pa]
Method = Callable[[Square, Solved, int], Drawn]  # the last is the number of the penetration

DIRECT = ("monte_carlo", "latin_hypercube", "sobol")
EQUATIONS = ("equation_8", "equation_9")


def direct(square: Square, solved: Solved, level: int) -> Drawn:
    """The pressures themselves, at the central nodes."""
    pressure = solved.pressure[:, level, : square.central].ravel()
    return lambda count, stream: pressure


def equation(method: str) -> Method:
    """Eq. (8) or (9), fitted to the samples in contact alone as stage chaos_square does."""

    def fitted(square: Square, solved: Solved, level: int) -> Drawn:
        basis = hermite_basis(solved.xi @ square.directions[0].T, square.indices)
        one = Expansion(method, basis, solved.pressure[:, level, 0], square.indices)
        coefficients = one.fit().coefficients
        return lambda count, stream: draw(one, coefficients, count, [square.seed, geometry.STREAM_DRAWS, stream])

    return fitted


def ours(square: Square, solved: Solved, level: int) -> Drawn:
    """The local expansion of all samples at all training nodes."""
    variables = np.einsum("km,nvm->knv", solved.xi, square.directions)
    samples = Samples(variables, square.nodes.distance2, solved.pressure[:, level], solved.gap[:, level], square.odd)
    found = fit_local(samples, int(square.indices.sum(axis=1).max()), square.target)
    return lambda count, stream: found.draw(np.random.default_rng([square.seed, geometry.STREAM_DRAWS, stream]), count)


# By the design of the solves: the paper's fits and ours take Latin hypercubes, as in the study.
METHODS: dict[str, dict[str, Method]] = {
    "monte_carlo": {"monte_carlo": direct},
    "sobol": {"sobol": direct},
    "latin_hypercube": {
        "latin_hypercube": direct,
        **{method: equation(method) for method in EQUATIONS},
        OURS: ours,
    },
}
