"""Measure polynomial chaos: the distribution of the pressure at the centre of the square against its reference.

Direct sampling, the paper's eqs. (8) and (9), and our expansion get the same numbers of contact solves, in several
designs. A Monte Carlo reference with its own random numbers judges each distribution. The seconds of a row are those of
its solves at that penetration alone, which are timed separately, and of its fit and draws.
"""

from __future__ import annotations

import math
import statistics
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from roughslip.chaos.hermite import hermite_basis
from roughslip.chaos.local import Samples, fit_local
from roughslip.errors import IllPosedError
from roughslip.stages.from_scene import geometry
from roughslip.stages.result_tables.centre_distribution import Expansion, draw
from workflow.benchmarks.chaos_problem import (
    KEPT_RESULTS,
    PERCENTILES,
    Difference,
    MonteCarloReference,
    Solved,
    Square,
    read_references,
)
from workflow.benchmarks.runner import OURS, make_row, report_progress, run_command, timed
from workflow.evidence.rows import Row, case

Drawn = Callable[[int, int], np.ndarray]  # number of draws, and of their stream -> pressures (n,) [Pa]
Method = Callable[[Square, Solved, int], Drawn]  # the last argument is the index of the penetration

EQUATIONS = ("equation_8", "equation_9")


def sample_directly(square: Square, solved: Solved, level: int) -> Drawn:
    """Take the pressures themselves, at the central nodes."""
    pressure = solved.pressure[:, level, : square.central].ravel()
    return lambda count, stream: pressure


def fit_equation(method: str) -> Method:
    """Return a fit of eq. (8) or (9) to the samples in contact alone, as in stage chaos_square."""

    def fit(square: Square, solved: Solved, level: int) -> Drawn:
        basis = hermite_basis(solved.xi @ square.directions[0].T, square.indices)
        one = Expansion(method, basis, solved.pressure[:, level, 0], square.indices)
        coefficients = one.fit().coefficients
        return lambda count, stream: draw(one, coefficients, count, [square.seed, geometry.STREAM_DRAWS, stream])

    return fit


def fit_local_expansion(square: Square, solved: Solved, level: int) -> Drawn:
    """Fit our local expansion to all samples at all training nodes."""
    variables = np.einsum("km,nvm->knv", solved.xi, square.directions)
    samples = Samples(variables, square.nodes.distance2, solved.pressure[:, level], solved.gap[:, level], square.odd)
    found = fit_local(samples, int(square.indices.sum(axis=1).max()), square.target)
    return lambda count, stream: found.draw(np.random.default_rng([square.seed, geometry.STREAM_DRAWS, stream]), count)


# By the design of the solves: fits get Latin hypercubes, as in the study.
METHODS: dict[str, dict[str, Method]] = {
    "monte_carlo": {"monte_carlo": sample_directly},
    "sobol": {"sobol": sample_directly},
    "latin_hypercube": {
        "latin_hypercube": sample_directly,
        **{method: fit_equation(method) for method in EQUATIONS},
        OURS: fit_local_expansion,
    },
}


@dataclass(frozen=True)
class Plan:
    """How often a scene is solved.

    latin_hypercube : designs of each number of samples
    monte_carlo, sobol : designs of the largest number; fewer samples are parts of these, of Sobol points the first
    equations : designs of each number to which the paper's equations are fitted
    """

    latin_hypercube: Mapping[int, int]
    monte_carlo: int
    sobol: int
    equations: int

    def designs(self, square: Square) -> Iterator[tuple[str, int, Solved]]:
        """Yield the kind of a design, its number, and its solves; each surface is solved once."""
        most = max(self.latin_hypercube)
        for kind, count in (("monte_carlo", self.monte_carlo), ("sobol", self.sobol)):
            for number in range(count):
                whole = square.solve(square.design(kind, most, number))
                for samples in self.latin_hypercube:
                    parts = most // samples if kind == "monte_carlo" else 1
                    for part in range(min(parts, MOST_DESIGNS - number * parts)):
                        yield kind, number * parts + part, whole.part(part * samples, (part + 1) * samples)
        for samples, count in self.latin_hypercube.items():
            for number in range(count):
                yield "latin_hypercube", number, square.solve(square.design("latin_hypercube", samples, number))


