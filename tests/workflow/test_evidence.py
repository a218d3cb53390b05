"""Benchmarks: a quick run gives rows, a summary and a figure; what git keeps of benchmarks and campaigns."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from roughslip.report.page import MEASURED
from roughslip.stages.report import read_evidence
from workflow.benchmarks import chaos, contact, contact_peers, oscillator, runner, surface
from workflow.benchmarks.plot import FIGURES
from workflow.evidence import keep
from workflow.evidence.rows import fields
from workflow.study.scenes import BENCHMARKS

KEPT = Path(__file__).resolve().parents[2] / "results" / "reference" / "evidence"
ROW = {"case", "method", "error", "seconds", "work"}


@pytest.mark.slow
def test_a_peer_of_contact_takes_part_and_all_meet_the_tolerance(monkeypatch):
    """Conjugate gradients in numpy find our solution, in more products; the judge is neither's code."""
    sizes = contact.Sizes((16,), (24,), (16,), levels=("50",), quick=True)
    monkeypatch.setattr(contact, "QUICK", sizes)
    monkeypatch.setattr(contact, "PEERS", {"polonsky-keer": contact_peers.PolonskyKeer})
    found = contact.measure(True, True)
    rows = json.loads(json.dumps(found["rows"], allow_nan=False))
    equal = [row for row in rows if "tolerance" in fields(row["case"])]
    assert all(row["error"] <= float(fields(row["case"])["tolerance"]) for row in equal)
    assert len([row for row in equal if row["method"] == "polonsky-keer"]) == 6
    assert found["summary"]["times_faster_than"]["polonsky-keer"]["geometric_mean"].keys() == {"1e-6", "1e-10"}
    assert min(row["error"] for row in rows if row not in equal and row["method"] == "polonsky-keer") < 1e-10
    assert FIGURES["contact"](rows).axes


@pytest.mark.slow
@pytest.mark.parametrize(
    ("benchmark", "worst"), [(surface, 0.3), (chaos, 0.06), (oscillator, 0.1)], ids=["surface", "chaos", "oscillator"]
)
def test_a_quick_run_gives_rows_and_a_figure(benchmark, worst):
    rows = json.loads(json.dumps(benchmark.measure(True, False)["rows"], allow_nan=False))
    assert all(row.keys() > ROW for row in rows)
    assert all(row["error"] < worst for row in rows if not row["method"].startswith("equation"))
    assert FIGURES[benchmark.__name__.rpartition(".")[2]](rows).axes


def test_ratios_of_time():
    """Turn by turn, as the machine is three times as slow in the second; a peer that stopped early does not count."""
    sets = ((1e-10, [1.0, 3.0], [10.0, 30.0]), (1e-6, [1.0], [5.0]), (1e-9, [1.0], [1.0]))
    rows = []
    for n, (error, ours, peer) in enumerate(sets):
        name = f"n={n} tolerance={'1e-6' if n == 1 else '1e-10'}"
        rows += [runner.make_row(name, "roughslip", 1e-11, ours, 1), runner.make_row(name, "peer", error, peer, 1)]
    found = runner.summarise_speed(rows)["peer"]
    assert found["geometric_mean"] == pytest.approx({"1e-10": 10.0, "1e-6": 5.0})
    assert found["worst"] == {"case": "n=1 tolerance=1e-6", "ratio": 5.0}


# What git keeps.


def test_new_results_are_kept_and_others_stay(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    kept = tmp_path / keep.KEPT
    for folder in (kept, tmp_path / "results/benchmarks"):
        folder.mkdir(parents=True)
    (kept / "surface.json").write_text("old")
    (kept / "contact.json").write_text("old")
    (tmp_path / "results/benchmarks/surface.json").write_text('{\n "rows": [1, 2]\n}')
    (tmp_path / "results/stress.json").write_text(json.dumps({"seeds": {"a": 1}, "summary": [], "rows": []}))
    keep.main()
    assert (kept / "surface.json").read_text() == '{"rows":[1,2]}\n'
    assert (kept / "contact.json").read_text() == "old"
    assert json.loads((kept / "stress.json").read_text()) == {"seeds": {"a": 1}, "stages": []}


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
