"""What git keeps of benchmarks and stress campaigns: what is copied, and that every kept file can be shown."""

import json
from pathlib import Path

import pytest

from roughslip.report.evidence import MEASURED
from roughslip.stages.report import read_evidence
from workflow.evidence import keep as evidence
from workflow.study.scenes import BENCHMARKS, STRESSED

KEPT = Path(__file__).resolve().parents[2] / "results" / "reference" / "evidence"


def part(stage, outcomes, worst):
    return {
        "stage": stage,
        "problems": sum(outcomes.values()),
        "outcomes": outcomes,
        "worst_residual_over_tolerance": worst,
        "failures": 0,
    }


def test_a_stage_is_the_sum_of_its_classes():
    parts = [part("a", {"converged": 3}, 0.5), part("b", {"InputError": 2}, None), part("a", {"converged": 1}, 0.7)]
    found = evidence.stress_by_stage({"summary": [*parts, part("a", {"InputError": 4}, None)]})
    assert found == [part("a", {"converged": 4, "InputError": 4}, 0.7), part("b", {"InputError": 2}, None)]


def test_what_was_made_is_kept_and_what_was_not_stays(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    kept = tmp_path / evidence.KEPT
    for folder in (kept, tmp_path / "results/benchmarks"):
        folder.mkdir(parents=True)
    (kept / "surface.json").write_text("old")
    (kept / "contact.json").write_text("old")
    (tmp_path / "results/benchmarks/surface.json").write_text('{\n "rows": [1, 2]\n}')
    (tmp_path / "results/stress.json").write_text(json.dumps({"seeds": {"a": 1}, "summary": [], "rows": []}))
    evidence.main()
    assert {path.name: path.read_text() for path in kept.iterdir() if path.name != "stress.json"} == {
        "surface.json": '{"rows":[1,2]}\n',
        "contact.json": "old",
    }
    assert json.loads((kept / "stress.json").read_text()) == {"seeds": {"a": 1}, "stages": []}


def test_every_benchmark_has_a_caption():
    assert set(BENCHMARKS) <= set(MEASURED)


@pytest.mark.skipif(not KEPT.is_dir(), reason="no evidence is kept yet")
def test_the_kept_files_can_be_shown(tmp_path):
    """And no campaign failed: every problem ended as it should."""
    names = {path.stem for path in KEPT.glob("*.json")}
    assert names <= {*BENCHMARKS, "stress"}
    for name in names - {"stress"}:
        (tmp_path / f"{name}.png").write_bytes(b"drawn")
    shown = read_evidence(KEPT, tmp_path)
    assert set(shown.pictures) == names - {"stress"}
    assert {row["stage"] for row in shown.stress} <= set(STRESSED)
    assert all(row["failures"] == 0 for row in shown.stress)