MOST_DESIGNS = 20
# 1000 solves of `paper` take a third of a second, of `resolved` 12 s.
PLANS = {
    "paper": Plan({250: 6, 500: 6, 1000: MOST_DESIGNS, 2000: 4, 4000: 3}, 5, 6, 3),
    "resolved": Plan({250: 4, 500: 4, 1000: 2, 2000: MOST_DESIGNS, 4000: 1}, 1, 1, 2),
}


@dataclass(frozen=True)
class Sizes:
    """What is measured.

    draws : from each expansion, as in the study; a contact probability of 0.05 is then known to 0.7 %
    timed : solves that are timed at each penetration
    """

    plans: Mapping[str, Plan] = field(default_factory=lambda: PLANS)
    draws: int = 400_000
    timed: int = 100


QUICK = Sizes({"paper": Plan({250: 1, 500: 1}, 1, 1, 1)}, 20_000, 5)


def compare_methods(
    square: Square, references: Sequence[MonteCarloReference], plan: Plan, sizes: Sizes
) -> tuple[list[Row], dict[str, str]]:
    """Return a row for each penetration, method and number of solves, and why designs were refused."""
    solve_seconds = square.solve_seconds(sizes.timed)
    found: dict[tuple[int, str, int], list[tuple[float, dict[str, Difference]]]] = defaultdict(list)
    refused = {}
    for kind, number, solved in plan.designs(square):
        samples = len(solved.xi)
        for method, prepare in METHODS[kind].items():
            if method in EQUATIONS and number >= plan.equations:
                continue
            for level, reference in enumerate(references):
                try:
                    seconds, pressure = timed(
                        lambda p=prepare, s=solved, at=level, n=number: p(square, s, at)(sizes.draws, n)
                    )
                except IllPosedError as error:
                    refused[f"{case_of(square.name, level)} {method} {samples} {number}"] = str(error)
                    continue
                whole = samples * solve_seconds[level] + seconds
                found[level, method, samples].append((whole, reference.differences(pressure)))
        if kind == "latin_hypercube" or number == 0:
            report_progress(f"{square.name}: {kind} of {samples} solves")
    rows = [
        row_of_designs(case_of(square.name, level), method, samples, results)
        for (level, method, samples), results in sorted(found.items())
    ]
    return rows, refused


def case_of(scene: str, level: int) -> str:
    """Return the case of a scene at a penetration."""
    return case(scene=scene, percentile=f"{PERCENTILES[level]:g}", quantity="pressure")


def row_of_designs(name: str, method: str, samples: int, results: Sequence[tuple[float, dict[str, Difference]]]) -> Row:
    """Return the row of several designs, each with its seconds and its differences from the reference.

    error : the median Kolmogorov distance, net of the error of the reference
    errors : by quantity, the net errors of every design; None where there is no value
    """
    errors = {}
    for quantity in results[0][1]:
        net = [differences[quantity].net for _, differences in results]
        errors[quantity] = [value if math.isfinite(value) else None for value in net]
    median = statistics.median(errors["distance"])
    return make_row(name, method, median, [seconds for seconds, _ in results], samples, errors=errors)


def measure(quick: bool, _: bool) -> dict[str, Any]:
    """Return the summary and the rows."""
    sizes = QUICK if quick else Sizes()
    rows: list[Row] = []
    refused: dict[str, str] = {}
    for name, plan in sizes.plans.items():
        references = read_references(KEPT_RESULTS / name / "pressure.nc")
        of_scene, reasons = compare_methods(Square.of(name), references, plan, sizes)
        rows += of_scene
        refused |= reasons
    return {"summary": {"refused": refused}, "rows": rows}


if __name__ == "__main__":
    run_command(__doc__, measure)
