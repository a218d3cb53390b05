"""Random problems, each judged by code that the solver lacks, and the command that runs them by the thousand.

A subject is a module with one function `attempt(trial)`: it draws a problem, names it, solves it and checks the answer.
Seed and number make a problem again, alone. Its row is `{stage, case, outcome, residual}`, and `why` where it failed.
The outcome is one of

- `converged`: every check holds; the residual is the largest value over its limit,
- `false claim`: the answer breaks a check; always a failure,
- the name of an exception: a failure unless it is a typed error that the problem allows and that says what to try.

    python -m tests.properties.campaign --seed today --share 0.1 -j 2 --output results/stress.json
    python -m tests.properties.campaign oscillator --seed 20261 --only 1830

Problems are independent draws in given shares, for which alone the risks of judges hold; Hypothesis draws otherwise.
"""

from __future__ import annotations

import argparse
import datetime
import json
import math
import re
import sys
import time
import warnings
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from roughslip import store
from roughslip.errors import RoughslipError

# Problems of a whole campaign; the slow ones first, so that processes end together. Two hours on two cores.
CAMPAIGNS = {
    "scenes": 300,
    "machines": 400,
    "oscillator": 2000,
    "contact": 10_000,
    "chaos": 2000,
    "surface": 2000,
    "friction": 2000,
}
SEED = 20261
CONVERGED, FALSE_CLAIM = "converged", "false claim"
ADVICE = re.compile(
    r"\b(take|lower|use|ask|penetrate|expand|give|solve|lengthen|space|add|choose|cut|try|make|let)\b", re.IGNORECASE
)

Row = dict[str, Any]
Choice = TypeVar("Choice")


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number between two powers of ten, given by their exponents."""
    return float(10 ** rng.uniform(low, high))


def choose(rng: np.random.Generator, choices: Sequence[Choice], shares: Sequence[float] | None = None) -> Choice:
    """Draw one of the choices in these shares, which are equal if not given."""
    return choices[int(rng.choice(len(choices), p=None if shares is None else np.divide(shares, np.sum(shares))))]


class Trial:
    """A problem from its draw to its judgement.

    case : its words and numbers
    answers : typed errors that answer it, because it has no solution or none that can be found
    residual, broken : the largest value over its limit, and the checks that the answer breaks
    """

    def __init__(self, seed: int, number: int) -> None:
        self.seed, self.number, self.rng = seed, number, np.random.default_rng([seed, number])
        self.case: dict[str, object] = {}
        self.answers: tuple[type[RoughslipError], ...] = ()
        self.residual, self.broken = 0.0, list[str]()

    def check(self, name: str, value: float, limit: float = 0.0) -> None:
        """Check that a value is a number of at most the limit; zero asks for an exact answer."""
        if not value <= limit:
            self.broken.append(f"{name}: {float(value):.3e} for {float(limit):.3e}")
        if limit > 0:
            self.residual = max(self.residual, float(value / limit))


def row_of(stage: str, seed: int, number: int) -> Row:
    """Attempt a problem with every warning an error, and return its row with the CPU seconds that it took."""
    trial, outcome, start = Trial(seed, number), CONVERGED, time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            import_module(f"tests.properties.{stage}").attempt(trial)
        except AssertionError as error:
            trial.broken.append(str(error))
        except Exception as error:  # Any exception but an answer is a failure, which the row names.
            outcome = type(error).__name__
            if not (isinstance(error, trial.answers) and ADVICE.search(str(error))):
                trial.broken.append(str(error) or repr(error))
    if trial.broken and outcome == CONVERGED:
        outcome = FALSE_CLAIM
    named = {"number": number, **trial.case}.items()
    case = " ".join(f"{name}={value:.4g}" if isinstance(value, float) else f"{name}={value}" for name, value in named)
    residual = trial.residual if outcome in (CONVERGED, FALSE_CLAIM) and math.isfinite(trial.residual) else None
    row = {"stage": stage, "case": case, "outcome": outcome, "residual": residual}
    row |= {"why": "; ".join(trial.broken)} if trial.broken else {}
    return row | {"cpu_seconds": time.process_time() - start}


def summary(stage: str, rows: Sequence[Row]) -> dict[str, Any]:
    """Return counts of outcomes and failures, the largest value of an accepted answer over its limit, and CPU time."""
    return {
        "stage": stage,
        "problems": len(rows),
        "outcomes": dict(sorted(Counter(row["outcome"] for row in rows).items())),
        "worst_residual_over_tolerance": max(
            (row["residual"] for row in rows if row["outcome"] == CONVERGED), default=None
        ),
        "failures": sum("why" in row for row in rows),
        "cpu_seconds": round(sum(row["cpu_seconds"] for row in rows), 1),
    }


def main() -> int:
    """Return 1 if a problem failed."""
    parser = argparse.ArgumentParser(description="Solve random problems and judge the answers by independent code.")
    parser.add_argument("campaigns", nargs="*", help=f"of {', '.join(CAMPAIGNS)}; default all")
    parser.add_argument("--seed", default=str(SEED), help=f"a whole number, or `today`; default {SEED}")
    parser.add_argument("--share", type=float, default=1.0, help="of each campaign's problems, at least one")
    parser.add_argument("--only", type=int, nargs="+", metavar="NUMBER", help="only the problems of these numbers")
    parser.add_argument("-j", "--jobs", type=int, default=1, help="processes")
    parser.add_argument("--output", type=Path, help="the JSON file")
    parser.add_argument("--keep", type=Path, help="a JSON file of the summary alone, which git keeps")
    given = parser.parse_args()
    seed = int(f"{datetime.date.today():%Y%m%d}") if given.seed == "today" else int(given.seed)
    numbers = {
        stage: given.only or range(max(1, round(given.share * CAMPAIGNS[stage])))
        for stage in given.campaigns or CAMPAIGNS
    }
    tasks = [(stage, seed, number) for stage in numbers for number in numbers[stage]]
    with ProcessPoolExecutor(given.jobs, get_context("spawn")) as pool:
        rows = list(pool.map(row_of, *zip(*tasks, strict=True), chunksize=5))
    kept = {
        "seeds": dict.fromkeys(numbers, seed),
        "stages": [summary(stage, [row for row in rows if row["stage"] == stage]) for stage in numbers],
    }
    if given.output:
        store.write_json(given.output, {**kept, "rows": rows})
    if given.keep:
        store.write_json(given.keep, kept)
    print(*(json.dumps(of_stage) for of_stage in kept["stages"]), sep="\n")
    wrong = [(task, row) for task, row in zip(tasks, rows, strict=True) if "why" in row]
    for (stage, _, number), row in wrong[:50]:
        print(f"{row['outcome']}: {row['case']}: {row['why']}")
        print(f"    alone: python -m tests.properties.campaign {stage} --seed {seed} --only {number}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
