"""What git keeps of benchmarks and campaigns can be drawn and shown.

Campaigns: a part of each has no failure, and wrong science is caught with the command that shows it alone.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from roughslip.chaos.local import fit_local
from roughslip.chaos.strip import fit_strip
from roughslip.contact import influence
from roughslip.friction.marginal import fit_beta
from roughslip.oscillator.motion import trajectory
from roughslip.report.page import MEASURED
from roughslip.scan.covariance_fit import fit_covariance
from roughslip.stages.report import read_evidence
from roughslip.surface.embedding import embed
from roughslip.surface.modes import karhunen_loeve
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


def longer(covariance, factor):
    return replace(covariance, correlation_length_m=factor * covariance.correlation_length_m)


def tilted(found):
    return replace(found, modes=found.modes + 1e-8 * found.modes[::-1])


def praised(found):
    return found[0], found[1] | {"leave_one_out": found[1]["leave_one_out"] / 1e3}


LOVE = influence.love_coefficients
# What is wrong: campaign, number of a problem, what is replaced, by what.
FAULTS = {
    "Love's coefficients too large by 1e-8": (
        *("contact", 1, "roughslip.contact.influence.love_coefficients"),
        lambda *given: (1 + 1e-8) * LOVE(*given),
    ),
    "tilted modes": (
        *("surface", 0, "workflow.stress.surface.karhunen_loeve"),
        lambda *given, **options: tilted(karhunen_loeve(*given, **options)),
    ),
    "a correlation a millionth too long": (
        *("surface", 1, "workflow.stress.surface.embed"),
        lambda covariance, grid: embed(longer(covariance, 1 + 1e-6), grid),
    ),
    "a fit beside the minimum": (
        *("surface", 9, "workflow.stress.surface.fit_covariance"),
        lambda *given, **options: (lambda found: replace(found, covariance=longer(found.covariance, 1.02)))(
            fit_covariance(*given, **options)
        ),
    ),
    "pressures doubled": (
        *("chaos", 2, "workflow.stress.chaos.fit_local"),
        lambda samples, *given: fit_local(replace(samples, pressure=2 * samples.pressure), *given),
    ),
    "an error stated too low": (
        *("chaos", 5, "workflow.stress.chaos.fit_strip"),
        lambda *given: praised(fit_strip(*given)),
    ),
    "friction too large by 1e-6": (
        *("friction", 0, "workflow.stress.friction.fit_beta"),
        lambda mu, *given: fit_beta((1 + 1e-6) * mu, *given),
    ),
    "more damping": (
        *("oscillator", 0, "workflow.stress.oscillator.trajectory"),
        lambda mass, *given: trajectory(replace(mass, damping_ratio=mass.damping_ratio + 1e-2), *given),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_wrong_science_is_caught(fault, monkeypatch):
    stage, number, name, wrong = FAULTS[fault]
    assert row_of(stage, SEED, number)["outcome"] == "converged"
    monkeypatch.setattr(name, wrong)
    found = row_of(stage, SEED, number)
    assert (found["outcome"], "why" in found) == ("false claim", True)


def test_a_table_law_with_a_strong_excitation_from_steady_sliding():
    """Its slip once erred by 7.8 per unit of tau, at a kink of the table, thousands of times the limit."""
    found = row_of("oscillator", 20261, 1830)
    assert "law=table" in found["case"]
    assert found["outcome"] == "converged"
    assert found["residual"] < 1


@pytest.mark.slow
def test_a_share_of_all_campaigns_has_no_failure_and_the_same_rows_in_other_processes(tmp_path, monkeypatch, capsys):
    """Both runs are in new processes: a process that compiled functions in another order may differ in last bits."""

    def run(*arguments: str) -> dict:
        file = tmp_path / "stress.json"
        monkeypatch.setattr("sys.argv", ["runner", *arguments, "--share", "0.01", "--output", f"{file}"])
        assert runner.main() == 0, capsys.readouterr().out
        return json.loads(file.read_text())

    found, again = run("-j", "2"), run("surface", "friction")
    assert [row for row in found["rows"] if row["stage"] in again["seeds"]] == again["rows"]
    assert len(found["rows"]) == found["problems"] == sum(stage["problems"] for stage in found["summary"]) == 181
    assert found["seeds"] == dict.fromkeys(runner.CAMPAIGNS, SEED)
    assert all(row.keys() == {"stage", "case", "outcome", "residual"} for row in found["rows"])
    worst = [stage["worst_residual_over_tolerance"] for stage in found["summary"]]  # None where all were refused
    assert max(value for value in worst if value is not None) <= 1
