"""The campaigns' common parts: samplers, the outcome of a problem, its row, the command of a stage, and the joint file.

A row is `{stage, case, outcome, residual}`, and `why` where it is a failure. The case is `key=value` pairs; its number
and the seed of the campaign make the problem again. The outcome is one of

- `converged`: the judge accepts the answer,
- `false claim`: the judge finds a condition that the answer breaks; always a failure,
- `accepted`: the package took bad input; always a failure,
- the name of an exception: a failure unless it is a typed error that answers the problem.

`python -m workflow.stress.contact -j 2 --output results/stress/contact.json` runs a campaign, `--only 17` one problem.
`python -m workflow.stress.runner --campaigns FILE ... --output results/stress.json` joins the files of the stages.
"""

from __future__ import annotations

import argparse
import dataclasses
import datetime
import json
import math
import re
import sys
import time
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from roughslip import store
from roughslip.errors import ParameterError, RoughslipError
from workflow.evidence.rows import Row, case, fields, map_parallel

CONVERGED, FALSE_CLAIM, ACCEPTED = "converged", "false claim", "accepted"
SEED = 20261
CHUNK = 20  # problems that a process takes at a time
LISTED = 50  # failures that the log lists
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
    """What a judge finds.

    residual : [-] relative, by the judge's own evaluation
    broken : the conditions that the answer breaks, each with its value and limit; empty for an accepted answer
    """

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


def has_advice(error: RoughslipError) -> bool:
    """Whether the message of an error says what to try."""
    return ADVICE.search(str(error)) is not None


def case_of(problem: Any) -> str:
    """Return the name of a problem: every number and word among its fields, the types of its parts, and their fields.

    The tolerance is 1 for a problem that has none.
    """
    return case(**({"number": problem.number, "tolerance": 1} | _named_values(problem)))


def _named_values(part: Any) -> dict[str, str]:
    names: dict[str, str] = {}
    for field in dataclasses.fields(part):
        value = getattr(part, field.name)
        if isinstance(value, dict):
            names |= value
        elif dataclasses.is_dataclass(value):
            names |= {field.name: type(value).__name__, **_named_values(value)}
        elif isinstance(value, str | int | float | tuple):
            names[field.name] = ",".join(map(_short, value)) if isinstance(value, tuple) else _short(value)
    return names


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def problem_row(
    stage: str, problem: Any, judged: Callable[[Any], Verdict], is_answer: Callable[[Any, RoughslipError], bool]
) -> Row:
    """Solve and judge a problem and return its row.

    judged : solves the problem and returns the verdict
    is_answer : whether a typed error answers the problem
    """
    return _row(stage, case_of(problem), partial(judged, problem), partial(is_answer, problem))


def refusal_row(stage: str, case: str, call: Callable[[], object]) -> Row:
    """Return the row of bad input, which only a ParameterError answers."""

    def judged() -> Verdict:
        call()
        return Verdict(0.0)

    row = _row(stage, case, judged, lambda error: isinstance(error, ParameterError))
    return row | {"outcome": ACCEPTED, "why": "no error"} if row["outcome"] == CONVERGED else row


def _row(stage: str, case: str, judged: Callable[[], Verdict], answers: Callable[[RoughslipError], bool]) -> Row:
    """Return the row of a problem that is solved with every warning an error."""
    residual, why = math.nan, ""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            verdict = judged()
            outcome, residual = FALSE_CLAIM if verdict.broken else CONVERGED, verdict.residual
            why = "; ".join(verdict.broken)
        except Exception as error:  # Any exception but an answer is a failure, which the row names.
            outcome, residual = type(error).__name__, getattr(error, "residual", math.nan)
            if not (isinstance(error, RoughslipError) and answers(error)):
                why = str(error) or repr(error)
    finite = residual if math.isfinite(residual) else None
    return {"stage": stage, "case": case, "outcome": outcome, "residual": finite} | ({"why": why} if why else {})


def failures(rows: Iterable[Row]) -> list[Row]:
    """Return the rows that a campaign must not have."""
    return [row for row in rows if "why" in row]


