"""What git keeps of benchmarks and campaigns can be drawn and shown.

Campaigns: a part of each has no failure, and a judge sees wrong science.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from roughslip.contact import influence
from roughslip.report.page import MEASURED
from roughslip.stages.report import read_evidence
from workflow.benchmarks.plot import FIGURES
from workflow.stress import runner
from workflow.stress.runner import SEED, row_of
from workflow.study.scenes import BENCHMARKS

KEPT = Path(__file__).resolve().parents[2] / "results" / "reference" / "evidence"
ROW = {"case", "method", "error", "seconds"}


def test_the_kept_files_can_be_drawn_and_shown(tmp_path):
    """No stress problem failed."""
    assert set(BENCHMARKS) == set(FIGURES) <= set(MEASURED)
    names = {path.stem for path in KEPT.glob("*.json")}
    assert names <= {*BENCHMARKS, "stress"}
    for name in names - {"stress"}:
        rows = json.loads((KEPT / f"{name}.json").read_text())["rows"]
        assert all(row.keys() > ROW for row in rows)
        assert FIGURES[name](rows).axes
        (tmp_path / f"{name}.svg").write_text(f"<svg>{name}</svg>")
    shown = read_evidence(KEPT, tmp_path)
    assert set(shown.pictures) == names - {"stress"}
    assert all(row["failures"] == 0 for row in shown.stress)


@pytest.mark.parametrize("wrong", [0.0, 1e-8])
def test_wrong_science_is_a_false_claim(wrong, monkeypatch):
    """Love's coefficients too large by 1e-8."""
    love = influence.love_coefficients
    monkeypatch.setattr(influence, "love_coefficients", lambda *given: (1 + wrong) * love(*given))
    row = row_of("contact", SEED, 1)
    assert (row["outcome"], "why" in row) == (("false claim", True) if wrong else ("converged", False))


def test_a_table_law_with_a_strong_excitation_from_steady_sliding():
    """Its slip once erred by 7.8 per unit of tau, at a kink of the table, thousands of times the limit."""
    row = row_of("oscillator", 20261, 1830)
    assert "law=table" in row["case"]
    assert row["outcome"] == "converged"
    assert row["residual"] < 1


@pytest.mark.slow
def test_a_share_of_all_campaigns_has_no_failure_and_the_same_rows_in_other_processes(tmp_path, monkeypatch, capsys):
    """Both runs are in new processes: a process that compiled functions in another order may differ in last bits."""

    def run(*arguments: str) -> dict:
        file = tmp_path / "stress.json"
        monkeypatch.setattr("sys.argv", ["runner", *arguments, "--share", "0.01", "--output", f"{file}"])
        assert runner.main() == 0, capsys.readouterr().out
        return json.loads(file.read_text())

    both, again = run("-j", "2"), run("surface", "friction")
    seconds = [row.pop("cpu_seconds") for row in (*both["rows"], *again["rows"])]
    assert min(seconds) > 0
    assert [row for row in both["rows"] if row["stage"] in again["seeds"]] == again["rows"]
    assert len(both["rows"]) == sum(stage["problems"] for stage in both["stages"]) == 181
    assert both["seeds"] == dict.fromkeys(runner.CAMPAIGNS, SEED)
    assert all(row.keys() == {"stage", "case", "outcome", "residual"} for row in both["rows"])
    worst = [stage["worst_residual_over_tolerance"] for stage in both["stages"]]  # None where all were refused
    assert max(value for value in worst if value is not None) <= 1
