"""Benchmarks and stress campaigns: their plans, what measures them again, missing peers, and what git keeps of them."""

from __future__ import annotations

import json
import os
import re
import sys
from pathlib import Path

import pytest

from roughslip.report.page import MEASURED
from roughslip.stages.report import read_evidence
from workflow.benchmarks.plot import FIGURES
from workflow.benchmarks.runner import run_command
from workflow.evidence import keep
from workflow.keys.evidence_keys import evidence_key, measured_scenes
from workflow.study.scenes import BENCHMARKS, STRESSED

ROOT = Path(__file__).resolve().parents[2]
KEPT = ROOT / "results" / "reference" / "evidence"
STAGES = tuple(f"{stage}{part}" for stage in BENCHMARKS for part in ("", "_figure"))
PLANS = {
    "benchmark": {"benchmark": 1, **{f"benchmark_{stage}": 1 for stage in STAGES}},
    "stress": {"stress": 1, **{f"stress_{stage}": 1 for stage in STRESSED}},
}

# Files that are edited, and whether the key changes. Modules imported as `from package import module` count too.
EDITED = {
    ("benchmarks", "contact"): {
        "src/roughslip/friction/statistics.py": False,
        "src/roughslip/contact/dense_solver.py": True,
        "workflow/benchmarks/plot.py": False,
        "workflow/benchmarks/runner.py": True,
        "workflow/benchmarks/contact_peers.py": True,
        "requirements.lock": True,
    },
    ("stress", "contact"): {
        "src/roughslip/friction/statistics.py": False,
        "src/roughslip/contact/dense_solver.py": True,
        "workflow/stress/runner.py": True,
        "workflow/stress/friction.py": False,
    },
}


def plan(project, *arguments: str) -> dict[str, int]:
    """Number of jobs of each rule that a dry run announces."""
    table = project.make("-n", *arguments).partition("Job stats:\n")[2].partition("\n\n")[0]
    return {name: int(count) for name, count in re.findall(r"^(\w+) +(\d+)$", table, re.M) if name != "total"}


@pytest.mark.slow
@pytest.mark.parametrize("target", PLANS)
def test_the_target_plans_the_evidence(empty, target):
    assert plan(empty, target) == PLANS[target]


@pytest.mark.slow
def test_references_are_made_where_they_are_missing_and_never_again(empty, tmp_path):
    project = empty.copy(tmp_path / "copy")
    project.path("config/config.yaml").write_text("scenes: [paper]\n")
    assert plan(project, "reference", "--config", "reference_surfaces=300000")["pressure_solves"] == 2
    project.path("results/reference/paper").mkdir(parents=True)
    kept = project.path("results/reference/paper/pressure.nc")
    kept.write_bytes(b"kept")
    os.utime(kept, (1e9, 1e9))  # older than its key, as in a fresh copy of the repository
    assert not {"pressure_solves", "pressure_reference"} & set(plan(project, "reference"))
    assert set(plan(project, "benchmark_chaos")) == {"benchmark_chaos"}


@pytest.mark.parametrize(("kind", "name"), EDITED)
def test_what_is_measured_is_in_the_key(empty, tmp_path, monkeypatch, kind, name):
    project = empty.copy(tmp_path / "copy")
    monkeypatch.chdir(project.folder)

    def key(**configuration) -> str:
        lock = project.path("requirements.lock")
        return project.path(evidence_key(kind, name, project.folder, lock, **configuration)).read_text()

    first = key(options=[])
    assert key(options=["other"]) != first
    for file, changes in EDITED[kind, name].items():
        with project.path(file).open("a") as source:
            source.write("\n_edited = 1\n")
        assert (key(options=[]) != first) is changes, file
        first = key(options=[])


def test_scenes_with_a_reference_and_their_kept_files_are_in_the_key(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scenes = {"paper": {"seed": 1}, "mine": {"seed": 1}}
    assert measured_scenes("contact", scenes) == {}
    missing = measured_scenes("chaos", scenes)
    assert missing == {"scenes": {"paper": {"scene": {"seed": 1}, "reference": "missing"}}}
    (tmp_path / "results/reference/paper").mkdir(parents=True)
    (tmp_path / "results/reference/paper/pressure.nc").write_bytes(b"new")
    assert measured_scenes("chaos", scenes)["scenes"]["paper"]["reference"] != "missing"


def test_without_the_peers_a_benchmark_says_what_to_do(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["contact", "--output", "never.json", "--peers"])
    with pytest.raises(SystemExit, match="2"):
        run_command(None, lambda quick, peers: {}, (), ("no_such_solver",))
    message = capsys.readouterr().err
    assert "not installed: no_such_solver" in message
    assert "make benchmark PEERS=1" in message


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
    assert {path.name: path.read_text() for path in kept.iterdir() if path.name != "stress.json"} == {
        "surface.json": '{"rows":[1,2]}\n',
        "contact.json": "old",
    }
    assert json.loads((kept / "stress.json").read_text()) == {"seeds": {"a": 1}, "stages": []}


def test_the_kept_files_can_be_drawn_and_shown(tmp_path):
    """No stress problem failed."""
    assert set(BENCHMARKS) == set(FIGURES)
    assert set(BENCHMARKS) <= set(MEASURED)
    names = {path.stem for path in KEPT.glob("*.json")}
    assert names <= {*BENCHMARKS, "stress"}
    for name in names - {"stress"}:
        rows = json.loads((KEPT / f"{name}.json").read_text())["rows"]
        assert all({"case", "method", "error", "seconds", "work"} < row.keys() for row in rows)
        assert FIGURES[name](rows).axes
        (tmp_path / f"{name}.svg").write_text(f"<svg>{name}</svg>")
    shown = read_evidence(KEPT, tmp_path)
    assert set(shown.pictures) == names - {"stress"}
    assert {row["stage"] for row in shown.stress} <= set(STRESSED)
    assert all(row["failures"] == 0 for row in shown.stress)
