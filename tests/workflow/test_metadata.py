"""Snakemake's own records: what it could not read goes, what it could stays."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from workflow.recovery import snakemake_metadata

SOUND = json.dumps({"rule": "surface", "input": ["a"], "input_checksums": {"a": "sha256:0"}}).encode()


@pytest.fixture
def state(tmp_path: Path) -> Path:
    for folder in ("metadata", "incomplete"):
        (tmp_path / folder).mkdir()
    (tmp_path / "metadata" / "sound").write_bytes(SOUND)
    return tmp_path


@pytest.mark.parametrize(
    "content", [b"", b"{", b"7", b"[]", b"null", SOUND[:20], SOUND.replace(b"surface", b"surf\xe1ce"), b'{"rule": [1]}']
)
def test_a_damaged_record_goes_and_is_told(state, content):
    (state / "metadata" / "damaged").write_bytes(content)
    assert snakemake_metadata.settle(state) == [
        f"{state / 'metadata' / 'damaged'}: damaged; removed, and Snakemake goes by the times of its files"
    ]
    assert [file.name for file in (state / "metadata").iterdir()] == ["sound"]
    assert (state / "metadata" / "sound").read_bytes() == SOUND


def test_what_is_marked_as_half_finished_stays_so(state):
    marks = {"whole": b'{"external_jobid": null}', "empty": b"", "damaged": b"\xff{"}
    for name, content in marks.items():
        (state / "incomplete" / name).write_bytes(content)
    assert snakemake_metadata.settle(state) == []
    assert {file.name: file.read_bytes() for file in (state / "incomplete").iterdir()} == {**marks, "damaged": b""}


def test_before_the_first_run_there_is_nothing_to_tell(tmp_path):
    assert snakemake_metadata.settle(tmp_path) == []
