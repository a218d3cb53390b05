"""Random rough surfaces, and bad input: every answer is judged, every failure is told by its number.

`python -m workflow.stress.surface -j 2 --output results/stress/surface.json` runs the campaign, `--only 17` one of it.
Of ten problems six are of fields on meshes, three of laws of heights, one of fits.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np

from roughslip.errors import IllPosedError, ParameterError, RoughslipError
from roughslip.surface.embedding import MOST_FOLDS, embed
from roughslip.surface.karhunen_loeve import karhunen_loeve
from roughslip.surface.lanczos import leading_modes
from workflow.benchmarks.measure import case
from workflow.stress import outcomes, surface_fit, surface_law
from workflow.stress.outcomes import Row, Verdict, advised, verdict_of
from workflow.stress.surface_judge import judge_embedding, judge_expansion, judge_modes
from workflow.stress.surface_problem import Problem, random_problem
from workflow.stress.surface_refusals import REFUSED

STAGE = "surface"
CLASSES = ("entry", "kernel")
PROBLEMS = 2000
LAWS, FIT = (2, 5, 8), 9  # last digits


def rows_of(seed: int, number: int) -> list[Row]:
    """The row of the problem of this number."""
    digit = number % 10
    if digit in LAWS:
        law = surface_law.random_problem(seed, number)
        return [_row(surface_law.case_of(law), lambda: surface_law.judged(law), lambda e: surface_law.honest(law, e))]
    if digit == FIT:
        fit = surface_fit.random_problem(seed, number)
        return [_row(surface_fit.case_of(fit), lambda: surface_fit.judged(fit), lambda e: surface_fit.honest(fit, e))]
    problem = random_problem(seed, number)
    return [_row(case_of(problem), lambda: judged(problem), lambda error: honest(problem, error))]


def _row(name: str, judged_: Callable[[], Verdict], honest_: Callable[[RoughslipError], bool]) -> Row:
    return outcomes.problem_row(STAGE, name, judged_, honest_)


def refused() -> list[Row]:
    """A row for each kind of bad input."""
    return [
        outcomes.refusal_row(STAGE, case(entry="refused", input=name.replace(" ", "-")), call)
        for name, call in REFUSED.items()
    ]


def case_of(problem: Problem) -> str:
    grid, covariance = problem.grid, problem.covariance
    along, across = covariance.lengths_m
    shape = {"matern": covariance.smoothness, "self_affine": covariance.hurst}.get(covariance.kind)
    return case(
        number=problem.number,
        entry=problem.entry,
        nx=grid.nx,
        ny=grid.ny,
        kernel=covariance.kind,
        order=problem.order or "none",
        share="none" if problem.share is None else f"{problem.share:.9g}",
        cell=f"{min(grid.dx, grid.dy):.3g}",
        aspect=f"{grid.dx / grid.dy:.3g}",
        length=f"{along / np.sqrt(grid.cell_area):.3g}",
        ratio=f"{across / along:.3g}",
        lay=f"{covariance.lay_rad:.3g}",
        shape="none" if shape is None else f"{shape:.3g}",
        bandwidth=f"{covariance.bandwidth or 1:.3g}",
        rms=f"{covariance.rms_height_m:.3g}",
        tolerance=1,
    )


def judged(problem: Problem) -> Verdict:
    """The field expanded or embedded."""
    covariance, grid = problem.covariance, problem.grid
    if problem.entry == "embedding":
        return judge_embedding(problem, embed(covariance, grid))
    if problem.entry == "expansion":
        return judge_expansion(problem, karhunen_loeve(covariance, grid, problem.order, share=problem.share))
    eigenvalues, vectors, residuals = leading_modes(covariance, grid, problem.order or 1)
    return verdict_of(judge_modes(problem, eigenvalues, vectors, residuals, False))


def honest(problem: Problem, error: RoughslipError) -> bool:
    """Whether an error answers a problem: waves of a self-affine field far longer than the mesh, or below its cells."""
    covariance, grid = problem.covariance, problem.grid
    if problem.entry != "embedding" or covariance.kind != "self_affine" or not advised(error):
        return False
    longest, shortest = max(covariance.rolloff_wavelengths_m), min(covariance.cutoff_wavelengths_m)
    folds = max(grid.dx, grid.dy) / shortest > MOST_FOLDS
    far = longest > min(grid.nx * grid.dx, grid.ny * grid.dy)
    return folds if isinstance(error, ParameterError) else isinstance(error, IllPosedError) and far


def main() -> int:
    return outcomes.command(__doc__, STAGE, rows_of, refused, CLASSES, PROBLEMS)


if __name__ == "__main__":
    sys.exit(main())
