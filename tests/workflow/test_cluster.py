"""The study on Slurm: the same bits as on this machine, after kills of Snakemake and of a job.

Runs where a Slurm answers and its plug-in (requirements-cluster.lock) is installed, in this Python or in the one that
CLUSTER_PYTHON names.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.workflow.project import digests
from workflow.study import earlier_runs

PYTHON = os.environ.get("CLUSTER_PYTHON", sys.executable)
PROFILE = "profiles/slurm"
PLUGIN = "import snakemake_executor_plugin_slurm"


def missing() -> str:
    """Why this cannot run here, empty where it can."""
    if shutil.which("sinfo") is None:
        return "no Slurm here"
    if subprocess.run(["sinfo", "--noheader"], capture_output=True, timeout=30).returncode:
        return "Slurm does not answer"
    if subprocess.run([PYTHON, "-c", PLUGIN], capture_output=True).returncode:
        return "the plug-in of requirements-cluster.lock is not installed"
    return ""


WHY = missing()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(WHY != "", reason=WHY)]


@dataclass
class LoginNode:
    """Snakemake as it is started on a login node, and what it said."""

    options: dict
    log: Path

    def start(self) -> subprocess.Popen:
        command = [PYTHON, "-m", "snakemake", "tiny", "--profile", PROFILE, "--config", "memory_mb=4000"]
        with self.log.open("w") as said:
            return subprocess.Popen(command, stdout=said, stderr=subprocess.STDOUT, **self.options)

    def latest_job(self, run: subprocess.Popen, made: str) -> str:
        """Of those that run on a node as soon as a result is there."""
        while run.poll() is None:
            if next(self.options["cwd"].glob(made), None) and (
                running := earlier_runs.queued_jobs(self.options["cwd"], "RUNNING")
            ):
                return max(running, key=int)
            time.sleep(0.2)
        raise AssertionError(self.log.read_text()[-5000:])


def test_results_are_those_of_this_machine_whatever_is_killed(finished, tmp_path):
    """Snakemake itself, whose jobs must be out of the queue before the next; then a job, which is submitted again."""
    project = finished.copy(tmp_path / "copy")
    login = LoginNode(project.options, tmp_path / "log")

    run = login.start()
    job = login.latest_job(run, made="results/store/karhunen_loeve")
    run.kill()
    run.wait()
    assert login.start().wait(timeout=300) == 1
    said = login.log.read_text()
    assert f"{project.folder}: jobs of an interrupted run are in the queue" in said
    left = said.rpartition("scancel ")[2].split()
    assert job in left
    subprocess.run(["scancel", *left], check=True)

    run = login.start()
    job = login.latest_job(run, made="results/store/design/*/surface/design.nc")
    subprocess.run(["scancel", "--signal=KILL", "--full", job], check=True)
    assert run.wait(timeout=1500) == 0, login.log.read_text()[-5000:]
    assert "Trying to restart job" in login.log.read_text()
    assert digests(project.path("results/tiny")) == digests(finished.path("results/tiny"))
