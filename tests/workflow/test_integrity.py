"""Results against the records of their jobs: damage is set aside, a change is touched, and all else is left alone."""

from __future__ import annotations

import json
import os
import time
from base64 import urlsafe_b64encode
from pathlib import Path

import pytest

from roughslip.stages.runtime import record
from roughslip.stages.runtime.usage import Usage
from workflow.recovery import integrity

OLD, NEW = 1.6e9, 1.7e9


@pytest.fixture
def chain(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """key -> a.nc -> b.nc and b.csv, each job with its record; the records' paths."""
    monkeypatch.chdir(tmp_path)
    for name, text in {"key.json": "key", "a.nc": "first", "b.nc": "second", "b.csv": "third"}.items():
        Path(name).write_text(text)
        os.utime(name, (NEW, NEW))
    for stage, read, made in (("a", ["key.json"], ["a.nc"]), ("b", ["a.nc"], ["b.nc", "b.csv"])):
        with Usage(f"{stage}.json", stage) as usage:
            usage.files(map(Path, read), map(Path, made))
    return ["a.json", "b.json", "absent.json"]


def names() -> set[str]:
    return {path.name for path in Path().iterdir()}


def test_what_is_as_it_was_is_left_alone(chain):
    before = {name: (Path(name).read_bytes(), Path(name).stat().st_mtime_ns) for name in names()}
    assert integrity.settle(chain) == []
    assert {name: (Path(name).read_bytes(), Path(name).stat().st_mtime_ns) for name in names()} == before


@pytest.mark.parametrize("name", ["a.nc", "b.csv"])
def test_a_damaged_result_is_set_aside_and_its_job_runs_again(chain, name):
    """Though its time does not tell."""
    Path(name).write_text("flipped")
    os.utime(name, (NEW, NEW))
    assert integrity.settle(chain) == [f"{name}: not what its job wrote; set aside as {name}.damaged, and made again"]
    assert Path(f"{name}.damaged").read_text() == "flipped"
    assert {"key.json", "a.nc", "b.nc", "b.csv", "a.json", "b.json"} - names() == {name, f"{name[0]}.json"}


def test_a_lost_result_takes_its_record_along(chain):
    Path("b.nc").unlink()
    assert integrity.settle(chain) == []
    assert "b.json" not in names()
    assert {"a.json", "b.csv"} <= names()


@pytest.mark.parametrize("content", ["", "{", "[]", "null", '{"stage": "a"}', "\udcff"])
def test_a_damaged_record_goes(chain, content):
    Path("a.json").write_bytes(content.encode("utf-8", "surrogateescape"))
    assert integrity.settle(chain) == ["a.json: damaged; its job runs again"]
    assert "a.json" not in names()


def test_every_number_of_a_record_is_under_its_seal(chain):
    text = Path("a.json").read_text()
    assert record.read(Path("a.json")) is not None
    content = json.loads(text)
    for name, value in content.items():
        changed = f"{value}0" if isinstance(value, str) else {"x": 1} if isinstance(value, dict) else 7.25
        Path("a.json").write_text(json.dumps({**content, name: changed}))
        assert record.read(Path("a.json")) is None, name


def test_a_change_that_times_hide_is_touched_and_nothing_is_lost(chain):
    """As where the clock was set back: the key is of another scene, but older than what was made from the first."""
    Path("key.json").write_text("other")
    os.utime("key.json", (OLD, OLD))
    assert integrity.settle(chain) == []
    assert Path("key.json").stat().st_mtime > Path("a.nc").stat().st_mtime
    assert Path("a.nc").read_text() == "first"
    assert {"a.json", "b.json"} <= names()


def test_a_change_that_times_tell_is_left_to_snakemake(chain):
    Path("key.json").write_text("other")
    os.utime("key.json", (NEW + 5, NEW + 5))
    integrity.settle(chain)
    assert Path("key.json").stat().st_mtime == NEW + 5


@pytest.mark.parametrize("part", ["made", "read"])
@pytest.mark.parametrize("content", [None, 7, ["a.nc"]])
def test_a_record_with_a_seal_but_without_files_is_none(chain, part, content):
    text = json.loads(Path("a.json").read_text())
    text.pop(record.SEAL)
    Path("a.json").write_text(json.dumps(record.sealed({**text, part: content})))
    assert integrity.settle(chain) == ["a.json: damaged; its job runs again"]


@pytest.mark.parametrize("link", [False, True])
def test_a_record_that_tells_of_files_elsewhere_is_none(chain, tmp_path_factory, link):
    """A stranger's, sealed as any, or that of a copied scene: nothing outside its own results is touched."""
    secret = tmp_path_factory.mktemp("home") / "secret"
    secret.write_text("mine")
    made = secret
    if link:
        Path("leads").symlink_to(secret.parent)
        made = Path("leads/secret")
    text = json.loads(Path("a.json").read_text())
    text.pop(record.SEAL)
    Path("usage").mkdir()
    Path("usage/a.json").write_text(json.dumps(record.sealed({**text, "made": {str(made): "0" * 64}})))
    assert integrity.settle(["usage/a.json"]) == ["usage/a.json: damaged; its job runs again"]
    assert [file.name for file in secret.parent.iterdir()] == ["secret"]


def test_what_a_record_reads_elsewhere_keeps_its_time(chain, tmp_path_factory):
    outside = tmp_path_factory.mktemp("home") / "scan.x3p"
    outside.write_text("now")
    os.utime(outside, (OLD, OLD))
    text = json.loads(Path("a.json").read_text())
    text.pop(record.SEAL)
    Path("a.json").write_text(json.dumps(record.sealed({**text, "read": {str(outside): "0" * 64}})))
    assert integrity.settle(chain) == []
    assert outside.stat().st_mtime == OLD


def snakemake_says(output: str, **read: str) -> Path:
    """Snakemake's record of an output, with the checksums of what it was made from."""
    file = Path(".snakemake/metadata") / urlsafe_b64encode(output.encode()).decode()
    file.parent.mkdir(parents=True, exist_ok=True)
    checksums = {f"{name}.json": f"sha256:{value}" for name, value in read.items()}
    file.write_text(json.dumps({"rule": "a", "input_checksums": checksums}))
    return file


def test_records_of_another_run_than_that_of_the_result_are_forgotten(chain):
    """Results put back from a copy: Snakemake holds the key of now for the one that they were made from."""
    of_the_copy = record.checksum(Path("key.json"))
    Path("key.json").write_text("other")
    file = snakemake_says("a.nc", key=record.checksum(Path("key.json")))
    integrity.settle(chain)
    assert not file.exists()
    assert Path("key.json").stat().st_mtime > Path("a.nc").stat().st_mtime
    file = snakemake_says("a.nc", key=of_the_copy)
    integrity.settle(chain)
    assert file.exists()  # it will see the change by itself, and none where the edit is taken back


def test_results_from_the_future_come_back_and_hide_no_change(chain):
    """Snakemake fails a job whose input is newer than what it has just made."""
    for name in ("a.nc", "b.nc"):
        os.utime(name, (4e9, 4e9))
    Path("key.json").write_text("other")
    os.utime("key.json", (OLD, OLD))
    integrity.tidy(Path())
    integrity.settle(chain)
    assert Path("a.nc").stat().st_mtime < Path("key.json").stat().st_mtime <= time.time()
    assert Path("b.nc").stat().st_mtime < time.time()
    assert Path("b.csv").stat().st_mtime == NEW


def test_only_old_temporary_files_are_removed(tmp_path):
    left = (".a.123.nc", ".surface.json.77", f".friction.json.{'0a' * 16}")  # by jobs, by records, by keys
    for name in (*left, ".keep", ".b.456.nc", "a.nc"):
        (tmp_path / name).write_text("x")
        if name != ".b.456.nc":
            os.utime(tmp_path / name, (OLD, OLD))
    integrity.tidy(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [".b.456.nc", ".keep", "a.nc"]
