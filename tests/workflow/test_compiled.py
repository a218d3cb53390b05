"""What numba compiled: a damaged file takes its folder along, and nothing else does."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import pytest

from workflow.lib import compiled


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder as numba leaves it, already looked at."""
    found = tmp_path / "roughslip-0123"
    (found / "contact").mkdir(parents=True)
    for name in ("solve.nbi", "solve.1.nbc"):
        (found / "contact" / name).write_bytes(pickle.dumps({"name": name, "pi": 3.14159}))
    assert compiled.settle(found) == []
    return found


def rewrite(file: Path, content: bytes, *, keep_time: bool) -> None:
    before = file.stat()
    file.write_bytes(content)
    moved = before.st_mtime_ns if keep_time else before.st_mtime_ns + 10**9
    os.utime(file, ns=(moved, moved))


@pytest.mark.parametrize("name", ["solve.nbi", "solve.1.nbc"])
def test_a_flipped_bit_takes_the_folder_along(folder, name):
    file = folder / "contact" / name
    content = bytearray(file.read_bytes())
    content[-6] ^= 1
    rewrite(file, bytes(content), keep_time=True)
    assert compiled.settle(folder) == [f"{file}: damaged; what numba compiled is removed, and compiled anew"]
    assert not folder.exists()
    assert compiled.settle(folder) == []


@pytest.mark.parametrize("length", [0, 1, 20])
@pytest.mark.parametrize("keep_time", [False, True])
def test_a_file_cut_short_takes_the_folder_along(folder, length, keep_time):
    file = folder / "contact" / "solve.1.nbc"
    rewrite(file, file.read_bytes()[:length], keep_time=keep_time)
    assert len(compiled.settle(folder)) == 1
    assert not folder.exists()


def test_what_numba_writes_anew_is_left_alone(folder):
    """It adds to an index with every new signature, and to the folder with every function."""
    rewrite(folder / "contact" / "solve.nbi", pickle.dumps(["two", "signatures"]), keep_time=False)
    (folder / "contact" / "solve.2.nbc").write_bytes(pickle.dumps(2))
    for _ in range(2):
        assert compiled.settle(folder) == []
    assert len(list(folder.rglob("*.nb?"))) == 3


@pytest.mark.parametrize("content", [b"", b"[]", b"\xff", b'{"contact/solve.nbi": 3}'])
def test_a_damaged_list_is_made_anew(folder, content):
    (folder / "found.json").write_bytes(content)
    assert compiled.settle(folder) == []
    assert b"solve.1.nbc" in (folder / "found.json").read_bytes()


def test_a_folder_that_a_user_chose_is_left_alone(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "other.nbc").write_bytes(b"")
    assert compiled.settle(tmp_path / "mine") == []
    assert (tmp_path / "mine" / "other.nbc").exists()
