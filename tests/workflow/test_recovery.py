"""What a start recovers, class by class: stale locks, damaged results and records, hidden changes, queued jobs."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
from base64 import urlsafe_b64encode
from pathlib import Path

import pytest

from roughslip.errors import InputError
from roughslip.stages.runtime import record
from roughslip.stages.runtime.usage import Usage
from workflow.keys import key_files
from workflow.recovery import earlier_runs, integrity, snakemake_metadata

ROOT = Path(__file__).resolve().parents[2]
OLD, NEW = 1.6e9, 1.7e9
KEY, A, B, TABLE = "keys/a.json", "a.nc", "b.nc", "b.csv"
RECORDS = ["usage/a.json", "usage/b.json", "usage/absent.json"]
UNREADABLE = "checksum mismatch: usage/a.json; removed, its job runs again"


def write(name: str, text: str, seconds: float) -> None:
    Path(name).parent.mkdir(exist_ok=True)
    Path(name).write_text(text)
    os.utime(name, (seconds, seconds))


def files() -> dict[str, tuple[str, float]]:
    found = [path for path in Path().rglob("*") if path.is_file()]
    return {path.as_posix(): (path.read_text(), path.stat().st_mtime) for path in found}


def repair() -> list[str]:
    return integrity.repair(integrity.jobs_of(RECORDS))


def rewrite_record(**changes: object) -> None:
    """Change the record of the first job and seal it again."""
    content = json.loads(Path("usage/a.json").read_text())
    del content[record.SEAL]
    Path("usage/a.json").write_text(json.dumps(record.sealed({**content, **changes})))


@pytest.fixture
def chain(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the working folder keys/a.json -> a.nc -> b.nc and b.csv, with the records of both jobs."""
    monkeypatch.chdir(tmp_path)
    for name in (KEY, A, B, TABLE):
        write(name, name, NEW)
    Path("usage").mkdir()
    for stage, read, made in (("a", [KEY], [A]), ("b", [A], [B, TABLE])):
        with Usage(f"usage/{stage}.json", stage) as usage:
            usage.files(map(Path, read), map(Path, made))


@pytest.fixture
def dry_run(chain):
    """The same in a dry run."""
    key_files.write_drafts()
    yield
    key_files._draft_folders.pop().cleanup()


@pytest.mark.parametrize("name", ["", A, TABLE, B])
def test_a_damaged_or_lost_result_takes_its_record_with_it(chain, name):
    """A damaged one is moved. Intact results are left alone."""
    before = files()
    if name == B:
        Path(B).unlink()
    elif name:
        write(name, "flipped", NEW)
    lines = [f"checksum mismatch: {name}; moved to {name}.damaged and rebuilt"] if name in (A, TABLE) else []
    assert repair() == lines
    gone = {name, f"usage/{name[0]}.json"} if name else set()
    assert {file: before[file] for file in before.keys() - gone} == {
        file: content for file, content in files().items() if file != f"{name}.damaged"
    }


@pytest.mark.parametrize("content", ["", "{", "[]", "null", '{"stage": "a"}', "\udcff"])
def test_a_damaged_record_is_removed(chain, content):
    Path("usage/a.json").write_bytes(content.encode("utf-8", "surrogateescape"))
    assert repair() == [UNREADABLE]
    assert not Path("usage/a.json").exists()


def test_each_value_of_a_record_is_covered_by_its_checksum(chain):
    content = json.loads(Path("usage/a.json").read_text())
    for name, value in content.items():
        changed = f"{value}0" if isinstance(value, str) else {"x": 1} if isinstance(value, dict) else 7.25
        Path("usage/a.json").write_text(json.dumps({**content, name: changed}))
        assert record.read(Path("usage/a.json")) is None, name


@pytest.mark.parametrize("made", ["{elsewhere}/secret", "link/secret", None, 7, [A]])
def test_a_record_of_files_elsewhere_or_of_none_is_damaged(chain, tmp_path_factory, made):
    """It may come from a copied scene or from another author: no file outside its own results is touched."""
    secret = tmp_path_factory.mktemp("home") / "secret"
    secret.write_text("mine")
    Path("link").symlink_to(secret.parent)
    rewrite_record(made={made.format(elsewhere=secret.parent): "0" * 64} if isinstance(made, str) else made)
    assert repair() == [UNREADABLE]
    assert [file.name for file in secret.parent.iterdir()] == ["secret"]


def test_a_changed_input_elsewhere_keeps_its_time(chain, tmp_path_factory):
    outside = tmp_path_factory.mktemp("home") / "scan.x3p"
    write(str(outside), "now", OLD)
    rewrite_record(read={str(outside): "0" * 64})
    assert repair() == []
    assert outside.stat().st_mtime == OLD


