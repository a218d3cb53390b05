"""Stress campaigns: outcomes, rows and files, refused input, and a small campaign of every subject."""

from __future__ import annotations

import json
import math
import warnings

import numpy as np
import pytest

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from workflow.evidence.rows import fields
from workflow.stress import chaos, contact, friction, oscillator, refusals, runner, surface
from workflow.stress.runner import SEED, Verdict

CAMPAIGNS = {campaign.STAGE: campaign for campaign in (surface, contact, chaos, friction, oscillator)}


def failing(error: Exception):
    def judged() -> Verdict:
        raise error

    return judged


def outcome_of(row: runner.Row) -> tuple[str, float | None, bool]:
    return row["outcome"], row["residual"], "why" in row


@pytest.mark.parametrize(
    ("judged", "tolerance", "expected"),
    [
        (lambda: Verdict(1e-11), "1e-10", ("converged", 1e-11, False)),
        (lambda: Verdict(math.inf, ("the load: 1 for 0",)), "1e-10", ("false claim", None, True)),
        (failing(ConvergenceError("no", 1e-9, 7)), "1e-10", ("ConvergenceError", 1e-9, True)),
        (failing(ConvergenceError("no", 1e-11, 7)), "1e-12", ("ConvergenceError", 1e-11, False)),
        (failing(ConvergenceError("no", 1e-9, 7)), "1e-12", ("ConvergenceError", 1e-9, True)),
        (failing(ParameterError("no")), "1e-10", ("ParameterError", None, True)),
        (failing(ZeroDivisionError()), "1e-10", ("ZeroDivisionError", None, True)),
        (lambda: np.array([1e308]) * 10, "1e-10", ("RuntimeWarning", None, True)),
        (lambda: warnings.warn("slow", UserWarning, stacklevel=1), "1e-10", ("UserWarning", None, True)),
    ],
)
def test_outcome_of_a_problem(judged, tolerance, expected):
    assert outcome_of(runner.problem_row("contact", f"number=1 tolerance={tolerance}", judged)) == expected


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        (failing(ParameterError("no")), ("ParameterError", None, False)),
        (failing(ConvergenceError("no", 1.0, 1)), ("ConvergenceError", None, True)),
        (failing(ValueError("no")), ("ValueError", None, True)),
        (lambda: None, ("accepted", None, True)),
    ],
)
def test_outcome_of_bad_input(call, expected):
    assert outcome_of(runner.refusal_row("contact", "input=bad", call)) == expected


def test_a_verdict_names_the_broken_conditions():
    found = runner.verdict_of({"small": (1.0, 2.0), "exact": (0.0, 0.0), "large": (3.0, 2.0), "nan": (math.nan, 1.0)})
    assert [line.split(":")[0] for line in found.broken] == ["large", "nan"]
    assert runner.verdict_of({"small": (1.0, 2.0), "exact": (0.0, 0.0)}) == Verdict(0.5)


@pytest.mark.parametrize("subject", refusals.REFUSALS)
def test_bad_input_is_refused(subject):
    calls = refusals.REFUSALS[subject]
    assert len(calls) >= 80
    rows = [runner.refusal_row(subject, name, call) for name, call in calls.items()]
    assert runner.failures(rows) == []


@pytest.mark.parametrize("stage", CAMPAIGNS)
def test_a_small_campaign_has_no_failure_and_can_be_repeated(stage):
    row_of = CAMPAIGNS[stage].row_of
    rows = runner.run_problems(row_of, SEED, range(4))
    assert runner.failures(rows) == []
    assert [fields(row["case"])["number"] for row in rows] == [f"{number}" for number in range(4)]
    assert row_of(SEED, 2) == rows[2] != row_of(SEED + 1, 2)


@pytest.mark.slow
@pytest.mark.parametrize("stage", CAMPAIGNS)
def test_a_campaign_on_two_processes_has_no_failure_and_the_same_rows(stage):
    """Both runs are in new processes: a process that compiled functions in another order may differ in last bits."""
    rows = runner.run_problems(CAMPAIGNS[stage].row_of, SEED, range(100), jobs=2)
    assert runner.failures(rows) == []
    assert runner.run_problems(CAMPAIGNS[stage].row_of, SEED, range(10), jobs=3) == rows[:10]


@pytest.mark.parametrize(
    ("error", "well_posed", "answers"),
    [
        (IllPosedError("too few: take more samples"), False, True),
        (IllPosedError("too few: take more samples"), True, False),
        (IllPosedError("it did not work"), False, False),
        (ParameterError("take another"), False, False),
    ],
)
def test_an_error_answers_a_problem_that_is_not_well_posed_with_advice(error, well_posed, answers):
    assert chaos.is_answer(error, well_posed) is answers


def test_the_file_and_its_summary_hold_all_rows(tmp_path, monkeypatch):
    cases = [f"number={number} tolerance=1e-3" for number in range(5)]
    rows = [runner.problem_row("contact", case, lambda: Verdict(5e-4)) for case in cases]
    rows.append(runner.problem_row("contact", cases[0], failing(OverflowError("too far"))))
    path = tmp_path / "stress" / "contact.json"
    runner.write_campaign(path, rows, {"contact": 1})
    monkeypatch.setattr("sys.argv", ["runner", "--campaigns", f"{path}", "--output", f"{tmp_path / 'stress.json'}"])
    runner.main()
    for file in (path, tmp_path / "stress.json"):
        content = json.loads(file.read_text())
        assert content["rows"] == rows
        assert (content["problems"], content["failures"], content["seeds"]) == (6, 1, {"contact": 1})
        (stage,) = content["summary"]
        assert (stage["stage"], stage["problems"], stage["failures"]) == ("contact", 6, 1)
        assert stage["outcomes"] == {"OverflowError": 1, "converged": 5}
        assert stage["worst_residual_over_tolerance"] == pytest.approx(0.5)


def test_a_failure_is_listed_and_ends_the_command_with_one(capsys, monkeypatch):
    def broken(seed: int, number: int) -> runner.Row:
        verdict = Verdict(1.0, ("p >= 0: 1 for 0",) if number == 4 else ())
        return runner.problem_row("contact", f"number={number} tolerance=1e-3", lambda: verdict)

    monkeypatch.setattr("sys.argv", ["stress", "--problems", "6"])
    assert runner.command("", "contact", broken, 10) == 1
    assert "false claim: number=4 tolerance=1e-3: p >= 0: 1 for 0" in capsys.readouterr().err
    monkeypatch.setattr("sys.argv", ["stress", "--only", "3", "5"])
    assert runner.command("", "contact", broken, 10) == 0
