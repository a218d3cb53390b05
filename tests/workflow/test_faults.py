"""A run that is killed or a stage that fails leaves nothing that passes for a result, and the next run mends it."""

from __future__ import annotations

import json

import pytest

from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import execute
from workflow.faults.__main__ import outcomes
from workflow.faults.injections import FAULTS
from workflow.faults.scratch import Scratch

pytestmark = pytest.mark.slow


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
    assert [line for line in said.splitlines() if "no luck" in line] == [
        "tiny: design: no luck [results/tiny/logs/design.log]"
    ]
    assert "Traceback" not in said
    assert [path.name for path in project.path("results/tiny/surface").iterdir()] == ["modes.nc"]
    assert not list(project.path("results/tiny/usage").glob("*design.json*"))
