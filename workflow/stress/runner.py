"""Campaigns of random problems: what a problem is, the row that comes of it, and the command that runs them.

A row is `{stage, case, outcome, residual}`, and `why` where it is a failure. The case is `key=value` pairs; its number
and the seed of the campaign make the problem again. The outcome is one of

- `converged`: the judge accepts the answer,
- `false claim`: the judge finds a condition that the answer breaks; always a failure,
- the name of an exception: a failure unless it is a typed error that answers the problem.

A plain loop over numbers draws the problems: judges hold at a stated risk for independent draws alone, and any number
is solved again without those before it. Processes share the numbers:

    python -m workflow.stress.runner --seed today --share 0.1 -j 2 --output results/stress.json
    python -m workflow.stress.runner oscillator --seed 20261 --only 1830
"""

from __future__ import annotations

import argparse
import datetime
import json
import math
import re
import sys
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from roughslip import store
from roughslip.errors import RoughslipError
from workflow.evidence.rows import Row, case, fields, map_parallel

# Problems of a whole campaign; the slow ones first, so that processes end together.
CAMPAIGNS = {"accuracy": 100, "oscillator": 2000, "contact": 10_000, "chaos": 2000, "surface": 2000, "friction": 2000}
SEED = 20261
CHUNK = 5  # problems that a process takes at a time
LISTED = 50  # failures that are printed

CONVERGED, FALSE_CLAIM = "converged", "false claim"
ADVICE = re.compile(
    r"\b(take|lower|use|ask|penetrate|expand|give|solve|lengthen|space|add|choose|cut|try|make|let)\b", re.IGNORECASE
)

Choice = TypeVar("Choice")
Conditions = dict[str, tuple[float, float]]  # by name, a value and the limit that it must not exceed


def log_uniform(generator: np.random.Generator, low: float, high: float) -> float:
    """Draw a number between two powers of ten, given by their exponents."""
    return float(10 ** generator.uniform(low, high))


def choose(
    generator: np.random.Generator, choices: Sequence[Choice], shares: Sequence[float] | np.ndarray | None = None
) -> Choice:
    """Draw one of the choices with these probabilities, which are equal if not given."""
    return choices[int(generator.choice(len(choices), p=shares))]


@dataclass(frozen=True)
class Verdict:
    """What a judge finds: a relative residual [-] of its own, and the conditions that the answer breaks."""

    residual: float
    broken: tuple[str, ...] = ()


def verdict_of(conditions: Conditions, residual: float | None = None) -> Verdict:
    """Return the verdict on conditions: a line for each whose value exceeds its limit or is not a number.

    residual : [-] if not given, the largest value over its limit; a limit of zero asks for an exact answer and does
        not enter
    """
    broken = tuple(
        f"{name}: {float(value):.3e} for {float(limit):.3e}"
        for name, (value, limit) in conditions.items()
        if not value <= limit
    )
    if residual is None:
        residual = max((float(value / limit) for value, limit in conditions.values() if limit > 0), default=0.0)
    return Verdict(residual, broken)


@dataclass(frozen=True)
class Problem:
    """A random problem. case : its numbers and words; solve, judge : give the answer and the verdict on it

    is_answer : whether a typed error answers the problem, because it has no solution or none that can be found
    """

    case: Mapping[str, object]
    solve: Callable[[], Any]
    judge: Callable[[Any], Verdict]
    is_answer: Callable[[RoughslipError], bool]


def unless(well_posed: bool, *errors: type[RoughslipError]) -> Callable[[RoughslipError], bool]:
    """Answers are these errors, if they say what to try and the problem is not well posed."""
    return lambda error: isinstance(error, errors) and has_advice(error) and not well_posed


def has_advice(error: RoughslipError) -> bool:
    """Whether the message of an error says what to try."""
    return ADVICE.search(str(error)) is not None


