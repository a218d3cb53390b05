"""What all stages share: errors in one line, the record of cost, their end, the sum of costs, the report."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from roughslip.errors import ConvergenceError, InputError
from roughslip.scene.declarations import Stage
from roughslip.stages.costs import total
from roughslip.stages.report import read_scene
from roughslip.stages.runtime.command import execute
from roughslip.stages.runtime.usage import Usage

STAGE = Stage(name="contact", result="contact.nc")
SOURCE = Path(__file__).resolve().parents[2] / "src"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run a stage in this process."""
    key = tmp_path / "key.json"
    key.write_text(json.dumps({"configuration": {"seed": 5}, "code": "abc"}), encoding="utf-8")

    def run(work):
        monkeypatch.setattr(sys, "argv", ["stage", "--key", str(key)])
        execute(STAGE, work)

    run.folder = tmp_path
    return run


@pytest.mark.parametrize(
    ("error", "lines"),
    [
        (ConvergenceError("no end", 1e-3, 7), ["contact: error: no end (residual reached 1.000e-03, work 7)"]),
        (InputError(["first mistake", "second mistake"]), ["contact: error: first mistake", "second mistake"]),
    ],
)
def test_an_error_of_the_package_is_a_message(run, capsys, error, lines):
    def work(job):
        raise error

    with pytest.raises(SystemExit) as stop:
        run(work)
    assert stop.value.code == 1
    assert capsys.readouterr().err.splitlines() == lines
    assert sorted(path.name for path in run.folder.iterdir()) == ["key.json"]  # and no record of cost
    with pytest.raises(ZeroDivisionError):  # a mistake of ours keeps its traceback
        run(lambda job: 1 / 0)


def spend(cpu_seconds: float) -> None:
    start = time.process_time()
    while time.process_time() - start < cpu_seconds:
        pass


def test_record_holds_costs_counts_and_warnings(tmp_path, capsys):
    path = tmp_path / "usage.json"
    with Usage(path, "contact") as usage:
        usage.count(solves=3, convolutions=40)
        usage.count(solves=2)
        usage.skip({"solves: no contact": np.int64(1), "nodes: below the plane": 0})
        usage.skip({"solves: no contact": 2})
        for text in ("few strips", "long waves", "few strips"):
            usage.warn(text)
        with usage.core():
            spend(0.05)
        spend(0.05)
        with usage.core():
            spend(0.05)
    record = json.loads(path.read_text())
    assert (record["stage"], record["jobs"]) == ("contact", 1)
    assert record["did"] == {"convolutions": 40, "solves": 5}
    assert record["skipped"] == {"nodes: below the plane": 0, "solves: no contact": 3}
    assert record["warnings"] == ["few strips", "long waves"]  # each once, and in the log
    assert capsys.readouterr().err.splitlines() == ["contact: warning: few strips", "contact: warning: long waves"]
    assert 0.1 <= record["core_cpu_seconds"] < 0.15  # the two blocks, without the time between them
    assert record["cpu_seconds"] == pytest.approx(time.process_time(), abs=0.1)
    assert [file.name for file in tmp_path.iterdir()] == ["usage.json"]


POOL = """
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
import time
from roughslip.stages import die_with_parent

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

    The stage is still importing numpy, as it does for seconds on a busy machine.
    """
    (tmp_path / "campaign.py").write_text(POOL)
    (tmp_path / "numpy.py").write_text("import time; print('ready', flush=True); time.sleep(60)")
    parent = (
        "import os, subprocess, sys; from roughslip.stages import PARENT\n"
        "os.environ[PARENT] = str(os.getpid()); subprocess.run([sys.executable, '-m', 'roughslip.stages', 'design'])"
    )
    command = [sys.executable, *(("-c", parent) if kind == "stage" else ("campaign.py",))]
    process = subprocess.Popen(command, env=environment(), stdout=subprocess.PIPE, text=True, cwd=tmp_path)
    assert process.stdout.readline() == "ready\n"
    process.kill()
    assert process.communicate(timeout=20)[0] == ""


def test_ctrl_c_ends_a_stage_without_a_traceback(tmp_path):
    """While it imports numpy. A test that runs in the background of a shell would hand on that Ctrl-C is ignored."""
    (tmp_path / "numpy.py").write_text("import time; print('ready', flush=True); time.sleep(60)")
    process = subprocess.Popen(
        [sys.executable, "-m", "roughslip.stages", "design"],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=20) == ("", "")
    assert process.returncode == -signal.SIGINT


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(SOURCE)}


def record(stage, cpu, core, peak, **did):
    numbers = {"cpu_seconds": cpu, "wall_seconds": 2 * cpu, "core_cpu_seconds": core, "peak_memory_mib": peak}
    skipped = {"solves: no contact": did.get("solves", 0)}
    return {"stage": stage, "jobs": 1, **numbers, "did": did, "skipped": skipped, "warnings": []}


