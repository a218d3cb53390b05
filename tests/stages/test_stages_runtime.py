"""What the commands of all stages share: options, errors in one line, the record of cost, pictures, their end."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure
from numba import njit

from roughslip import store
from roughslip.errors import ConvergenceError, InputError, ParameterError, StoreError
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime import command
from roughslip.stages.runtime.command import execute
from roughslip.stages.runtime.drawing import draw_and_save
from roughslip.stages.runtime.usage import Usage, peak_memory_mib

STAGE = Stage(name="contact", result="contact.nc")
SOURCE = Path(__file__).resolve().parents[2] / "src"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run a stage in this process, which must outlive its parent's death signal."""
    monkeypatch.setattr(command, "die_with_parent", lambda: None)
    key = tmp_path / "key.json"
    key.write_text(json.dumps({"configuration": {"seed": 5}, "code": "abc"}), encoding="utf-8")

    def run(work, *arguments, stage=STAGE):
        shared = ["--key", str(key), "--output", str(tmp_path / "out.nc"), "--usage", str(tmp_path / "usage.json")]
        monkeypatch.setattr(sys, "argv", ["stage", *shared, *arguments])
        execute(stage, work)

    run.folder = tmp_path
    return run


@pytest.mark.parametrize(
    ("error", "lines"),
    [
        (ParameterError("the mesh must be finite"), ["contact: the mesh must be finite"]),
        (ConvergenceError("no end", 1e-3, 7), ["contact: no end (residual reached 1.000e-03, work 7)"]),
        (InputError(["first mistake", "second mistake"]), ["contact: first mistake", "second mistake"]),
    ],
)
def test_an_error_of_the_package_is_a_message_and_exit_1(run, capsys, error, lines):
    def work(job):
        raise error

    with pytest.raises(SystemExit) as stop:
        run(work)
    assert stop.value.code == 1
    assert capsys.readouterr().err.splitlines() == lines
    assert sorted(path.name for path in run.folder.iterdir()) == ["key.json"]  # and no record of cost


def test_a_mistake_of_ours_keeps_its_traceback(run):
    with pytest.raises(ZeroDivisionError):
        run(lambda job: 1 / 0)


def test_a_stage_gets_its_slice_and_its_arguments_and_leaves_its_record(run):
    seen = {}

    def work(job):
        seen.update(vars(job.arguments), configuration=job.key.configuration)
        job.usage.count(solves=3)

    stage = Stage(
        name="contact",
        inputs={"surface": ""},
        many={"contact": ""},
        optional={"friction": "", "scan": ""},
        result="contact/{design}-{first}-{last}.nc",
        outputs={"png": ""},
    )
    given = {
        "surface": "s.nc",
        "contact": ("a.nc", "b.nc"),
        "design": "lhs",
        "png": "f.png",
        "first": 4,
        "last": 8,
    }
    arguments = [part for name, value in given.items() for part in (f"--{name}", *map(str, np.atleast_1d(value)))]
    run(work, *arguments, "--friction", stage=stage)  # an optional file that the scene does not have
    assert seen["configuration"] == {"seed": 5}
    assert (seen["surface"], seen["contact"]) == (Path("s.nc"), [Path("a.nc"), Path("b.nc")])
    assert (seen["design"], seen["png"]) == ("lhs", Path("f.png"))
    assert seen["friction"] is seen["scan"] is None
    assert (seen["first"], seen["last"]) == (4, 8)
    record = json.loads((run.folder / "usage.json").read_text())
    assert (record["stage"], record["did"]) == ("contact", {"solves": 3})


KEY = store.Key({"description": "Mine"}, "abc")


@pytest.fixture
def job(tmp_path):
    variables = {
        "drawn": store.Variable(("x",), np.arange(3.0), "Pa", "what is drawn"),
        "other": store.Variable(("x",), np.arange(3.0), "m", "what is not"),
    }
    store.write(tmp_path / "result.nc", variables, store.Key({"seed": 1}, "of the result"))
    names = {"png": "out/f.png", "svg": "out/f.svg", "output": "out/f.nc"}
    paths = {option: tmp_path / name for option, name in names.items()}
    return SimpleNamespace(arguments=SimpleNamespace(**paths, results=[tmp_path / "result.nc"]), key=KEY)


def draw(result):
    figure = Figure(figsize=(1, 1))
    figure.subplots().plot(result["drawn"])
    return figure


def test_two_pictures_and_the_numbers_in_them(job):
    draw_and_save(job, draw, ["drawn"])
    folder = job.arguments.png.parent
    assert sorted(path.name for path in folder.iterdir()) == ["f.nc", "f.png", "f.svg"]
    assert job.arguments.png.read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in job.arguments.svg.read_bytes()
    stored = store.read(job.arguments.output)
    assert list(stored) == ["drawn"]
    assert (stored.variable("drawn").units, list(stored["drawn"])) == ("Pa", [0.0, 1.0, 2.0])
    assert json.loads(stored.attributes["configuration"]) == KEY.configuration


def test_a_variable_that_the_result_lacks_is_named(job):
    with pytest.raises(StoreError, match="holds no variable 'missing'"):
        draw_and_save(job, draw, ["drawn", "missing"])


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


@pytest.mark.slow
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


WAITING_STAGE = (
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
    command = [sys.executable, "-c", WAITING_STAGE]
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
