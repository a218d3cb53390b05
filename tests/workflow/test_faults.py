"""A run that is killed or a stage that fails leaves nothing that passes for a result, and the next run mends it."""

from __future__ import annotations

import json
import os
import re
import shutil
from random import Random

import pytest

from roughslip.compilation.source_hash import closure_hash, compiled_folder
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime import command, usage
from tests.workflow.faults import FAULTS, not_mended
from tests.workflow.project import digests

pytestmark = pytest.mark.slow


COUNT, SEED = int(os.environ.get("FAULTS", len(FAULTS))), os.environ.get("FAULT_SEED", "1")


@pytest.mark.parametrize("number", range(COUNT))
def test_one_new_run_mends_each_kind_of_fault(project, tmp_path, monkeypatch, number):
    """`make faults` asks for more of them. Fault n of a seed is the same each time."""
    kind, before = list(FAULTS)[number % len(FAULTS)], digests(project.path("results/tiny"))
    shutil.copytree(compiled_folder(), tmp_path / "numba")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    description = FAULTS[kind](project, Random(f"{SEED} {number}"))
    print(f"{kind}: {description}")
    assert not_mended(project, before) == []


def test_a_stage_whose_code_or_scan_changes_while_it_runs_fails(tmp_path, monkeypatch, capsys):
    """Its name says what it is made of. An edit that changes no syntax, of a comment, is none."""
    source, scan = tmp_path / "roughslip" / "stages" / "design.py", tmp_path / "scan.txt"
    source.parent.mkdir(parents=True)
    for package in ("roughslip", "roughslip/stages"):
        (tmp_path / package / "__init__.py").write_text("")
    source.write_text("old = 1\n")
    scan.write_text("1 2\n")
    files = {"roughslip/stages/design.py": usage.checksum(source)}
    sources = {"files": files, "closure": closure_hash("roughslip.stages.design", tmp_path)}
    key = {"configuration": {}, "code": "", "sources": sources, "scans": [usage.checksum(scan)]}
    key["inputs"] = {"scan": [str(scan)]}
    (tmp_path / "key.json").write_text(json.dumps(key))
    monkeypatch.setattr(command, "SOURCE", tmp_path)
    monkeypatch.setattr("sys.argv", ["stage", f"--key={tmp_path / 'key.json'}"])
    stage, made = Stage(name="design", result="design.nc"), tmp_path / "usage" / "design.json"
    command.execute(stage, lambda job: source.write_text("old = 1  # as before\n"))
    assert made.is_file()
    made.unlink()
    for file, text in ((scan, "1 3\n"), (source, "new = 1\n")):
        with pytest.raises(SystemExit):
            command.execute(stage, lambda job, file=file, text=text: file.write_text(text))
        assert f"{file.name} was" in (said := capsys.readouterr().err)
        assert "during the run: nothing is written; run snakemake again" in said
        assert not made.exists()
        scan.write_text("1 2\n")


def test_a_stage_that_fails_late_leaves_no_result(project):
    """Nor a temporary file; its message is shown once, without a traceback. What was made before is there to open."""
    design = "src/roughslip/stages/design.py"
    project.edit(
        design, "    store.write(", '    if variables:\n        raise store.StoreError("no luck")\n    store.write('
    )
    run = project.snakemake("-j1", "results/tiny/surface/design.nc")
    said = run.stdout + run.stderr
    assert run.returncode == 1
    (folder,) = re.findall(r"\[(results/store/design/\w+)/logs", said)
    assert [line for line in said.splitlines() if "no luck" in line] == [
        f"tiny: design: no luck [{folder}/logs/design.log]"
    ]
    assert "Traceback" not in said
    assert sorted(path.name for path in project.path(folder).iterdir()) == ["key.json", "logs"]
    assert project.path("results/tiny/surface/modes.nc").is_file()
