"""Campaigns: a part of each has no failure, wrong science is caught, and the file holds every row."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from roughslip.chaos.local import fit_local
from roughslip.chaos.strip import fit_strip
from roughslip.contact import influence
from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.friction.marginal import fit_beta
from roughslip.oscillator.motion import trajectory
from roughslip.scan.covariance_fit import fit_covariance
from roughslip.surface.embedding import embed
from roughslip.surface.modes import karhunen_loeve
from workflow.benchmarks.chain import Run
from workflow.stress import accuracy, runner
from workflow.stress.runner import SEED, Problem, Verdict


def row(stage: str, number: int, seed: int = SEED) -> runner.Row:
    return runner.solved((stage, seed, number))


def tilted(*arguments, **options):
    """Modes that are turned by 1e-8."""
    found = karhunen_loeve(*arguments, **options)
    return replace(found, modes=found.modes + 1e-8 * found.modes[::-1])


def praised(*arguments):
    """An expansion that states a thousandth of its error."""
    expansion, quality = fit_strip(*arguments)
    return expansion, quality | {"leave_one_out": quality["leave_one_out"] / 1e3}


def longer(covariance, grid):
    """An embedding of a correlation that is a millionth too long."""
    return embed(replace(covariance, correlation_length_m=covariance.correlation_length_m * (1 + 1e-6)), grid)


def moved(*arguments, **options):
    """A fit whose correlation length is 2 % too long."""
    found = fit_covariance(*arguments, **options)
    length = 1.02 * found.covariance.correlation_length_m
    return replace(found, covariance=replace(found.covariance, correlation_length_m=length))


# Campaign, number of a problem, what is replaced by what.
FAULTS = {
    "Love's coefficients too large by 1e-8": (
        *("contact", 1, "roughslip.contact.influence.love_coefficients"),
        lambda *given: (1 + 1e-8) * LOVE(*given),
    ),
    "tilted modes": ("surface", 0, "workflow.stress.surface.karhunen_loeve", tilted),
    "a longer correlation": ("surface", 1, "workflow.stress.surface.embed", longer),
    "a fit beside the minimum": ("surface", 9, "workflow.stress.surface.fit_covariance", moved),
    "pressures doubled": (
        *("chaos", 2, "workflow.stress.chaos.fit_local"),
        lambda samples, *given: fit_local(replace(samples, pressure=2 * samples.pressure), *given),
    ),
    "an error stated too low": ("chaos", 5, "workflow.stress.chaos.fit_strip", praised),
    "friction too large by 1e-6": (
        *("friction", 0, "workflow.stress.friction.fit_beta"),
        lambda mu, *given: fit_beta((1 + 1e-6) * mu, *given),
    ),
    "more damping": (
        *("oscillator", 0, "workflow.stress.oscillator.trajectory"),
        lambda mass, *given: trajectory(replace(mass, damping_ratio=mass.damping_ratio + 1e-2), *given),
    ),
}
LOVE = influence.love_coefficients


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_wrong_science_is_caught(fault, monkeypatch):
    stage, number, name, wrong = FAULTS[fault]
    assert row(stage, number)["outcome"] == "converged"
    monkeypatch.setattr(name, wrong)
    assert row(stage, number)["outcome"] == "false claim"


def test_numbers_farther_away_than_four_errors_are_rejected():
    """A known number without error: the limit is 4 / 1.96 of the accuracy, in units of the mean at the median."""
    percentiles, asked, nothing = np.array([33.0, 50.0, 85.0]), 0.2, np.zeros((3, 2))
    mean, std = np.array([0.33, 0.3, 0.25]), np.array([0.03, 0.02, 0.01])
    known = np.log([mean, std]).T - np.log(0.3)

    def judged(factor: float, by: np.ndarray, mesh: float = 0.0) -> Verdict:
        found = {"percentile": percentiles, "combined_mean": factor * mean, "combined_std": factor * std * by}
        return accuracy.judge(Run(1.0, 30, 0.1, found, []), asked, known, nothing, np.full((3, 2), mesh))

    assert judged(7.0, np.ones(3)).broken == ()
    limit = 1.001 * np.exp(4.0 / 1.96 * asked * np.array([1.0, 1.0, 0.99]))
    verdict = judged(1.0, limit)
    assert {line.split(":")[0] for line in verdict.broken} == {"std at 33 %", "std at 50 %"}
    assert verdict.residual == pytest.approx(4.0 / 1.96, rel=0.01)
    assert judged(1.0, limit, mesh=0.01).broken == ()


def test_a_table_law_with_a_strong_excitation_from_steady_sliding():
    """Its slip once erred by 7.8 per unit of tau, at a kink of the table; 0.0014 are left."""
    found = row("oscillator", 1830, 20261)
    assert "law=table" in found["case"]
    assert found["outcome"] == "converged"
    assert found["residual"] < 0.01


@pytest.mark.parametrize(
    ("solve", "outcome", "is_failure"),
    [
        (lambda: Verdict(1e-4), "converged", False),
        (lambda: Verdict(np.inf, ("the load: 1 for 0",)), "false claim", True),
        (lambda: (_ for _ in ()).throw(IllPosedError("take more samples")), "IllPosedError", False),
        (lambda: (_ for _ in ()).throw(IllPosedError("it did not work")), "IllPosedError", True),
        (lambda: (_ for _ in ()).throw(ConvergenceError("take more", 1.0, 1)), "ConvergenceError", True),
        (lambda: np.array([1e308]) * 10, "RuntimeWarning", True),
    ],
)
def test_only_a_typed_error_with_advice_answers_a_problem(solve, outcome, is_failure):
    problem = Problem({}, solve, lambda verdict: verdict, runner.unless(False, IllPosedError))
    found = runner.row_of("contact", 1, lambda: problem)
    assert (found["outcome"], "why" in found) == (outcome, is_failure)


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
