"""What a start finds of earlier runs: stale locks, another run at work, jobs in the queue of Slurm.

The study on Slurm runs where one answers and its plug-in (requirements-cluster.lock) is installed, in this Python or in
the one that CLUSTER_PYTHON names.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
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


def test_a_stale_lock_is_cleared(state):
    assert earlier_runs.hold(state) == (True, [f"{state / 'locks'}: stale lock of an interrupted run; removed"])
    assert list((state / "locks").iterdir()) == []
    (state.parent / "file").write_text("in the way")
    with pytest.raises(InputError, match=r"file: cannot be written to"):
        earlier_runs.hold(state.parent / "file")


def test_the_lock_of_a_run_lasts_until_its_process_ends(state):
    """However many others start meanwhile."""
    imports = "import sys; from pathlib import Path; from workflow.study.earlier_runs import hold"
    code = f"{imports}; print(hold(Path({str(state)!r})), flush=True); sys.stdin.read()"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    environment = {"PYTHONPATH": f"{ROOT / 'src'}:{ROOT}"}
    with subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, env=environment, **pipes) as other:
        assert "is_alone=True" in other.stdout.readline()
        (state / "locks" / "0.input.lock").write_text("results/a.nc\n")
        for _ in range(2):
            line = f"{state.parent}: another run is at work in this folder; wait for its end, or stop it"
            assert earlier_runs.hold(state) == (False, [line])
        other.kill()
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


def test_queued_jobs_of_an_earlier_run_are_refused(tmp_path, monkeypatch):
    """Not a job that Snakemake itself runs in, nor jobs of another folder; nor without an answer of Slurm."""
    here = tmp_path / "a | b"
    (here / ".snakemake").mkdir(parents=True)
    answer = f"12|rule_surface|{here}\n13|rule_page|{here}/../a | b\n14|(null)|{here}\n15|rule_page|/elsewhere"
    monkeypatch.setenv("PATH", squeue(tmp_path / "bin", f"/bin/cat <<'END'\n{answer}\nEND"))
    with pytest.raises(InputError, match=re.escape(f"{here}: jobs of an interrupted run") + ".*: scancel 12 13$"):
        earlier_runs.refuse_queued_jobs(here / ".snakemake")
    monkeypatch.setattr(earlier_runs, "_SECONDS", 0.2)
    fails = squeue(tmp_path / "fails", f"echo '12|rule_page|{here}' >&2; exit 1")
    for path in (str(tmp_path), fails, squeue(tmp_path / "hangs", "exec /bin/sleep 5")):
        monkeypatch.setenv("PATH", path)
        earlier_runs.refuse_queued_jobs(here / ".snakemake")


PYTHON = os.environ.get("CLUSTER_PYTHON", sys.executable)


def missing() -> str:
    """Why this cannot run here, empty where it can."""
    if shutil.which("sinfo") is None or subprocess.run(["sinfo", "--noheader"], capture_output=True).returncode:
        return "no Slurm answers here"
    if subprocess.run([PYTHON, "-c", "import snakemake_executor_plugin_slurm"], capture_output=True).returncode:
        return "the plug-in of requirements-cluster.lock is not installed"
    return ""


@pytest.mark.slow
@pytest.mark.skipif(missing() != "", reason=missing())
def test_results_on_slurm_are_those_of_this_machine_whatever_is_killed(finished, tmp_path):
    """Snakemake itself, whose jobs must be out of the queue before the next; then a job, which is submitted again."""
    project, log = finished.copy(tmp_path / "copy"), tmp_path / "log"

    def start() -> subprocess.Popen:
        command = [PYTHON, "-m", "snakemake", "tiny", "--profile", "profiles/slurm", "--config", "memory_mb=4000"]
        with log.open("w") as said:
            return subprocess.Popen(command, stdout=said, stderr=subprocess.STDOUT, **project.options)

    def latest_job(run: subprocess.Popen, made: str) -> str:
        """Of those that run on a node as soon as a result is there."""
        while run.poll() is None:
            running = earlier_runs.queued_jobs(project.folder, "RUNNING") if [*project.folder.glob(made)] else []
            if running:
                return max(running, key=int)
            time.sleep(0.2)
        raise AssertionError(log.read_text()[-5000:])

    run = start()
    job = latest_job(run, made="results/store/karhunen_loeve")
    run.kill()
    run.wait()
    assert start().wait(timeout=300) == 1
    assert f"{project.folder}: jobs of an interrupted run are in the queue" in log.read_text()
    left = log.read_text().rpartition("scancel ")[2].split()
    assert job in left
    subprocess.run(["scancel", *left], check=True)

    run = start()
    job = latest_job(run, made="results/store/karhunen_loeve/*/surface/modes.nc")
    subprocess.run(["scancel", "--signal=KILL", "--full", job], check=True)
    assert run.wait(timeout=1500) == 0, log.read_text()[-5000:]
    assert "Trying to restart job" in log.read_text()
    assert digests(project.path("results/tiny")) == digests(finished.path("results/tiny"))
