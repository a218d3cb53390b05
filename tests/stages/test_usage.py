"""The record of a job's cost, its progress lines, and a stage that dies with its parent."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from numba import njit

from roughslip.stages.runtime import usage as module
from roughslip.stages.runtime.usage import Usage, peak_memory_mib

SOURCE = Path(__file__).resolve().parents[2] / "src"


def spend(cpu_seconds: float) -> None:
    start = time.process_time()
    while time.process_time() - start < cpu_seconds:
        pass


def test_record_holds_costs_and_counts(tmp_path):
    path = tmp_path / "usage.json"
    with Usage(path, "contact") as usage:
        usage.count(solves=3, convolutions=40)
        usage.count(solves=2)
        usage.skip({"solves: no contact": np.int64(1), "nodes: below the plane": 0})
        usage.skip({"solves: no contact": 2})
        with usage.core():
            spend(0.05)
        spend(0.05)
        with usage.core():
            spend(0.05)
    record = json.loads(path.read_text())
    assert (record["stage"], record["jobs"]) == ("contact", 1)
    assert record["did"] == {"convolutions": 40, "solves": 5}
    assert record["skipped"] == {"nodes: below the plane": 0, "solves: no contact": 3}
    assert 0.1 <= record["core_cpu_seconds"] < 0.15  # the two blocks, without the time between them
    assert record["cpu_seconds"] == pytest.approx(time.process_time(), abs=0.1)
    assert [file.name for file in tmp_path.iterdir()] == ["usage.json"]


def test_failed_job_leaves_no_record(tmp_path):
    with pytest.raises(RuntimeError), Usage(tmp_path / "usage.json", "contact"):
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_compiling_is_not_core(tmp_path):
    @njit
    def inner(x):
        return np.sort(x)[::-1] + np.cumsum(x)

    @njit
    def outer(x):
        return inner(x) * inner(x + 1.0)

    usage = Usage(tmp_path / "usage.json", "contact")
    start = time.process_time()
    with usage.core():
        outer(np.arange(4.0))
        spend(0.05)
    spent = time.process_time() - start
    assert spent > 0.3, "compiling this took some 0.7 s when the test was written"
    assert 0.05 <= usage.core_cpu_seconds < 0.05 + 0.2 * (spent - 0.05)  # nested compilations are not taken off twice


def test_core_of_a_job_that_fails_counts_what_was_spent(tmp_path):
    def spend_and_stop():
        spend(0.02)
        raise ValueError("stop")

    usage = Usage(tmp_path / "usage.json", "contact")
    with pytest.raises(ValueError, match="stop"), usage.core():
        spend_and_stop()
    assert usage.core_cpu_seconds >= 0.02


def test_progress_is_a_line_every_few_seconds_and_one_at_the_end(tmp_path, capsys, monkeypatch):
    usage = Usage(tmp_path / "usage.json", "contact")
    for done in range(1, 101):
        usage.progress(done, 100)
    assert [line.split(" after ")[0] for line in capsys.readouterr().err.splitlines()] == ["contact: 100 of 100"]
    monkeypatch.setattr(module, "_LINES_APART", 0.0)
    usage.progress(1, 100)
    usage.progress(2, 100)
    assert len(capsys.readouterr().err.splitlines()) == 2


@pytest.mark.skipif(sys.platform not in ("linux", "darwin"), reason="no peak memory on this platform")
def test_peak_memory_sees_an_array_of_known_size():
    script = (
        "from roughslip.stages.runtime.usage import peak_memory_mib\n"
        "before = peak_memory_mib(); block = bytearray(64 * 2**20); block[::4096] = b'x' * 2**14\n"
        "del block; print(peak_memory_mib() - before)"
    )
    grown = float(subprocess.run([sys.executable, "-c", script], env=environment(), capture_output=True).stdout)
    assert grown == pytest.approx(64, abs=1)  # pages and the interpreter's own blocks
    assert peak_memory_mib() > grown


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's own time of start is read on Linux only")
def test_wall_time_runs_from_the_start_of_the_process():
    script = "import time; time.sleep(0.3); from roughslip.stages.runtime.usage import Usage; "
    script += "print(Usage('x', 'y').record())"
    out = subprocess.run([sys.executable, "-c", script], env=environment(), capture_output=True, text=True).stdout
    assert 0.29 <= float(out.split("'wall_seconds': ")[1].split(",")[0]) < 5.0  # to one clock tick; slow machines


STAGE = (
    "import time; from roughslip.stages.runtime.usage import die_with_parent\n"
    "die_with_parent(); print('ready', flush=True); time.sleep(60)"
)
POOL = """
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
import time
from roughslip.stages.runtime.usage import die_with_parent

def work(number):
    print("ready", flush=True)
    time.sleep(60)

if __name__ == "__main__":
    with ProcessPoolExecutor(1, get_context("spawn"), die_with_parent) as pool:
        pool.submit(work, 1).result()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="Linux only")
@pytest.mark.parametrize("kind", ["stage", "processes of a campaign"])
def test_a_job_dies_with_its_parent(tmp_path, kind):
    """The child holds the other end of the pipe: reading it ends when the child is gone, long before its 60 s.

    A campaign is a job that starts processes: `python -m workflow.job campaign`.
    """
    command = [sys.executable, "-c", STAGE]
    if kind != "stage":
        (tmp_path / "workflow").mkdir()
        (tmp_path / "workflow" / "campaign.py").write_text(POOL)
        shutil.copy(SOURCE.parent / "workflow" / "job.py", tmp_path / "workflow" / "job.py")
        command = [sys.executable, "-m", "workflow.job", "campaign"]
    parent = (
        "import os, subprocess; from roughslip.stages.runtime.usage import PARENT\n"
        f"os.environ[PARENT] = str(os.getpid()); subprocess.run({command!r})"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", parent], env=environment(), stdout=subprocess.PIPE, text=True, cwd=tmp_path
    )
    assert process.stdout.readline() == "ready\n"
    process.kill()
    assert process.communicate(timeout=20)[0] == ""


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(SOURCE)}
