"""What git keeps beside results: Monte Carlo references, benchmarks and campaigns.

References: standard errors by plain sums, the kept files, and what makes them again. Benchmarks can be drawn and shown.
Campaigns: a part of each has no failure, and a judge sees wrong science.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from roughslip import store
from roughslip.contact import influence
from roughslip.report.page import MEASURED
from roughslip.scene.loader import load
from roughslip.stages.report import read_evidence
from workflow.benchmarks.plot import FIGURES
from workflow.monte_carlo import friction, pressure
from workflow.monte_carlo.references import KINDS, reference_file
from workflow.stress import runner
from workflow.stress.runner import SEED, row_of
from workflow.study.scenes import BENCHMARKS

ROOT = Path(__file__).resolve().parents[2]

# The first 300 surfaces of the kept reference of `paper`: contacts, mean pressures [Pa].
CONTACTS = [116, 185, 251]
MEANS = [8.089286e6, 1.568353e7, 2.378430e7]
# The first strip of the friction reference of `resolved`, summed over its windows: area [m2], force [N].
AREAS = [3.22272859e-08, 2.18427477e-07, 4.80771648e-07]
FORCES = [24.8589997, 179.103733, 444.411693]


def scene(name):
    return load(name, ROOT / "config/scenes")


# The numbers, from samples.


def gathered(values):
    return pressure.gather({}, [{"pressure": values, "percentile": np.array([20.0, 50.0])}])


def test_errors_are_binomial_for_independent_nodes_and_those_of_a_node_for_equal_ones():
    values = np.maximum(np.random.default_rng(3).standard_normal((20_000, 4)), 0.0)
    kept = gathered(np.stack([values, np.repeat(values[:, :1], 4, axis=1)], axis=1))
    errors = kept["contact_probability_standard_error"].values
    np.testing.assert_allclose(errors, [math.sqrt(0.25 / 80_000), math.sqrt(0.25 / 20_000)], rtol=0.02)
    assert kept["cumulative"].values[:, -1] == pytest.approx(1.0)


# The kept files.


@pytest.fixture(params=sorted(pressure.SAMPLES))
def kept(request):
    return store.read(ROOT / reference_file(request.param, "pressure"))


def test_the_kept_distribution_gives_the_kept_numbers(kept):
    """E p = int (1 - F) dp."""
    assert list(kept["percentile"]) == list(pressure.PERCENTILES)
    assert int(kept["nodes"]) == 4
    for row in range(3):
        level, share, contact = kept["level"][row], kept["cumulative"][row], kept["contact_probability"][row]
        assert level[0] == 0
        assert np.all(np.diff(level) > 0)
        assert np.all(np.diff(share) >= 0)
        assert np.diff(share).max() < 0.003 * contact  # a step of the table
        assert share[-1] == 1
        assert contact == 1 - share[0]
        mean = float(np.sum(np.diff(level) * (1 - 0.5 * (share[1:] + share[:-1]))))
        assert mean == pytest.approx(kept["mean_pressure"][row], rel=1e-3)
    assert np.all(np.diff(kept["contact_probability"]) > 0)  # deeper, more contact
    assert np.all(np.diff(kept["mean_pressure"]) > 0)


def test_the_kept_errors_lie_between_independent_and_equal_nodes(kept):
    """Var = F (1 - F) / n (1 + 3 rho) / 4 with a correlation rho of the four nodes, here between -0.08 and 1.

    The correlation is negative where heights are independent, because a node in contact presses its neighbours down.
    The references judge Kolmogorov distances down to 0.01.
    """
    surfaces = int(kept["surfaces"])
    for row in range(3):
        share = kept["cumulative"][row, :-40]  # fewer than some hundred pressures above the last levels
        binomial = np.sqrt(share * (1 - share) / surfaces)
        ratio = kept["cumulative_standard_error"][row, :-40] / binomial
        assert 0.5 * math.sqrt(1 - 3 * 0.08) < ratio.min()
        assert ratio.max() < 1
    assert np.array_equal(kept["contact_probability_standard_error"], kept["cumulative_standard_error"][:, 0])
    assert kept["cumulative_standard_error"].max() < 0.0015


def test_kept_references_are_of_the_present_scenes():
    """Friction falls with penetration, and so does its scatter."""
    for kind, module in KINDS.items():
        for name, (most, _) in module.SAMPLES.items():
            found = store.read(ROOT / reference_file(name, kind))
            assert json.loads(found.attributes["configuration"]) == module.slice_of(scene(name))
            if kind == "pressure":
                assert int(found["surfaces"]) <= most
                continue
            assert 1000 <= int(found["strips"]) <= most
            assert np.all(np.diff(found["mean"]) < 0)
            assert np.all(np.diff(found["std"]) < 0)
            assert np.all(
                found["mean_standard_error"] < 5e-3 * found["mean"]
            )  # Student's interval of a run has as much
            assert np.all(found["missing_share"][2:] == 0)  # from percentile 20 on every window has a contact


# Their solves.


def solved(first, last):
    return pressure.solve(scene("paper"), first, last)


def test_the_present_solver_gives_the_pressures_of_the_reference():
    """To the tolerance of a solve, 1e-6 of the heights, and the rounding of the numbers above. Batches are parts."""
    found, gap = (solved(0, 300)[name].values for name in ("pressure", "gap"))
    assert np.count_nonzero(found, axis=(0, 2)).tolist() == CONTACTS
    np.testing.assert_allclose(found.mean(axis=(0, 2), dtype=np.float64), MEANS, rtol=1e-5)
    assert np.all((found == 0) | (np.abs(gap) < 1e-6 * 5e-8))
    assert found.dtype == np.float32
    assert np.array_equal(solved(6, 12)["pressure"].values, found[6:12])


# The friction of windows, solved directly.


def test_windows_of_independent_strips_have_the_errors_of_their_means():
    """Strips of one window each: the standard error of the mean is that of independent draws, known to about 4 %."""
    area = np.random.default_rng(5).uniform(1.0, 2.0, (300, 2, 1))
    configuration = {
        "strip": {"window_m": 1.0, "width_m": 1.0, "penetration_percentiles": [20, 50]},
        "friction": {"least_contact_fraction": 1e-3},
    }
    kept = friction.gather(configuration, [{"area": area, "force": np.full_like(area, 0.5)}])
    np.testing.assert_allclose(kept["mean"].values, 2 * area.mean(axis=(0, 2)), rtol=1e-12)
    np.testing.assert_allclose(kept["std"].values, 2 * area.std(axis=(0, 2)), rtol=1e-12)
    error = 2 * area.std(axis=(0, 2)) / math.sqrt(300)
    np.testing.assert_allclose(kept["mean_standard_error"].values, error, rtol=0.15)
    assert int(kept["strips"].values) == 300


@pytest.mark.slow
def test_the_present_solver_gives_the_windows_of_the_reference():
    """Sums over the windows of the first strip, at the first, the middle and the last penetration, to the tolerance."""
    found = friction.solve(scene("resolved"), 0, 1)
    area, force = found["area"].values, found["force"].values
    np.testing.assert_allclose(area[0, [0, 5, 10]].sum(axis=1), AREAS, rtol=1e-6)
    np.testing.assert_allclose(force[0, [0, 5, 10]].sum(axis=1), FORCES, rtol=1e-5)


KEPT = ROOT / "results" / "reference" / "evidence"
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