def summary(rows: Iterable[Row]) -> list[dict[str, Any]]:
    """Return counts of outcomes and the largest residual over its tolerance, by stage."""
    stages: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        stages[row["stage"]].append(row)
    return [
        {
            "stage": stage,
            "problems": len(members),
            "outcomes": dict(sorted(Counter(row["outcome"] for row in members).items())),
            "worst_residual_over_tolerance": max(
                (
                    row["residual"] / float(fields(row["case"])["tolerance"])
                    for row in members
                    if row["outcome"] == CONVERGED and row["residual"] is not None
                ),
                default=None,
            ),
            "failures": len(failures(members)),
        }
        for stage, members in stages.items()
    ]


def run_problems(row_of: Callable[[int, int], Row], seed: int, numbers: Sequence[int], jobs: int = 1) -> list[Row]:
    """Return the rows of the problems of these numbers, in their order for any number of processes.

    row_of : (seed, number) -> row, a function at the top of a module
    """
    work = partial(row_of, seed)
    return [work(number) for number in numbers] if jobs == 1 else map_parallel(work, numbers, jobs, CHUNK)


def write_campaign(path: Path, rows: Sequence[Row], seeds: Mapping[str, int]) -> None:
    """Write seeds, summary and rows, each row on a line of its own, in one step."""
    head = {"seeds": seeds, "problems": len(rows), "failures": len(failures(rows))}
    lines = [json.dumps(head, allow_nan=False)[:-1] + ","]
    for name, entries, end in (("summary", summary(rows), ","), ("rows", rows, "}")):
        lines += [f'"{name}": [', ",\n".join(json.dumps(entry, allow_nan=False) for entry in entries), f"]{end}"]
    store.write_text(path, "\n".join(lines) + "\n")


def command(
    description: str | None, stage: str, row_of: Callable[[int, int], Row], problems: int, most: int = sys.maxsize
) -> int:
    """Run the campaign of a stage from the command line and return the exit status, which is 1 if a problem failed.

    problems : how many, if the command line does not say
    most : how many there are, where they are a list
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--output", type=Path, help="the JSON file")
    parser.add_argument("--seed", default=SEED, type=_seed, help=f"a whole number, or `today`; default {SEED}")
    parser.add_argument("--problems", type=int, default=problems, help=f"how many, from number 0; default {problems}")
    parser.add_argument("--share", type=float, default=1.0, help="of them, at least one; a list is always whole")
    parser.add_argument("--only", type=int, nargs="+", metavar="NUMBER", help="only the problems of these numbers")
    parser.add_argument("-j", "--jobs", type=int, default=1, help="processes")
    arguments = parser.parse_args()
    started = time.perf_counter()
    share = arguments.share if most == sys.maxsize else 1.0
    wanted = range(min(max(1, round(share * arguments.problems)), most))
    rows = run_problems(row_of, arguments.seed, arguments.only or wanted, arguments.jobs)
    if arguments.output:
        write_campaign(arguments.output, rows, {stage: arguments.seed})
    wrong = failures(rows)
    counts = ", ".join(f"{count} {name}" for name, count in Counter(row["outcome"] for row in rows).most_common())
    title = f"{stage}, seed {arguments.seed}, {time.perf_counter() - started:.0f} s"
    print(f"{title}: {len(rows)} problems: {counts}; {len(wrong)} failures", file=sys.stderr)
    for row in wrong[:LISTED]:
        print(f"{row['outcome']}: {row['case']}: {row['why']}", file=sys.stderr)
    return 1 if wrong else 0


def _seed(text: str) -> int:
    return int(f"{datetime.date.today():%Y%m%d}") if text == "today" else int(text)


def main() -> None:
    parser = argparse.ArgumentParser(description="Join the campaigns of all stages in one file.")
    parser.add_argument("--campaigns", type=Path, nargs="+", required=True, help="files of the stages")
    parser.add_argument("--output", type=Path, required=True, help="the JSON file")
    arguments = parser.parse_args()
    campaigns = [json.loads(path.read_text(encoding="utf-8")) for path in arguments.campaigns]
    rows = [row for campaign in campaigns for row in campaign["rows"]]
    seeds = {stage: seed for one in campaigns for stage, seed in one["seeds"].items()}
    write_campaign(arguments.output, rows, seeds)


if __name__ == "__main__":
    main()
