"""What git keeps of benchmarks and campaigns is written, drawn and shown."""

from __future__ import annotations

import json
from pathlib import Path

from roughslip.report.page import MEASURED
from roughslip.stages.report import read_evidence
from workflow.benchmarks.plot import FIGURES
from workflow.evidence import keep
from workflow.study.scenes import BENCHMARKS

KEPT = Path(__file__).resolve().parents[2] / "results" / "reference" / "evidence"
ROW = {"case", "method", "error", "seconds"}


def test_new_results_are_kept_and_others_stay(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    kept = tmp_path / keep.KEPT
    for folder in (kept, tmp_path / "results/benchmarks"):
        folder.mkdir(parents=True)
    (kept / "surface.json").write_text("old")
    (kept / "contact.json").write_text("old")
    (tmp_path / "results/benchmarks/surface.json").write_text('{\n "rows": [1, 2]\n}')
    (tmp_path / "results/stress.json").write_text(json.dumps({"seeds": {"a": 1}, "summary": [], "rows": []}))
    keep.main(["stress"])
    assert (kept / "surface.json").read_text() == "old"
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
