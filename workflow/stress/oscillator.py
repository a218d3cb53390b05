"""Random motions of the mass on the belt, and bad input: every answer is judged, every failure is told by its number.

`python -m workflow.stress.oscillator -j 2 --output results/stress/oscillator.json` runs the campaign, `--only 17` one
of it.
"""

from __future__ import annotations

import re
import sys

from roughslip.errors import ConvergenceError, ParameterError, RoughslipError
from roughslip.oscillator.motion import trajectory
from workflow.benchmarks.measure import case, power
from workflow.stress import outcomes
from workflow.stress.oscillator_judge import judge
from workflow.stress.oscillator_problem import Problem, random_problem
from workflow.stress.oscillator_refusals import REFUSED
from workflow.stress.outcomes import Row, Verdict

STAGE = "oscillator"
CLASSES = ("law", "excitation", "path", "follows", "integrator")
PROBLEMS = 2000
SAMPLES = 126  # a period, so that a stretch is 0.05 of tau
ADVICE = re.compile(r"\b(try|make|let|give|take)\b")


def rows_of(seed: int, number: int) -> list[Row]:
    """The row of the problem of this number."""
    problem = random_problem(seed, number)
    return [
        outcomes.problem_row(
            STAGE, case_of(problem), lambda: judged(problem), lambda error: honest(error, problem.may_turn_negative)
        )
    ]


def refused() -> list[Row]:
    """A row for each kind of bad input."""
    return [
        outcomes.refusal_row(STAGE, case(law="refused", input=name.replace(" ", "-")), call)
        for name, call in REFUSED.items()
    ]


def case_of(problem: Problem) -> str:
    return case(
        number=problem.number,
        **problem.labels,
        damping=f"{problem.oscillator.damping_ratio:.3g}",
        follows=problem.follows,
        negative=problem.negative,
        interpolation=problem.interpolation,
        integrator=problem.integrator,
        tolerance=power(problem.tolerance),
    )


def judged(problem: Problem) -> Verdict:
    """The motion drawn, and judged."""
    drawn = trajectory(
        problem.oscillator,
        problem.law,
        problem.path,
        problem.spacing,
        problem.periods,
        problem.tolerance,
        problem.start,
        problem.stochastic,
        problem.interpolation,
        problem.follows,
        problem.negative,
        problem.integrator,
        SAMPLES,
    )
    return judge(problem, drawn)


def honest(error: RoughslipError, may_turn_negative: bool) -> bool:
    """Whether an error answers a problem: the step limit with advice, or negative friction that is to be refused."""
    if isinstance(error, ParameterError):
        return may_turn_negative and "negative" in str(error)
    return isinstance(error, ConvergenceError) and ADVICE.search(str(error)) is not None


def main() -> int:
    return outcomes.command(__doc__, STAGE, rows_of, refused, CLASSES, PROBLEMS)


if __name__ == "__main__":
    sys.exit(main())
