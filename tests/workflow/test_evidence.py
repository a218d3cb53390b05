"""Benchmarks and stress campaigns as targets: what is planned, what re-runs, and what is said without the peers."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from workflow.keys.evidence_keys import evidence_key
from workflow.study.scenes import BENCHMARKS, STRESSED

ROOT = Path(__file__).resolve().parents[2]
STAGES = tuple(f"{stage}{part}" for stage in BENCHMARKS for part in ("", "_figure"))
PLANS = {
    "benchmark": {"benchmark": 1, **{f"benchmark_{stage}": 1 for stage in STAGES}},
    "stress": {"stress": 1, **{f"stress_{stage}": 1 for stage in STRESSED}},
}

# Edited files by what they belong to, and whether that is measured anew.
MEASURED = {
    ("benchmarks", "contact"): {
        "src/roughslip/friction/statistics.py": False,
        "src/roughslip/contact/dense_solver.py": True,
        "workflow/benchmarks/contact_figure.py": False,
        "workflow/benchmarks/measure.py": True,
        "requirements.lock": True,
    },
    ("benchmarks", "surface"): {
        "src/roughslip/surface/lanczos.py": True,
        "src/roughslip/contact/dense_solver.py": False,
        "workflow/benchmarks/surface_peers.py": True,
        "workflow/benchmarks/surface_figure.py": False,
    },
    ("benchmarks", "friction"): {
        "src/roughslip/friction/recursion.py": True,
        "src/roughslip/friction/statistics.py": False,
        "workflow/benchmarks/friction_figure.py": False,
    },
    ("stress", "contact"): {
        "src/roughslip/friction/statistics.py": False,
        "src/roughslip/contact/dense_solver.py": True,
        "workflow/stress/contact_judge.py": True,
        "workflow/stress/chaos_judge.py": False,
    },
    ("stress", "chaos"): {
        "src/roughslip/contact/dense_solver.py": False,
        "src/roughslip/chaos/local.py": True,
        "workflow/stress/chaos_contact_problem.py": True,
        "workflow/stress/contact_judge.py": False,
    },
    ("stress", "oscillator"): {
        "src/roughslip/oscillator/slip.py": True,
        "src/roughslip/oscillator/cycles.py": False,
        "workflow/stress/oscillator_judge.py": True,
        "workflow/stress/chaos_judge.py": False,
    },
    ("stress", "surface"): {
        "src/roughslip/probability/translation.py": True,
        "src/roughslip/surface/corrected_covariance.py": True,
        "src/roughslip/scan/covariance_fit.py": True,
        "src/roughslip/friction/recursion.py": False,
        "workflow/stress/kernels.py": True,
        "workflow/stress/friction_judge.py": False,
    },
    ("stress", "friction"): {
        "src/roughslip/friction/penetration_law.py": True,
        "src/roughslip/probability/translation.py": True,
        "src/roughslip/surface/corrected_covariance.py": False,
        "workflow/stress/friction_lengths.py": True,
        "workflow/stress/kernels.py": False,
    },
}


@pytest.fixture(scope="module")
def fresh(empty, tmp_path_factory):
    return empty.copy(tmp_path_factory.mktemp("evidence") / "copy")


@pytest.mark.parametrize("target", PLANS)
def test_the_target_plans_the_evidence(fresh, target):
    assert fresh.plan(target) == PLANS[target]


@pytest.mark.parametrize(("kind", "name"), MEASURED)
def test_what_is_measured_is_in_the_key(empty, tmp_path, monkeypatch, kind, name):
    project = empty.copy(tmp_path / "copy")
    monkeypatch.chdir(project.folder)

    def key(**configuration) -> str:
        lock = project.path("requirements.lock")
        return project.path(evidence_key(kind, name, project.folder, lock, **configuration)).read_text()

    first = key(options=[])
    assert key(options=["other"]) != first
    for file, changes in MEASURED[kind, name].items():
        with project.path(file).open("a") as source:
            source.write("\n_edited = 1\n")
        assert (key(options=[]) != first) is changes, file
        first = key(options=[])


@pytest.mark.parametrize(("name", "peer"), [("contact", "tamaas"), ("surface", "gstools")])
def test_without_the_peers_their_benchmark_says_what_to_do(name, peer):
    program = f"import sys; sys.modules[{peer!r}] = None; from workflow.benchmarks.{name} import main; main()"
    command = [sys.executable, "-c", program, "--output", "never.json", "--quick", "--peers"]
    environment = {**os.environ, "PYTHONPATH": f"{ROOT / 'src'}{os.pathsep}{ROOT}"}
    run = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert run.returncode == 2
    assert f"not installed: {peer}" in run.stderr
    assert "make benchmark PEERS=1" in run.stderr