def test_times_of_keys_follow_their_contents(chain):
    """A change that times hide, as after the clock was set back, gets a new time; no result is removed.

    A key whose content has returned, as after a run of an edit that ended early, is no newer than its results.
    """
    write(KEY, KEY, NEW + 9)
    assert repair() == []
    assert Path(KEY).stat().st_mtime == NEW
    write(KEY, "other", NEW + 9)
    assert repair() == []
    assert Path(KEY).stat().st_mtime == NEW + 9
    write(KEY, "other", OLD)
    assert repair() == []
    assert Path(KEY).stat().st_mtime > NEW
    assert files().keys() >= {A, B, TABLE, "usage/a.json", "usage/b.json"}


def test_a_record_of_snakemake_that_hides_a_change_is_removed(chain):
    """After results are put back from a copy, Snakemake takes the present key for the one that they were made from."""
    of_the_copy = record.checksum(Path(KEY))
    write(KEY, "other", NEW)
    file = Path(".snakemake/metadata") / urlsafe_b64encode(A.encode()).decode()
    file.parent.mkdir(parents=True)
    for checksum, stays in ((record.checksum(Path(KEY)), False), (of_the_copy, True)):
        file.write_text(json.dumps({"rule": "a", "input_checksums": {KEY: f"sha256:{checksum}"}}))
        repair()
        assert file.exists() is stays


def test_results_from_the_future_are_corrected_and_hide_no_change(chain):
    """Snakemake fails a job whose input is newer than what the job has just made."""
    for name in (A, B):
        os.utime(name, (4e9, 4e9))
    write(KEY, "other", OLD)
    integrity.remove_leftovers(Path())
    repair()
    assert Path(A).stat().st_mtime < Path(KEY).stat().st_mtime <= time.time()
    assert Path(B).stat().st_mtime < time.time()
    assert Path(TABLE).stat().st_mtime == Path(A).stat().st_mtime


