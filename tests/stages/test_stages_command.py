"""What every stage's command shares: errors told in one line, arguments, the record of cost."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from roughslip.errors import ConvergenceError, InputError, ParameterError
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime import command
from roughslip.stages.runtime.command import execute

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


def test_a_damaged_input_is_named_with_what_rebuilds_it(tmp_path):
    """A whole command in a process of its own."""
    (tmp_path / "key.json").write_text('{"configuration": {}, "code": "abc"}', encoding="utf-8")
    (tmp_path / "record.json").write_text('{"stage": "con', encoding="utf-8")
    arguments = [f"--{name}={tmp_path / name}.json" for name in ("key", "output", "usage")]
    found = subprocess.run(
        [sys.executable, "-m", "roughslip.stages.costs", *arguments, "--records", str(tmp_path / "record.json")],
        env={**os.environ, "PYTHONPATH": str(SOURCE)},
        capture_output=True,
        text=True,
    )
    assert found.returncode == 1
    (line,) = found.stderr.splitlines()
    assert line.startswith(f"costs: {tmp_path / 'record.json'}: missing or not JSON")
    assert "rebuild it with:" in line
    assert not (tmp_path / "output.json").exists()
