"""Random polynomial chaos expansions, and bad input: every answer is judged, every failure is told by its number.

`python -m workflow.stress.chaos -j 2 --output results/stress/chaos.json` runs the campaign, `--only 17` one of it. Of
SHARE problems one is of contact pressures, at one node or along a strip, the others are of functions of any kind.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

from roughslip.chaos.hermite import hermite_basis
from roughslip.chaos.regression import Fit, least_squares
from roughslip.chaos.sensitivity import sensitivity
from roughslip.errors import ConvergenceError, IllPosedError, RoughslipError
from workflow.benchmarks.measure import case
from workflow.stress import chaos_contact, chaos_strip, outcomes
from workflow.stress.chaos_judge import judge, judge_shares, well_posed
from workflow.stress.chaos_problem import Problem, random_problem
from workflow.stress.chaos_refusals import REFUSED
from workflow.stress.outcomes import Row, Verdict, advised

STAGE = "chaos"
SHARE = 4
CLASSES = ("entry", "function", "copies")
PROBLEMS = 2000


def rows_of(seed: int, number: int) -> list[Row]:
    """The row of the problem of this number."""
    if number % (2 * SHARE) == SHARE:
        strip = chaos_strip.random_problem(seed, number)
        return [_row(chaos_strip.case_of(strip), lambda: chaos_strip.judged(strip), strip.well_posed)]
    if number % SHARE == 0:
        contact = chaos_contact.random_problem(seed, number)
        return [_row(chaos_contact.case_of(contact), lambda: chaos_contact.judged(contact), contact.well_posed)]
    problem = random_problem(seed, number)
    return [_row(case_of(problem), lambda: judged(problem), lambda: well_posed(problem))]


def refused() -> list[Row]:
    """A row for each kind of bad input."""
    return [
        outcomes.refusal_row(STAGE, case(entry="refused", input=name.replace(" ", "-")), call)
        for name, call in REFUSED.items()
    ]


def case_of(problem: Problem) -> str:
    return case(
        number=problem.number,
        entry="least-squares",
        function=problem.name,
        variables=problem.indices.shape[1],
        degree=problem.degree,
        terms=len(problem.indices),
        **problem.labels,
        tolerance=1,
    )


def judged(problem: Problem) -> Verdict:
    """The function expanded, and the shares of its variables where they explain anything."""
    found = solution(problem)
    verdict = judge(problem, found)
    if not found.coefficients[1:].any():
        return verdict
    shares = sensitivity(problem.indices, found.coefficients)
    return Verdict(verdict.residual, verdict.broken + judge_shares(problem, found, shares))


def solution(problem: Problem) -> Fit:
    """The least-squares expansion of a problem."""
    return least_squares(hermite_basis(problem.points, problem.indices), problem.target, problem.weights)


def honest(error: RoughslipError, solvable: Callable[[], bool]) -> bool:
    """Whether an error answers a problem: of a type that says so, with advice, and not where there is a solution."""
    typed = isinstance(error, IllPosedError | ConvergenceError)
    return typed and advised(error) and not solvable()


def _row(name: str, judged_: Callable[[], Verdict], solvable: Callable[[], bool]) -> Row:
    return outcomes.problem_row(STAGE, name, judged_, lambda error: honest(error, solvable))


def main() -> int:
    return outcomes.command(__doc__, STAGE, rows_of, refused, CLASSES, PROBLEMS)


if __name__ == "__main__":
    sys.exit(main())