def test_only_old_temporary_files_are_removed(tmp_path):
    leftovers = (".a.123.nc", ".surface.json.77", f".friction.json.{'0a' * 16}")  # of results, records, keys
    for name in (*leftovers, ".keep", ".b.456.nc", "a.nc"):
        write(str(tmp_path / name), "x", time.time() if name == ".b.456.nc" else OLD)
    integrity.remove_leftovers(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [".b.456.nc", ".keep", "a.nc"]


@pytest.mark.parametrize(
    ("damage", "repeated"), [(lambda: write(A, "flipped", NEW), {"a", "b"}), (lambda: Path(B).unlink(), {"b"})]
)
def test_a_dry_run_plans_repairs_and_changes_nothing(dry_run, damage, repeated):
    key_files.write_if_changed(key_files.content_of(KEY), KEY)
    damage()
    before = files()
    lines = integrity.announce(integrity.jobs_of(RECORDS))
    assert lines in ([f"checksum mismatch: {A}; a run rebuilds it"], [])
    assert files() == before
    inputs = {stage: key_files.key_input(KEY, f"usage/{stage}.json") for stage in "ab"}
    assert {stage for stage, path in inputs.items() if path != KEY} == repeated


def test_a_dry_run_plans_an_edit_from_a_draft(dry_run):
    """After the edit is taken back, the key file itself is the input, even if an interrupted run wrote into it."""
    before = files()
    assert key_files.replace_if_changed(KEY, {"edited": 1}) == str(key_files.content_of(KEY))
    integrity.announce(integrity.jobs_of(RECORDS))
    assert key_files.key_input(KEY, "usage/a.json") == str(key_files.content_of(KEY))
    assert files() == before
    key_files.write_if_changed(key_files.content_of(KEY), KEY)
    write(KEY, "edited", NEW + 9)
    integrity.announce(integrity.jobs_of(RECORDS))
    assert key_files.key_input(KEY, "usage/a.json") == KEY


SOUND = json.dumps({"rule": "surface", "input": ["a"], "input_checksums": {"a": "sha256:0"}}).encode()
DAMAGED = (b"", b"{", b"7", b"[]", SOUND[:20], SOUND.replace(b"face", b"f\xe1ce"), b'{"input_checksums":1}')


def test_damaged_records_of_snakemake_are_removed(tmp_path):
    """What is marked as incomplete stays so."""
    marks = {"whole": b'{"external_jobid": null}', "empty": b"", "damaged": b"\xff{"}
    records = {"sound": SOUND} | {f"damaged {number}": content for number, content in enumerate(DAMAGED)}
    for folder, contents in (("metadata", records), ("incomplete", marks)):
        (tmp_path / folder).mkdir()
        for name, content in contents.items():
            (tmp_path / folder / name).write_bytes(content)
    lines = snakemake_metadata.remove_damaged(tmp_path)
    starts = [f"{tmp_path / 'metadata' / name}: damaged record of Snakemake; removed" for name in sorted(records)[:-1]]
    assert [line[: len(start)] for line, start in zip(lines, starts, strict=True)] == starts
    assert [file.name for file in (tmp_path / "metadata").iterdir()] == ["sound"]
    assert {file.name: file.read_bytes() for file in (tmp_path / "incomplete").iterdir()} == {**marks, "damaged": b""}


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Snakemake's folder with the lock of some run; what this process holds is released at the end."""
    held: list = []
    monkeypatch.setattr(earlier_runs, "_held", held)
    (tmp_path / ".snakemake" / "locks").mkdir(parents=True)
    (tmp_path / ".snakemake" / "locks" / "0.input.lock").write_text("results/a.nc\n")
    yield tmp_path / ".snakemake"
    for file in held:
        file.close()


@pytest.fixture
def other(state: Path):
    """Another process that holds the folder until it is killed."""
    imports = "from pathlib import Path; from workflow.recovery.earlier_runs import hold"
    code = f"{imports}; print(hold(Path({str(state)!r})))"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    command = [sys.executable, "-c", f"{code}\nimport sys; sys.stdout.flush(); sys.stdin.read()"]
    process = subprocess.Popen(command, cwd=ROOT, env={"PYTHONPATH": f"{ROOT / 'src'}:{ROOT}"}, **pipes)
    assert "is_alone=True" in process.stdout.readline()
    yield process
    process.kill()
    process.communicate()


def test_a_stale_lock_is_cleared(state):
    assert earlier_runs.hold(state) == (True, [f"{state / 'locks'}: stale lock of an interrupted run; removed"])
    assert list((state / "locks").iterdir()) == []
    (state.parent / "file").write_text("in the way")
    with pytest.raises(InputError, match=r"file: cannot be written to"):
        earlier_runs.hold(state.parent / "file")


def test_the_lock_of_a_run_lasts_until_its_process_ends(state, other):
    """However many others start meanwhile."""
    (state / "locks" / "0.input.lock").write_text("results/a.nc\n")
    for _ in range(2):
        line = f"{state.parent}: another run is at work in this folder; wait for its end, or stop it"
        assert earlier_runs.hold(state) == (False, [line])
    (state / "locks" / "0.input.lock").unlink()
    assert "another Snakemake reads this folder; results were not checked" in earlier_runs.hold(state).lines[0]
    (state / "locks" / "0.input.lock").write_text("results/a.nc\n")
    other.kill()
    other.wait()
    while earlier_runs._held:
        earlier_runs._held.pop().close()
    assert earlier_runs.hold(state).is_alone
    assert list((state / "locks").iterdir()) == []


def squeue(folder: Path, script: str) -> str:
    """A folder for PATH with a `squeue` that runs this script."""
    folder.mkdir()
    (folder / "squeue").write_text(f"#!/bin/sh\n{script}\n")
    (folder / "squeue").chmod(0o755)
    return str(folder)


@pytest.mark.parametrize(
    ("lines", "queued"),
    [
        (["12|rule_surface_wildcards_tiny|{here}", "13|rule_costs|{here}"], "12 13"),
        (["12|rule_surface|{here}/..", "13|rule_costs|{here}/../a | b", "14|(null)|{here}"], "13"),
        (["14|(null)|{here}", "15|rule_costs|/elsewhere", "slurm_load_jobs error: nothing"], ""),
    ],
)
def test_queued_jobs_of_an_earlier_run_are_refused(lines, queued, tmp_path, monkeypatch):
    """Not a job that Snakemake itself runs in, nor jobs of another folder."""
    here = tmp_path / "a | b"
    (here / ".snakemake").mkdir(parents=True)
    answer = "\n".join(lines).format(here=here)
    monkeypatch.setenv("PATH", squeue(tmp_path / "bin", f"/bin/cat <<'END'\n{answer}\nEND"))
    earlier_runs.refuse_queued_jobs(here / ".snakemake")  # no run in this folder has used Slurm
    earlier_runs.mark_slurm(here / ".snakemake")
    if queued:
        with pytest.raises(
            InputError, match=re.escape(f"{here}: jobs of an interrupted run") + f".*: scancel {queued}$"
        ):
            earlier_runs.refuse_queued_jobs(here / ".snakemake")
    else:
        earlier_runs.refuse_queued_jobs(here / ".snakemake")


def test_without_an_answer_of_slurm_no_jobs_are_known(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert earlier_runs.queued_jobs(tmp_path) == []
    monkeypatch.setenv("PATH", squeue(tmp_path / "fails", f"echo '12|rule_costs|{tmp_path}' >&2; exit 1"))
    assert earlier_runs.queued_jobs(tmp_path) == []
    monkeypatch.setattr(earlier_runs, "_SECONDS", 0.2)
    monkeypatch.setenv("PATH", squeue(tmp_path / "hangs", "exec /bin/sleep 5"))
    assert earlier_runs.queued_jobs(tmp_path) == []
