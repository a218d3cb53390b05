"""What the campaigns share: the outcome of a problem, rows, their summary by class, the file, the command.

A row is `{stage, case, outcome, residual}`, and `why` where it is a failure. The case is `key=value` pairs; its number
and the seed of the campaign make the problem again. The outcome is `converged`, the name of the error, `false claim`
for an answer that its judge does not accept, or `accepted` for bad input that was taken.
"""

from __future__ import annotations

import argparse
import datetime
import json
import math
import os
import re
import sys
import time
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from roughslip.errors import ConvergenceError, ParameterError, RoughslipError
from roughslip.stages.runtime.usage import die_with_parent
from workflow.benchmarks.measure import fields

CONVERGED, FALSE_CLAIM, ACCEPTED = "converged", "false claim", "accepted"

# What every problem must reach. Where a tighter tolerance is asked, an error on the way from here is an honest answer.
DEMANDED = 1e-10

SEED = 20261
CHUNK = 20  # problems that a process takes at a time
LISTED = 50  # failures told one by one
ADVICE = re.compile(
    r"\b(take|lower|use|ask|penetrate|expand|give|solve|lengthen|space|add|choose|cut)\b", re.IGNORECASE
)

Row = dict[str, Any]


@dataclass(frozen=True)
class Verdict:
    """What a judge finds.

    residual : relative, by its own evaluation
    broken : the conditions that the answer breaks, each with its number; none if it is what it claims to be
    """

    residual: float
    broken: tuple[str, ...] = ()


def verdict_of(met: Mapping[str, tuple[float, float]]) -> Verdict:
    """The verdict on conditions `name: (value, limit)`; the residual is the largest value over its limit.

    A limit of zero asks for an exact answer and does not enter the residual.
    """
    numbers = {name: (float(value), float(limit)) for name, (value, limit) in met.items()}
    ratios = [value / limit for value, limit in numbers.values() if limit > 0]
    broken = [f"{name}: {value:.3e} for {limit:.3e}" for name, (value, limit) in numbers.items() if not value <= limit]
    return Verdict(max(ratios, default=0.0), tuple(broken))


def advised(error: RoughslipError) -> bool:
    """Whether an error says what to try."""
    return ADVICE.search(str(error)) is not None


def problem_row(
    stage: str, case: str, judged: Callable[[], Verdict], honest: Callable[[RoughslipError], bool] | None = None
) -> Row:
    """The row of a problem: solved and judged with every warning an error.

    honest : whether a typed error answers it; if not given, only one on the way from DEMANDED to a tighter tolerance
    """
    tighter = float(fields(case)["tolerance"]) < DEMANDED

    def on_the_way(error: RoughslipError) -> bool:
        return isinstance(error, ConvergenceError) and tighter and error.residual <= DEMANDED

    return _row(stage, case, *_outcome(judged, honest or on_the_way))


def refusal_row(stage: str, case: str, call: Callable[[], object]) -> Row:
    """The row of bad input, for which a ParameterError alone will do."""

    def accepted() -> Verdict:
        call()
        return Verdict(0.0)

    outcome, _, why = _outcome(accepted, lambda error: isinstance(error, ParameterError))
    if outcome == CONVERGED:
        outcome, why = ACCEPTED, "no error"
    return _row(stage, case, outcome, math.nan, why)


