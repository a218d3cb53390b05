"""Random contact problems, and bad input: every answer is judged, every failure is told by its number.

`python -m workflow.stress.contact -j 2 --output results/stress/contact.json` runs the campaign, `--only 17` one of it.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator

from roughslip.contact.influence import Influence
from roughslip.contact.solve import ContactSolution, solve, solve_load, sweep
from workflow.benchmarks.measure import case, power
from workflow.stress import outcomes
from workflow.stress.contact_judge import Displacement, judge
from workflow.stress.contact_problem import Problem, random_problem
from workflow.stress.contact_refusals import REFUSED
from workflow.stress.outcomes import Row, Verdict

STAGE = "contact"
LEAST_HARDNESS = 1.02  # mean pressures; at 1 all nodes yield
CLASSES = ("control", "material", "surface")


def rows_of(seed: int, number: int) -> list[Row]:
    """The row of the problem of this number."""
    problem = random_problem(seed, number)
    return [outcomes.problem_row(STAGE, case_of(problem), lambda: judged(problem))]


def refused() -> list[Row]:
    """A row for each kind of bad input."""
    return [
        outcomes.refusal_row(STAGE, case(control="refused", input=name.replace(" ", "-")), call)
        for name, call in REFUSED.items()
    ]


def case_of(problem: Problem) -> str:
    grid = problem.grid
    return case(
        number=problem.number,
        nx=grid.nx,
        ny=grid.ny,
        aspect=f"{grid.dx / grid.dy:.3g}",
        surface=problem.surface,
        control=problem.control,
        material="elastic" if math.isinf(problem.cap) else "capped",
        cap=f"{problem.cap:.2g}",
        cell=f"{min(grid.dx, grid.dy):.3g}",
        modulus=f"{problem.modulus:.3g}",
        **problem.labels,
        tolerance=power(problem.tolerance),
    )


def judged(problem: Problem) -> Verdict:
    """The problem solved; of a sweep the worst plane."""
    displacement = Displacement(problem.grid, problem.modulus, problem.periodic)
    hardness, found = solutions(problem)
    asked = problem.planes if problem.load is None else (None,)
    verdicts = [
        judge(problem, displacement, solution, plane, hardness) for plane, solution in zip(asked, found, strict=True)
    ]
    broken = (f"plane {k}: {what}" for k, verdict in enumerate(verdicts) for what in verdict.broken)
    return Verdict(max(verdict.residual for verdict in verdicts), tuple(broken))


def solutions(problem: Problem) -> tuple[float, list[ContactSolution]]:
    """The hardness [Pa] and the solver's answers, one a plane."""
    influence = Influence(problem.grid, problem.modulus, periodic=problem.periodic)
    hardness = math.inf
    if math.isfinite(problem.cap):
        peak = max(float(elastic.pressure.max()) for elastic in _solve(problem, influence, 1e-3, math.inf))
        hardness = max(problem.cap * peak, LEAST_HARDNESS * (problem.load or 0.0)) or problem.modulus
    return hardness, list(_solve(problem, influence, problem.tolerance, hardness))


def _solve(problem: Problem, influence: Influence, tolerance: float, hardness: float) -> Iterator[ContactSolution]:
    if problem.load is not None:
        yield solve_load(influence, problem.heights, problem.load, tolerance, hardness_pa=hardness)
    elif problem.control == "sweep":
        yield from sweep(influence, problem.heights, problem.planes, tolerance, hardness)
    else:
        yield solve(influence, problem.heights - problem.planes[0], tolerance, hardness_pa=hardness)


def main() -> int:
    return outcomes.command(__doc__, STAGE, rows_of, refused, CLASSES)


if __name__ == "__main__":
    sys.exit(main())