def test_costs_add_up_and_memory_is_that_of_the_largest_job():
    """Counts of zero are kept; a job may be too short for the clock, or its platform measure no memory. Stages that did
    not run stand in the last row."""
    jobs = [
        record("friction", 0.0, 0.0, None, windows=10),
        record("contact", 10.0, 9.0, 300.0, solves=3, convolutions=40),
        record("contact", 20.0, 18.0, 250.0, solves=4),
    ]
    jobs[1]["warnings"], jobs[2]["warnings"] = ["b", "c"], ["a", "b"]
    contact, friction, everything = total(jobs, {"spacing": "given", "design": "not asked for"}, ["of the scene"])
    assert contact == {
        "stage": "contact",
        "jobs": 2,
        "cpu_seconds": 30.0,
        "wall_seconds": 60.0,
        "core_cpu_seconds": 27.0,
        "core_share": 0.9,
        "peak_memory_mib": 300.0,
        "did": {"convolutions": 40, "solves": 7},
        "skipped": {"solves: no contact": 7},
        "warnings": ["b", "c", "a"],
    }
    assert everything["warnings"] == ["of the scene", "contact: b", "contact: c", "contact: a"]
    assert (friction["core_share"], friction["peak_memory_mib"]) == (0.0, None)
    assert friction["skipped"] == {"solves: no contact": 0}
    assert (everything["stage"], everything["jobs"], everything["core_share"]) == ("all", 3, 0.9)
    assert everything["did"] == {"convolutions": 40, "solves": 7, "windows": 10}
    assert everything["not_needed"] == {"design": "not asked for", "spacing": "given"}


def test_an_accuracy_that_is_not_reached_is_a_warning():
    """Asked and reached are counts of different stages; a number equal to the asked one has none.

    It follows the first warning on the scene, as the end of a run shows few warnings, and has digits that differ.
    """
    jobs = [
        record("pilot", 0.0, 0.0, None, friction_std_asked=0.03, friction_mean_asked=0.01, cycles_asked=3),
        record("friction", 0.0, 0.0, None, friction_std_reached=0.03001, friction_mean_reached=0.01),
    ]
    first, text, last = total(jobs, {}, ["the curve", "of the scene"])[-1]["warnings"]
    assert first == "the curve"
    assert text.startswith("accuracy.friction_std of 0.03 was asked and 0.03001 is reached")
    assert last == "of the scene"


CAPTIONS = {"figure2": "Pressure.", "figure5": "Cycles."}


@pytest.fixture
def scene(tmp_path):
    """A scene that ran claims and one stage for Figure 5, in a folder where Figure 2 was made before."""
    (tmp_path / "keys").mkdir()
    for stage, configuration in (
        ("claims", {"description": "Mine", "targets": ["figure5"]}),
        ("cycles", {"oscillator": {"damping_ratio": 0.17}}),
        ("deterministic", {"oscillator": {"mass_kg": 1.0}}),
        ("figure5", {"description": "Mine"}),
        ("contact_square", {"oscillator": {"damping_ratio": 0.4}, "square": {"nodes": 10}}),
    ):
        key = {"configuration": configuration, "code": "abc"}
        (tmp_path / "keys" / f"{stage}.json").write_text(json.dumps(key), encoding="utf-8")
    for name in ("figure2", "figure5"):
        (tmp_path / f"{name}.png").write_bytes(name.encode())
        (tmp_path / f"{name}.svg").write_text(f"<svg>{name}</svg>")
    costs = [{"stage": stage} for stage in ("claims", "cycles", "deterministic", "figure5", "all")]
    (tmp_path / "costs.json").write_text(json.dumps(costs), encoding="utf-8")
    (tmp_path / "claims.json").write_text("[]", encoding="utf-8")
    return tmp_path


def files_of(folder: Path) -> dict[str, Path]:
    names = ("costs.json", "claims.json", "figure5.png", "figure5.svg")
    keys = (f"keys/{stage}.json" for stage in ("claims", "cycles", "deterministic", "figure5", "contact_square"))
    return {name: folder / name for name in (*names, *keys)}


def test_only_what_this_run_made_is_shown(scene):
    found = read_scene("mine", files_of(scene), CAPTIONS, Path("results/mine"))
    assert (found.name, found.description, found.folder, found.file) == ("mine", "Mine", "", "")
    assert found.figures == {"figure5": b"<svg>figure5</svg>"}
    assert json.loads(found.configuration) == {
        "description": "Mine",
        "targets": ["figure5"],
        "oscillator": {"damping_ratio": 0.17, "mass_kg": 1.0},
    }


def test_links_lead_from_the_joint_page_to_files_of_the_scene(scene, monkeypatch):
    """The scene file too, where the scene has one of its own: variants of a sweep have none."""
    monkeypatch.chdir(scene)
    file = scene / "config/scenes/mine.yaml"
    file.parent.mkdir(parents=True)
    file.write_text("{}")
    found = read_scene("mine", files_of(scene), CAPTIONS, Path("results"))
    assert (found.folder, found.file) == ("mine/", "../config/scenes/mine.yaml")
