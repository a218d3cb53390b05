"""Polynomial chaos measured: the pressure at the centre of the square against its reference.

Direct sampling, the paper's eqs. (8) and (9) and ours get the same numbers of contact solves, in designs drawn several
times; each distribution is judged by a Monte Carlo reference of its own random numbers. The seconds of a row are those
of its solves at that penetration alone, which are timed apart, and of its fit and draws. Multilevel Monte Carlo over
meshes is measured too.
"""

from __future__ import annotations

import argparse
import math
import statistics
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from roughslip.errors import IllPosedError
from workflow.benchmarks import chaos_multilevel, measure
from workflow.benchmarks.chaos_methods import DIRECT, EQUATIONS, METHODS
from workflow.benchmarks.chaos_problem import PERCENTILES, Difference, Reference, Solved, Square, references
from workflow.benchmarks.chaos_summary import DECISIVE, summary
from workflow.benchmarks.measure import Row, case, row

PACKAGES = ("numpy", "scipy", "numba")
REFERENCES = Path("results/reference")

Judged = tuple[float, dict[str, Difference]]  # seconds of a design and its differences from the reference


@dataclass(frozen=True)
class Plan:
    """How often a scene is solved.

    latin_hypercube : designs of each number of samples
    monte_carlo, sobol : designs of the largest number; fewer samples are parts of these, of Sobol points the first
    equations : designs of each number that the paper's fits get
    """

    latin_hypercube: Mapping[int, int]
    monte_carlo: int
    sobol: int
    equations: int

    def designs(self, square: Square) -> Iterator[tuple[str, int, Solved]]:
        """Kind of design, its number, and its solves: each is solved once."""
        most = max(self.latin_hypercube)
        for kind, count in (("monte_carlo", self.monte_carlo), ("sobol", self.sobol)):
            for number in range(count):
                whole = square.solved(square.design(kind, most, number))
                for samples in self.latin_hypercube:
                    parts = most // samples if kind == "monte_carlo" else 1
                    for part in range(min(parts, MOST_DESIGNS - number * parts)):
                        yield kind, number * parts + part, whole.part(part * samples, (part + 1) * samples)
        for samples, count in self.latin_hypercube.items():
            for number in range(count):
                yield "latin_hypercube", number, square.solved(square.design("latin_hypercube", samples, number))


MOST_DESIGNS = 20
# 1000 solves of `paper` take a third of a second, of `resolved` 12 s.
PLANS = {
    "paper": Plan({250: 6, 500: 6, 1000: MOST_DESIGNS, 2000: 4, 4000: 3}, 5, 6, 3),
    "resolved": Plan({250: 4, 500: 4, 1000: 2, 2000: MOST_DESIGNS, 4000: 1}, 1, 1, 2),
}


@dataclass(frozen=True)
class Campaign:
    """What is measured.

    draws : from each expansion, as many as in the study; a contact probability of 0.05 is then known to 0.7 %
    timed : solves that are timed at each penetration
    multilevel : surfaces a level
    """

    plans: Mapping[str, Plan] = field(default_factory=lambda: PLANS)
    draws: int = 400_000
    timed: int = 100
    multilevel: int = 400


QUICK = Campaign({"paper": Plan({250: 1, 500: 1}, 1, 1, 1)}, 20_000, 5, 10)


def centre(
    square: Square, references: Sequence[Reference], plan: Plan, campaign: Campaign
) -> tuple[list[Row], dict[str, str]]:
    """A row a penetration, method and number of solves, with the errors of every design; why designs were refused."""
    solve_seconds = square.seconds(campaign.timed)
    found: dict[tuple[int, str, int], list[Judged]] = defaultdict(list)
    refused = {}
    for kind, number, solved in plan.designs(square):
        samples = len(solved.xi)
        for method, way in METHODS[kind].items():
            if method in EQUATIONS and number >= plan.equations:
                continue
            for level, reference in enumerate(references):
                try:
                    seconds, pressure = measure.timed(
                        lambda w=way, s=solved, at=level, n=number: w(square, s, at)(campaign.draws, n)
                    )
                except IllPosedError as error:
                    refused[f"{label(square.name, level)} {method} {samples} {number}"] = str(error)
                    continue
                whole = samples * solve_seconds[level] + seconds
                found[level, method, samples].append((whole, reference.differences(pressure)))
        if kind not in DIRECT or number == 0:
            measure.say(f"{square.name}: {kind} of {samples} solves")
    rows = [
        as_row(label(square.name, level), method, samples, results)
        for (level, method, samples), results in sorted(found.items())
    ]
    return rows, refused


def label(scene: str, level: int) -> str:
    """The case of a scene at a penetration."""
    return case(scene=scene, percentile=f"{PERCENTILES[level]:g}", quantity="pressure")


def as_row(name: str, method: str, samples: int, results: Sequence[Judged]) -> Row:
    """The median distance over designs as the error, net of that of the reference.

    errors, seen : quantity -> net and seen error of every design, None for NaN
    reference_errors : quantity -> standard error of the reference, the median over designs
    """
    found = {quantity: [one[quantity] for _, one in results] for quantity in results[0][1]}
    more = {
        "errors": {quantity: _finite(one.net for one in all_) for quantity, all_ in found.items()},
        "seen": {quantity: _finite(one.seen for one in all_) for quantity, all_ in found.items()},
        "reference_errors": {q: statistics.median(one.reference_error for one in all_) for q, all_ in found.items()},
    }
    median = statistics.median(more["errors"]["distance"])
    return row(name, method, median, [seconds for seconds, _ in results], samples, **more)


def _finite(values: Iterable[float]) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values]


def run(campaign: Campaign, kept: Path) -> dict[str, Any]:
    """The whole benchmark as it stands in the file."""
    rows: list[Row] = []
    refused: dict[str, str] = {}
    for name, plan in campaign.plans.items():
        square, judges = Square.of(name), references(kept / name / "pressure.nc")
        of_centre, why = centre(square, judges, plan, campaign)
        rows += of_centre
        refused |= why
    rows += chaos_multilevel.rows_of(campaign.multilevel)
    return {
        "machine": measure.machine(),
        "versions": measure.versions(PACKAGES),
        "checks": {"draws": campaign.draws, "decisive": DECISIVE},
        "summary": {**summary(rows), "refused": refused},
        "rows": rows,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True, help="the JSON file")
    parser.add_argument("--references", type=Path, default=REFERENCES, help="the folder with <scene>/pressure.nc")
    parser.add_argument("--peers", action="store_true", help="no public program takes part")
    parser.add_argument("--quick", action="store_true", help="few solves, one scene")
    arguments = parser.parse_args()
    campaign = QUICK if arguments.quick else Campaign()
    measure.write(arguments.output, run(campaign, arguments.references))


if __name__ == "__main__":
    main()
