"""Folders of results that cannot be written to are named before anything is planned."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from workflow.faults.scratch import as_a_user

ROOT = Path(__file__).resolve().parents[2]
ASK = "from workflow.study.scenes import not_writable; print(*not_writable('mine'), sep='\\n')"


def closed_to_a_user(folder: Path) -> list[str]:
    """What stands in the way of a user who may not overrule permissions, as root may."""
    environment = {"PYTHONPATH": f"{ROOT}:{ROOT / 'src'}"}
    asked = subprocess.run(
        [sys.executable, "-c", ASK],
        cwd=folder,
        env=environment,
        preexec_fn=as_a_user(),
        capture_output=True,
        text=True,
        check=True,
    )
    return asked.stdout.split()


@pytest.fixture
def results(tmp_path: Path):
    """Results of two scenes, whose rights a test may take."""
    folders = [tmp_path / "results" / name for name in ("mine", "mine/contact", "yours")]
    for folder in folders:
        folder.mkdir(parents=True)
        (folder / "a.nc").write_text("")
    yield tmp_path / "results"
    for folder in [tmp_path / "results", *folders]:
        folder.chmod(0o755)


@pytest.mark.parametrize("closed", [["results/mine"], ["results/mine/contact"], ["results", "results/mine"]])
def test_each_is_named_and_those_of_other_scenes_do_not_matter(results, closed):
    (results / "yours").chmod(0o555)
    assert closed_to_a_user(results.parent) == []
    for folder in closed:
        (results.parent / folder).chmod(0o555)
    assert closed_to_a_user(results.parent) == closed


def test_before_the_first_run_the_folder_of_the_project_counts(tmp_path):
    assert closed_to_a_user(tmp_path) == []
    tmp_path.chmod(0o555)
    assert closed_to_a_user(tmp_path) == ["."]
    tmp_path.chmod(0o755)
