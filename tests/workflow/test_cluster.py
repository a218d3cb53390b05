"""The study on Slurm: the same bits as on this machine, and a job that was killed on its node is submitted again.

Runs where a Slurm answers and its plug-in (requirements-cluster.lock) is installed, in this Python or in the one that
CLUSTER_PYTHON names.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from workflow.faults.scratch import digests

PYTHON = os.environ.get("CLUSTER_PYTHON", sys.executable)
PLUGIN = "import snakemake_executor_plugin_slurm"


def missing() -> str:
    """Why this cannot run here, empty where it can."""
    if shutil.which("sinfo") is None:
        return "no Slurm here; ../shared/tools/slurm-one-node.sh starts one from Debian's packages"
    if subprocess.run(["sinfo", "--noheader"], capture_output=True, timeout=30).returncode:
        return "Slurm does not answer"
    if subprocess.run([PYTHON, "-c", PLUGIN], capture_output=True).returncode:
        return "the plug-in of requirements-cluster.lock is not installed"
    return ""


WHY = missing()
pytestmark = pytest.mark.skipif(WHY != "", reason=WHY)


def jobs() -> list[str]:
    """Numbers of the jobs that run."""
    said = subprocess.run(["squeue", "--noheader", "--states=RUNNING", "--format=%A"], capture_output=True, text=True)
    return said.stdout.split()


def test_results_are_those_of_this_machine_and_a_killed_job_is_submitted_again(finished, tmp_path):
    project = finished.copy(tmp_path / "copy")
    command = [PYTHON, "-m", "snakemake", "tiny", "--profile", "workflow/profiles/slurm", "--config", "memory_mb=4000"]
    log = tmp_path / "log"
    with log.open("w") as said:
        run = subprocess.Popen(command, stdout=said, stderr=subprocess.STDOUT, **project.options)
        killed = ""
        while run.poll() is None:
            if not killed and project.path("results/tiny/surface/design.nc").is_file() and (running := jobs()):
                killed = running[0]
                subprocess.run(["scancel", "--signal=KILL", "--full", killed], check=True)
            time.sleep(0.2)
    assert run.returncode == 0, log.read_text()[-5000:]
    assert killed
    assert "Trying to restart job" in log.read_text()
    assert digests(Path(project.path("results/tiny"))) == digests(Path(finished.path("results/tiny")))
