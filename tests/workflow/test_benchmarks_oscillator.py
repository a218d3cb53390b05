"""The oscillator benchmark: its peers meet the same point, its summary compares at equal error, a small run of it."""

import json
import sys

import pytest

from roughslip.figures.style import save
from workflow.benchmarks import oscillator, oscillator_figure
from workflow.benchmarks.oscillator import LAW, STUDY, at_error, ours, slips, summary, theirs
from workflow.benchmarks.oscillator_peers import SOLVERS, slips_by_diffrax


@pytest.mark.parametrize("which", [0, 1])
def test_all_methods_meet_one_point(which):
    """At 1e-11; scipy passes over the nodes of the path, where its error control leaves some 1e-8."""
    slip = slips(8)[which]
    exact, *_ = ours(slip, "dormand_prince853", 1e-13)
    assert ours(slip, "fehlberg45", 1e-11)[0] == pytest.approx(exact, rel=1e-9)
    assert theirs(slip, "DOP853", 1e-11)[0] == pytest.approx(exact, rel=1e-5 if which else 1e-8)


@pytest.mark.parametrize("solver", SOLVERS)
def test_diffrax_meets_the_same_point(solver):
    """Without scatter, at 1e-9: two solvers that know nothing of each other agree to what they were asked for."""
    pytest.importorskip("diffrax", reason="diffrax is not installed: make benchmark PEERS=1 sets it up")
    slip, _ = slips(8)
    exact, *_ = ours(slip, "dormand_prince853", 1e-13)
    place, evaluations, count = slips_by_diffrax(STUDY, LAW, None, 0.0, slip.start, solver, 3)(1e-9)
    assert place == pytest.approx(exact, rel=1e-7)
    assert count == 3
    assert evaluations > 3 * 100


def test_ratios_are_at_equal_error():
    """Ours at 1e-6 in 1 s and at 1e-9 in 2 s, theirs at 1e-7 in 600 s: 300 times as fast, not 600."""
    named = [
        ("roughslip/fehlberg45", 1e-6, 1.0),
        ("roughslip/dormand_prince853", 1e-9, 2.0),
        ("scipy/RK45", 1e-7, 600.0),
    ]
    rows = [
        {"case": f"motion=deterministic asked={k}", "method": method, "error": error, "seconds": seconds, "work": 1}
        for k, (method, error, seconds) in enumerate(named)
    ]
    assert at_error(rows, "roughslip/fehlberg45", 1e-7) is None
    rows += [
        {"case": "motion=right-hand-side", "method": "roughslip", "error": 0.0, "seconds": 0.01, "work": 1_000_000},
        {"case": "motion=ensemble-of-8-nodes", "method": "roughslip", "error": 9e-3, "seconds": 1.5, "work": 1},
        {"case": "motion=ensemble-of-4-nodes", "method": "roughslip", "error": 2e-2, "seconds": 0.8, "work": 1},
    ]
    found = summary(rows, oscillator.Campaign(runs=100))
    assert found["times_as_fast"] == {"scipy/RK45": {"motion=deterministic asked=2": 300.0}}
    assert found["nanoseconds_of_an_evaluation"] == pytest.approx(10.0)
    assert found["ensemble_seconds"] == pytest.approx(30.0)  # with 4 nodes the counts err by more than 1 %
    assert found["met"] is False


def test_a_small_run_measures_and_draws(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["oscillator", "--quick", "--output", str(tmp_path / "oscillator.json")])
    oscillator.main()
    rows = json.loads((tmp_path / "oscillator.json").read_text())["rows"]
    methods = {row["method"] for row in rows if "asked" in row["case"]}
    assert methods == {name for name in oscillator_figure.LOOKS if not name.startswith("diffrax")}
    assert len(rows) == 2 * 2 * (2 * 2 + 2) + 1 + 2 + 2
    steady = [row for row in rows if row["case"] == "motion=long-run"]
    assert all(row["work"] == 2000 for row in steady)
    assert all(row["error"] < 1e-6 for row in steady)  # two cycles a block
    assert all(row["error"] < 0.1 for row in rows if "ensemble" not in row["case"])  # of four runs nothing is told
    save(oscillator_figure.figure(rows), tmp_path / "oscillator.png")
    assert (tmp_path / "oscillator.png").stat().st_size > 10_000
