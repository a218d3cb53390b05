"""What all stages share: errors in one line, the record of cost, the end of a job, sums of costs."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType

import pytest

from roughslip.errors import ConvergenceError, InputError
from roughslip.study.job import main
from roughslip.study.page import total_costs
from tests.study.conftest import job_of

SOURCE = Path(__file__).resolve().parents[2] / "src"


@pytest.mark.parametrize(
    ("error", "lines"),
    [
        (ConvergenceError("no end", 1e-3, 7), ["contact: error: no end (residual reached 1.000e-03, work 7)"]),
        (InputError(["first mistake", "second mistake"]), ["contact: error: first mistake", "second mistake"]),
    ],
)
def test_an_error_of_the_package_is_a_message(tmp_path, monkeypatch, capsys, error, lines):
    """And no record is left. A mistake of ours keeps its traceback."""
    raised, module, key = [error, ZeroDivisionError()], ModuleType("contact"), tmp_path / "contact" / "0" / "key.json"

    def work(scene, job):
        assert (scene.seed, job.scene, job.key.code, list(job.numbers)) == (5, scene, "abc", [0, 1])
        raise raised.pop(0)

    module.work = work
    monkeypatch.setitem(sys.modules, "roughslip.study.contact", module)
    key.parent.mkdir(parents=True)
    entry = {"stage": "contact", "configuration": {"seed": 5}, "code": "abc"}
    entry |= {name: {} for name in ("sources", "inputs", "outputs", "files")}
    key.write_text(json.dumps(entry), encoding="utf-8")
    monkeypatch.setattr(sys, "argv", ["stage", "--key", str(key), "--first", "0", "--last", "2"])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 1
    assert capsys.readouterr().err.splitlines() == lines
    assert sorted(path.name for path in key.parent.iterdir()) == ["key.json"]
    with pytest.raises(ZeroDivisionError):
        main()


def test_records_of_jobs_hold_costs_and_warnings_and_add_up(tmp_path, capsys):
    """Warnings each once, and in the log. Memory is that of the largest job."""
    job = job_of("contact", {"seed": 5}, tmp_path / "contact.nc")
    job.count(solves=3, convolutions=40)
    job.count(solves=2)
    job.warn("few strips", "long waves", "few strips")
    record = json.loads(json.dumps(job.record()))
    assert (record["stage"], record["jobs"]) == ("contact", 1)
    assert record["did"] == {"convolutions": 40, "solves": 5}
    assert record["warnings"] == ["few strips", "long waves"]
    assert capsys.readouterr().err.splitlines() == ["contact: warning: few strips", "contact: warning: long waves"]
    assert record["cpu_seconds"] == pytest.approx(time.process_time(), abs=0.2)
    record |= {"cpu_seconds": 10.0, "wall_seconds": 20.0, "peak_memory_mib": 300.0}
    other = record | {"stage": "friction", "did": {"windows": 10}, "warnings": [], "cpu_seconds": 1.0}
    jobs = [record, record | {"cpu_seconds": 5.0, "peak_memory_mib": 250.0, "warnings": ["long waves", "b"]}, other]
    contact, friction, everything = total_costs(jobs, ["of the scene"])
    sums = {"jobs": 2, "cpu_seconds": 15.0, "wall_seconds": 40.0, "peak_memory_mib": 300.0}
    assert sums.items() <= contact.items()
    assert contact["did"] == {"convolutions": 80, "solves": 10}
    assert contact["warnings"] == ["few strips", "long waves", "b"]
    assert (friction["cpu_seconds"], everything["cpu_seconds"], everything["jobs"]) == (1.0, 16.0, 3)
    assert everything["warnings"] == ["of the scene", *(f"contact: {text}" for text in contact["warnings"])]


@pytest.mark.parametrize("is_killed", [True, False])
def test_a_job_dies_with_its_parent_and_ctrl_c_shows_no_traceback(tmp_path, is_killed):
    """The child holds the other end of the pipe: reading it ends when the child is gone, long before its 60 s.

    The stage is still importing numpy. A test in the background of a shell would hand on that Ctrl-C is ignored.
    """
    (tmp_path / "numpy.py").write_text("import time; print('ready', flush=True); time.sleep(60)")
    parent = (
        "import os, subprocess, sys; from roughslip.study import PARENT\n"
        "os.environ[PARENT] = str(os.getpid()); subprocess.run([sys.executable, '-m', 'roughslip.study'])"
    )
    command = [sys.executable, *(("-c", parent) if is_killed else ("-m", "roughslip.study"))]
    process = subprocess.Popen(
        command,
        env={**os.environ, "PYTHONPATH": str(SOURCE)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGKILL if is_killed else signal.SIGINT)
    assert process.communicate(timeout=20) == ("", "")
    assert process.returncode == -(signal.SIGKILL if is_killed else signal.SIGINT)
