"""Jobs of a dead run in the queue of Slurm: those of rules, submitted from this folder, are told and nothing starts."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from roughslip.errors import InputError
from workflow.recovery import slurm_orphans


def answering(folder: Path, script: str) -> Path:
    """A folder with a squeue that does as the script says."""
    folder.mkdir()
    (folder / "squeue").write_text(f"#!/bin/sh\n{script}\n")
    (folder / "squeue").chmod(0o755)
    return folder


@pytest.fixture
def here(tmp_path: Path) -> Path:
    (tmp_path / "a | b").mkdir()
    return tmp_path / "a | b"


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        (["12|rule_surface_wildcards_tiny|{here}", "13|rule_costs|{here}"], "12 13"),
        (["12|rule_surface|{here}/..", "13|rule_costs|{here}/../a | b", "14|(null)|{here}"], "13"),
        (["14|(null)|{here}", "15|rule_costs|/elsewhere"], ""),
        (["slurm_load_jobs error: nothing"], ""),
        ([], ""),
    ],
)
def test_jobs_of_rules_from_this_folder_are_refused(lines, told, here, tmp_path, monkeypatch):
    """Not a job that Snakemake itself runs in, nor those of another folder."""
    said = "\n".join(lines).format(here=here)
    monkeypatch.setenv("PATH", str(answering(tmp_path / "bin", f"/bin/cat <<'END'\n{said}\nEND")))
    if told:
        with pytest.raises(InputError, match=re.escape(f"{here}: jobs of a run that is gone") + f".*: scancel {told}$"):
            slurm_orphans.refuse(here)
    else:
        slurm_orphans.refuse(here)


def test_without_slurm_or_an_answer_of_it_none_are_known(here, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert slurm_orphans.jobs(here) == []
    monkeypatch.setenv("PATH", str(answering(tmp_path / "fails", f"echo '12|rule_costs|{here}' >&2; exit 1")))
    assert slurm_orphans.jobs(here) == []
    monkeypatch.setattr(slurm_orphans, "_SECONDS", 0.2)
    monkeypatch.setenv("PATH", str(answering(tmp_path / "hangs", "exec /bin/sleep 5")))
    assert slurm_orphans.jobs(here) == []
    slurm_orphans.refuse(here)