def _outcome(judged: Callable[[], Verdict], honest: Callable[[RoughslipError], bool]) -> tuple[str, float, str]:
    """Outcome, residual, and why it is a failure, empty if it is none."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            verdict = judged()
        except RoughslipError as error:
            why = "" if honest(error) else str(error) or repr(error)
            return type(error).__name__, getattr(error, "residual", math.nan), why
        except Exception as error:  # of any kind: it is told by its name, and is a failure
            return type(error).__name__, math.nan, str(error) or repr(error)
    return FALSE_CLAIM if verdict.broken else CONVERGED, verdict.residual, "; ".join(verdict.broken)


def _row(stage: str, case: str, outcome: str, residual: float, why: str) -> Row:
    told = residual if math.isfinite(residual) else None
    return {"stage": stage, "case": case, "outcome": outcome, "residual": told} | ({"why": why} if why else {})


def failures(rows: Iterable[Row]) -> list[Row]:
    """The rows that a campaign must not have."""
    return [row for row in rows if "why" in row]


def summary(rows: Iterable[Row], keys: Sequence[str]) -> list[dict[str, Any]]:
    """Counts of the outcomes and the worst residual relative to its tolerance, by the values of these keys."""
    classes: dict[tuple[str, ...], list[Row]] = defaultdict(list)
    for row in rows:
        case = fields(row["case"])
        classes[row["stage"], *(case.get(key, "none") for key in keys)].append(row)
    return [
        _class(dict(zip(("stage", *keys), name, strict=True)), members) for name, members in sorted(classes.items())
    ]


def _class(name: Mapping[str, str], rows: Sequence[Row]) -> dict[str, Any]:
    ratios = [
        row["residual"] / float(fields(row["case"])["tolerance"])
        for row in rows
        if row["outcome"] == CONVERGED and row["residual"] is not None
    ]
    outcomes = dict(sorted(Counter(row["outcome"] for row in rows).items()))
    return {
        **name,
        "problems": len(rows),
        "outcomes": outcomes,
        "worst_residual_over_tolerance": max(ratios, default=None),
        "failures": len(failures(rows)),
    }


def campaign(rows_of: Callable[[int, int], list[Row]], seed: int, numbers: Sequence[int], jobs: int) -> list[Row]:
    """The rows of the problems of these numbers, in their order whatever the number of processes.

    rows_of : (seed, number) -> rows, a function at the top of a module
    """
    work = partial(rows_of, seed)
    if jobs == 1:
        return [row for number in numbers for row in work(number)]
    with ProcessPoolExecutor(jobs, get_context("spawn"), die_with_parent) as pool:
        return [row for rows in pool.map(work, numbers, chunksize=CHUNK) for row in rows]


def write(path: Path, rows: Sequence[Row], by_class: Sequence[Mapping[str, Any]], seeds: Mapping[str, int]) -> None:
    """Write a file whole or not at all: seeds by stage, the summary, then every row on a line of its own."""
    head = {"seeds": seeds, "problems": len(rows), "failures": len(failures(rows))}
    lines = [json.dumps(head, allow_nan=False)[:-1] + ","]
    for name, entries, end in (("summary", by_class, ","), ("rows", rows, "}")):
        lines += [f'"{name}": [', ",\n".join(json.dumps(entry, allow_nan=False) for entry in entries), f"]{end}"]
    path.parent.mkdir(parents=True, exist_ok=True)
    partial_ = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        partial_.write_text("\n".join(lines) + "\n", encoding="utf-8")
        os.replace(partial_, path)
    finally:
        partial_.unlink(missing_ok=True)


def command(
    description: str | None,
    stage: str,
    rows_of: Callable[[int, int], list[Row]],
    refused: Callable[[], list[Row]],
    keys: Sequence[str],
    problems: int = 10_000,
) -> int:
    """The command of a stage's campaign; returns its exit status, 1 if any problem failed."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--output", type=Path, help="the JSON file")
    parser.add_argument("--seed", default=SEED, type=_seed, help=f"a whole number, or `today`; {SEED} if not given")
    parser.add_argument("--problems", type=int, default=problems, help="how many, from number 0 on")
    parser.add_argument("--only", type=int, nargs="+", metavar="NUMBER", help="the problems of these numbers alone")
    parser.add_argument("-j", "--jobs", type=int, default=1, help="processes")
    arguments = parser.parse_args()
    started = time.perf_counter()
    numbers = arguments.only or range(arguments.problems)
    rows = campaign(rows_of, arguments.seed, numbers, arguments.jobs)
    if not arguments.only:
        rows += refused()
    if arguments.output:
        write(arguments.output, rows, summary(rows, keys), {stage: arguments.seed})
    return tell(rows, f"{stage}, seed {arguments.seed}, {time.perf_counter() - started:.0f} s")


def tell(rows: Sequence[Row], title: str) -> int:
    """Say what came out, failures one by one, on the standard error; returns the exit status."""
    wrong = failures(rows)
    counts = ", ".join(f"{count} {name}" for name, count in Counter(row["outcome"] for row in rows).most_common())
    print(f"{title}: {len(rows)} problems: {counts}; {len(wrong)} failures", file=sys.stderr)
    for row in wrong[:LISTED]:
        print(f"{row['outcome']}: {row['case']}: {row['why']}", file=sys.stderr)
    if len(wrong) > LISTED:
        print(f"and {len(wrong) - LISTED} more", file=sys.stderr)
    return 1 if wrong else 0


def _seed(text: str) -> int:
    return int(f"{datetime.date.today():%Y%m%d}") if text == "today" else int(text)
