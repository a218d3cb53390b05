"""A run that is killed or a stage that fails leaves nothing that passes for a result, and the next run mends it."""

from __future__ import annotations

import json
import subprocess
import sys
import time

import psutil
import pytest

from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import execute
from workflow.faults.__main__ import outcomes
from workflow.faults.injections import FAULTS
from workflow.faults.scratch import Scratch

pytestmark = pytest.mark.slow

CONTACTS = [
    f"results/killed/contact/square-{design}.nc"
    for design in ("monte_carlo-0-4000", "latin_hypercube-0-4000", "expansion-0-200")
]


def wait_for(condition, seconds: float) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_after_a_kill_unlock_and_a_new_run_give_the_same_results(shared):
    shared.scene("killed", "extends: tiny\n")
    logs = shared.path("results/killed/logs")
    command = [sys.executable, "-m", "snakemake", "-j2", *CONTACTS]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **shared.options) as run:
        wait_for(lambda: list(logs.glob("contact_square-*")), 60)
        stages = psutil.Process(run.pid).children(recursive=True)
        run.kill()
    assert stages
    assert psutil.wait_procs(stages, timeout=30)[1] == []
    assert not all(shared.path(name).exists() for name in CONTACTS)
    assert list(shared.path(".snakemake/locks").iterdir())
    assert shared.snakemake("--unlock").returncode == 0
    shared.make("-j2", *CONTACTS)
    made = {path.relative_to(shared.path("results/killed")) for path in shared.path("results/killed").rglob("*.nc")}
    assert len(made) == 5  # modes, design, three batches
    for name in made:
        assert (shared.path("results/killed") / name).read_bytes() == (shared.path("results/tiny") / name).read_bytes()


@pytest.mark.parametrize("kind", FAULTS)
def test_one_new_run_mends_each_kind_of_fault(shared, tmp_path, kind):
    scratch = Scratch(shared.folder, tmp_path / "state", "tiny", shared.options["env"])
    scratch.save()
    number = list(FAULTS).index(kind)
    (outcome,) = outcomes(scratch, 1, range(number, number + 1))
    scratch.reset()
    assert (outcome.wrong, outcome.recovery) == ([], 1), outcome.description


def test_a_stage_whose_key_changes_while_it_runs_fails(tmp_path, monkeypatch, capsys):
    """As a second run after an edit does: Snakemake would take what the old code made for a result of the new."""
    key, usage = tmp_path / "key.json", tmp_path / "usage.json"

    def write_key(code: str) -> None:
        key.write_text(json.dumps({"configuration": {}, "code": code}))

    monkeypatch.setattr("roughslip.stages.runtime.command.die_with_parent", lambda: None)
    monkeypatch.setattr("sys.argv", ["stage", f"--key={key}", f"--output={tmp_path / 'a.nc'}", f"--usage={usage}"])
    write_key("old")
    execute(Stage(name="design", result="design.nc"), lambda job: None)
    usage.unlink()
    with pytest.raises(SystemExit) as end:
        execute(Stage(name="design", result="design.nc"), lambda job: write_key("new"))
    assert end.value.code == 1
    assert "changed while the stage ran; run snakemake again" in capsys.readouterr().err
    assert not usage.exists()


def test_a_stage_that_fails_late_leaves_no_result(project):
    """Nor the old one, nor a temporary file; its message is shown once, without a traceback."""
    design = "src/roughslip/stages/design.py"
    project.edit(
        design, "    store.write(", '    if variables:\n        raise store.StoreError("no luck")\n    store.write('
    )
    run = project.snakemake("-j1", "results/tiny/surface/design.nc")
    said = run.stdout + run.stderr
    assert run.returncode == 1
    assert said.splitlines().count("design: no luck") == 1
    assert "Traceback" not in said
    assert [path.name for path in project.path("results/tiny/surface").iterdir()] == ["modes.nc"]
    assert not list(project.path("results/tiny/usage").glob("*design.json*"))
