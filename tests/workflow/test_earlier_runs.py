"""What a start finds of earlier runs: stale locks, another run at work, jobs in the queue of Slurm.

The study on Slurm: the same bits as on this machine, after kills of Snakemake and of a job.

Runs where a Slurm answers and its plug-in (requirements-cluster.lock) is installed, in this Python or in the one that
CLUSTER_PYTHON names.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from roughslip.errors import InputError
from tests.workflow.project import digests
from workflow.study import earlier_runs

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Snakemake's folder with the lock of some run; what this process holds is released at the end."""
    held: list = []
    monkeypatch.setattr(earlier_runs, "_held", held)
    (tmp_path / ".snakemake" / "locks").mkdir(parents=True)
    (tmp_path / ".snakemake" / "locks" / "0.input.lock").write_text("results/a.nc\n")
    yield tmp_path / ".snakemake"
    for file in held:
        file.close()


@pytest.fixture
def other(state: Path):
    """Another process that holds the folder until it is killed."""
    imports = "from pathlib import Path; from workflow.study.earlier_runs import hold"
    code = f"{imports}; print(hold(Path({str(state)!r})))"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    command = [sys.executable, "-c", f"{code}\nimport sys; sys.stdout.flush(); sys.stdin.read()"]
    process = subprocess.Popen(command, cwd=ROOT, env={"PYTHONPATH": f"{ROOT / 'src'}:{ROOT}"}, **pipes)
    assert "is_alone=True" in process.stdout.readline()
    yield process
    process.kill()
    process.communicate()


def test_a_stale_lock_is_cleared(state):
    assert earlier_runs.hold(state) == (True, [f"{state / 'locks'}: stale lock of an interrupted run; removed"])
    assert list((state / "locks").iterdir()) == []
    (state.parent / "file").write_text("in the way")
    with pytest.raises(InputError, match=r"file: cannot be written to"):
        earlier_runs.hold(state.parent / "file")


def test_the_lock_of_a_run_lasts_until_its_process_ends(state, other):
    """However many others start meanwhile."""
    (state / "locks" / "0.input.lock").write_text("results/a.nc\n")
    for _ in range(2):
        line = f"{state.parent}: another run is at work in this folder; wait for its end, or stop it"
        assert earlier_runs.hold(state) == (False, [line])
    (state / "locks" / "0.input.lock").unlink()
    assert "another Snakemake reads this folder" in earlier_runs.hold(state).lines[0]
    (state / "locks" / "0.input.lock").write_text("results/a.nc\n")
    other.kill()
    other.wait()
    while earlier_runs._held:
        earlier_runs._held.pop().close()
    assert earlier_runs.hold(state).is_alone
    assert list((state / "locks").iterdir()) == []


def squeue(folder: Path, script: str) -> str:
    """A folder for PATH with a `squeue` that runs this script."""
    folder.mkdir()
    (folder / "squeue").write_text(f"#!/bin/sh\n{script}\n")
    (folder / "squeue").chmod(0o755)
    return str(folder)


@pytest.mark.parametrize(
    ("lines", "queued"),
    [
        (["12|rule_surface_wildcards_tiny|{here}", "13|rule_costs|{here}"], "12 13"),
        (["12|rule_surface|{here}/..", "13|rule_costs|{here}/../a | b", "14|(null)|{here}"], "13"),
        (["14|(null)|{here}", "15|rule_costs|/elsewhere", "slurm_load_jobs error: nothing"], ""),
    ],
)
def test_queued_jobs_of_an_earlier_run_are_refused(lines, queued, tmp_path, monkeypatch):
    """Not a job that Snakemake itself runs in, nor jobs of another folder."""
    here = tmp_path / "a | b"
    (here / ".snakemake").mkdir(parents=True)
    answer = "\n".join(lines).format(here=here)
    monkeypatch.setenv("PATH", squeue(tmp_path / "bin", f"/bin/cat <<'END'\n{answer}\nEND"))
    if queued:
        with pytest.raises(
            InputError, match=re.escape(f"{here}: jobs of an interrupted run") + f".*: scancel {queued}$"
        ):
            earlier_runs.refuse_queued_jobs(here / ".snakemake")
    else:
        earlier_runs.refuse_queued_jobs(here / ".snakemake")


def test_without_an_answer_of_slurm_no_jobs_are_known(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert earlier_runs.queued_jobs(tmp_path) == []
    monkeypatch.setenv("PATH", squeue(tmp_path / "fails", f"echo '12|rule_costs|{tmp_path}' >&2; exit 1"))
    assert earlier_runs.queued_jobs(tmp_path) == []
    monkeypatch.setattr(earlier_runs, "_SECONDS", 0.2)
    monkeypatch.setenv("PATH", squeue(tmp_path / "hangs", "exec /bin/sleep 5"))
    assert earlier_runs.queued_jobs(tmp_path) == []


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


@pytest.mark.slow
@pytest.mark.skipif(WHY != "", reason=WHY)
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
    job = login.latest_job(run, made="results/store/karhunen_loeve/*/surface/modes.nc")
    subprocess.run(["scancel", "--signal=KILL", "--full", job], check=True)
    assert run.wait(timeout=1500) == 0, login.log.read_text()[-5000:]
    assert "Trying to restart job" in login.log.read_text()
    assert digests(project.path("results/tiny")) == digests(finished.path("results/tiny"))