def row_of(stage: str, number: int, drawn: Callable[[], Problem]) -> Row:
    """Draw and solve a problem with every warning an error, judge the answer, and return the row."""
    problem, residual, why = None, math.nan, ""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            problem = drawn()
            verdict = problem.judge(problem.solve())
            outcome, residual = FALSE_CLAIM if verdict.broken else CONVERGED, verdict.residual
            why = "; ".join(verdict.broken)
        except Exception as error:  # Any exception but an answer is a failure, which the row names.
            outcome, residual = type(error).__name__, getattr(error, "residual", math.nan)
            if not (isinstance(error, RoughslipError) and problem and problem.is_answer(error)):
                why = str(error) or repr(error)
    names = {"number": number, "tolerance": 1} | dict(problem.case if problem else {})
    short = {name: f"{value:.4g}" if isinstance(value, float) else value for name, value in names.items()}
    row = {"stage": stage, "case": case(**short), "outcome": outcome}
    return row | {"residual": float(residual) if math.isfinite(residual) else None} | ({"why": why} if why else {})


def failures(rows: Iterable[Row]) -> list[Row]:
    """Return the rows that a campaign must not have."""
    return [row for row in rows if "why" in row]


def summary(rows: Iterable[Row]) -> list[dict[str, Any]]:
    """Return counts of outcomes and the largest residual over its tolerance, by stage."""
    stages: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        stages[row["stage"]].append(row)
    found = []
    for stage, members in stages.items():
        right = [row for row in members if row["outcome"] == CONVERGED and row["residual"] is not None]
        worst = max((row["residual"] / float(fields(row["case"])["tolerance"]) for row in right), default=None)
        outcomes = dict(sorted(Counter(row["outcome"] for row in members).items()))
        counts = {"problems": len(members), "outcomes": outcomes, "worst_residual_over_tolerance": worst}
        found.append({"stage": stage, **counts, "failures": len(failures(members))})
    return found


def write(path: Path, rows: Sequence[Row], seeds: Mapping[str, int]) -> None:
    """Write seeds, summary and rows, each row on a line of its own, in one step."""
    head = {"seeds": seeds, "problems": len(rows), "failures": len(failures(rows))}
    lines = [json.dumps(head, allow_nan=False)[:-1] + ","]
    for name, entries, end in (("summary", summary(rows), ","), ("rows", rows, "}")):
        lines += [f'"{name}": [', ",\n".join(json.dumps(entry, allow_nan=False) for entry in entries), f"]{end}"]
    store.write_text(path, "\n".join(lines) + "\n")


def solved(task: tuple[str, int, int]) -> Row:
    """Return the row of the problem of (stage, seed, number)."""
    stage, seed, number = task
    return row_of(stage, number, partial(import_module(f"workflow.stress.{stage}").problem, seed, number))


def main() -> int:
    """Return 1 if a problem failed."""
    parser = argparse.ArgumentParser(description="Solve random problems and judge the answers by independent code.")
    parser.add_argument("campaigns", nargs="*", help=f"of {', '.join(CAMPAIGNS)}; default all")
    parser.add_argument("--seed", default=str(SEED), help=f"a whole number, or `today`; default {SEED}")
    parser.add_argument("--share", type=float, default=1.0, help="of each campaign's problems, at least one")
    parser.add_argument("--only", type=int, nargs="+", metavar="NUMBER", help="only the problems of these numbers")
    parser.add_argument("-j", "--jobs", type=int, default=1, help="processes")
    parser.add_argument("--output", type=Path, help="the JSON file")
    given = parser.parse_args()
    if not set(given.campaigns) <= set(CAMPAIGNS):
        parser.error(f"campaigns are {', '.join(CAMPAIGNS)}")
    if not 0 < given.share <= 1:
        parser.error(f"--share is above 0 and at most 1, not {given.share}")
    seed = int(f"{datetime.date.today():%Y%m%d}") if given.seed == "today" else int(given.seed)
    stages = given.campaigns or list(CAMPAIGNS)
    numbers = {stage: given.only or range(max(1, round(given.share * CAMPAIGNS[stage]))) for stage in stages}
    rows = map_parallel(solved, [(s, seed, n) for s in stages for n in numbers[s]], given.jobs, CHUNK)
    if given.output:
        write(given.output, rows, dict.fromkeys(stages, seed))
    for found in summary(rows):
        counts = ", ".join(f"{count} {name}" for name, count in found["outcomes"].items())
        print(f"{found['stage']}, seed {seed}: {counts}; {found['failures']} failures")
    wrong = failures(rows)
    for row in wrong[:LISTED]:
        print(f"{row['stage']} {row['outcome']}: {row['case']}: {row['why']}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
