"""What git keeps of `make benchmark` and `make stress` can be drawn and shown; no problem of a campaign failed."""

import json
from pathlib import Path

from roughslip.report.page import MEASURED
from roughslip.study.page import read_evidence
from workflow.benchmarks.plot import FIGURES

KEPT = Path(__file__).resolve().parents[2] / "results" / "reference" / "evidence"
ROW = {"case", "method", "error", "seconds"}


def test_the_kept_files_can_be_drawn_and_shown():
    assert set(FIGURES) == set(MEASURED)
    names = {path.stem for path in KEPT.glob("*.svg")}
    assert names == set(FIGURES)
    for name in names:
        rows = json.loads((KEPT / f"{name}.json").read_text())["rows"]
        assert all(row.keys() > ROW for row in rows)
        assert FIGURES[name](rows).axes
    shown = read_evidence(KEPT)
    assert set(shown.pictures) == names
    assert all(row["failures"] == 0 for row in shown.stress)
