"""What a start of Snakemake refuses before anything is planned."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from workflow.faults.scratch import as_a_user

ROOT = Path(__file__).resolve().parents[2]
ASK = """
import sys
from roughslip.errors import InputError
from workflow.lib.start import refuse_read_only
try:
    refuse_read_only(["mine"])
except InputError as error:
    print(error)
"""


def refused(folder: Path) -> list[str]:
    """Lines of a user who may not overrule permissions, as root may."""
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
    return asked.stdout.splitlines()


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


def test_folders_of_results_that_cannot_be_written_to_are_named(results):
    """Each with what helps; another scene's do not matter."""
    assert refused(results.parent) == []
    (results / "yours").chmod(0o555)
    assert refused(results.parent) == []
    for closed in ("mine/contact", "mine"):
        (results / closed).chmod(0o555)
    assert refused(results.parent) == [
        f"results/{name}: cannot be written to; allow it with: chmod u+rwx results/{name}"
        for name in ("mine", "mine/contact")
    ]


def test_without_results_nothing_is_refused(tmp_path):
    assert refused(tmp_path) == []
