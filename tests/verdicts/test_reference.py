"""What is kept of a full run."""

import pytest

from roughslip.errors import StoreError
from roughslip.verdicts.kept_results import KEPT, keep


def results(folder, names=KEPT):
    folder.mkdir()
    for name in (*names, "big.nc"):
        (folder / name).write_bytes(f"{name} of {folder.name}".encode())
    return folder


def test_the_kept_files_and_no_others_are_copied(tmp_path):
    keep(results(tmp_path / "paper"), tmp_path / "reference" / "paper")
    copied = {path.name: path.read_bytes() for path in (tmp_path / "reference" / "paper").iterdir()}
    assert copied == {name: f"{name} of paper".encode() for name in KEPT}


def test_a_second_run_replaces_the_first(tmp_path):
    target = tmp_path / "reference"
    keep(results(tmp_path / "old"), target)
    keep(results(tmp_path / "new"), target)
    assert {path.name for path in target.iterdir()} == set(KEPT)
    assert (target / "claims.json").read_text() == "claims.json of new"


def test_an_incomplete_scene_is_refused_whole(tmp_path):
    source = results(tmp_path / "given", [name for name in KEPT if name not in ("figure2.png", "summary.csv")])
    with pytest.raises(StoreError, match=r"given: lacks figure2\.png, summary\.csv"):
        keep(source, tmp_path / "reference")
    assert not (tmp_path / "reference").exists()
