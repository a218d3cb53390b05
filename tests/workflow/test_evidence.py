"""What git keeps of `make benchmark` and `make stress` can be drawn and shown; no problem of a campaign failed."""

import json
from pathlib import Path

from roughslip.report.page import MEASURED
from roughslip.stages.report import read_evidence
from workflow.benchmarks.plot import FIGURES
from workflow.study.scenes import BENCHMARKS

KEPT = Path(__file__).resolve().parents[2] / "results" / "reference" / "evidence"
ROW = {"case", "method", "error", "seconds"}


def test_the_kept_files_can_be_drawn_and_shown(tmp_path):
    assert set(BENCHMARKS) == set(FIGURES) <= set(MEASURED)
    names = {path.stem for path in KEPT.glob("*.json")} - {"stress"}
    assert names == set(BENCHMARKS)
    for name in names:
        rows = json.loads((KEPT / f"{name}.json").read_text())["rows"]
        assert all(row.keys() > ROW for row in rows)
        assert FIGURES[name](rows).axes
        (tmp_path / f"{name}.svg").write_text(f"<svg>{name}</svg>")
    shown = read_evidence(KEPT, tmp_path)
    assert set(shown.pictures) == names
    assert all(row["failures"] == 0 for row in shown.stress)
