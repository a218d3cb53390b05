"""What numba compiled: a damaged file takes the rest of its function along, and nothing else."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

from workflow.faults.scratch import as_a_user
from workflow.recovery import numba_cache

ROOT = Path(__file__).resolve().parents[2]

OTHER = "slip-7.py311.nbi"
FILES = ("solve-12.py311.nbi", "solve-12.py311.1.nbc", "solve-12.py311.2.nbc", OTHER)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder as numba leaves it, already looked at."""
    (tmp_path / "contact").mkdir(parents=True)
    for name in FILES:
        (tmp_path / "contact" / name).write_bytes(pickle.dumps({"name": name, "pi": 3.14159}))
    assert numba_cache.settle(tmp_path) == []
    return tmp_path


def rewrite(file: Path, content: bytes, *, keep_time: bool) -> None:
    before = file.stat()
    file.write_bytes(content)
    moved = before.st_mtime_ns if keep_time else before.st_mtime_ns + 10**9
    os.utime(file, ns=(moved, moved))


def left(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.rglob("*.nb?"))


@pytest.mark.parametrize("name", FILES[:3])
def test_a_flipped_bit_takes_the_function_along(folder, name):
    file = folder / "contact" / name
    content = bytearray(file.read_bytes())
    content[-6] ^= 1
    rewrite(file, bytes(content), keep_time=True)
    assert numba_cache.settle(folder) == [f"{file}: damaged; removed, and compiled anew"]
    assert left(folder) == [OTHER]
    assert numba_cache.settle(folder) == []


@pytest.mark.parametrize("length", [0, 1, 20])
@pytest.mark.parametrize("keep_time", [False, True])
def test_a_file_cut_short_takes_the_function_along(folder, length, keep_time):
    file = folder / "contact" / FILES[1]
    rewrite(file, file.read_bytes()[:length], keep_time=keep_time)
    assert len(numba_cache.settle(folder)) == 1
    assert left(folder) == [OTHER]


def test_what_numba_writes_anew_is_left_alone(folder):
    """It adds to an index with every new signature, and to the folder with every function."""
    rewrite(folder / "contact" / FILES[0], pickle.dumps(["two", "signatures"]), keep_time=False)
    (folder / "contact" / "solve-12.py311.3.nbc").write_bytes(pickle.dumps(2))
    for _ in range(2):
        assert numba_cache.settle(folder) == []
    assert len(left(folder)) == len(FILES) + 1


@pytest.mark.parametrize("content", [b"", b"[]", b"\xff", b'{"contact/slip-7.py311.nbi": 3}'])
def test_a_damaged_list_is_made_anew(folder, content):
    (folder / "found.json").write_bytes(content)
    assert numba_cache.settle(folder) == []
    assert OTHER.encode() in (folder / "found.json").read_bytes()


def test_before_anything_is_compiled_there_is_nothing_to_tell(tmp_path):
    assert numba_cache.settle(tmp_path / "absent") == []
    assert not (tmp_path / "absent").exists()


def test_a_folder_closed_to_writing_is_read_all_the_same(folder):
    """Of a user's own; a damaged file in it is named."""
    (folder / "contact" / FILES[1]).write_bytes(b"")
    (folder / "found.json").unlink()
    for closed in (folder / "contact", folder):
        closed.chmod(0o555)
    ask = "from pathlib import Path; from workflow.recovery import numba_cache; "
    ask += f"numba_cache.settle(Path({str(folder)!r}))"
    asked = subprocess.run(
        [sys.executable, "-c", ask],
        env={"PYTHONPATH": f"{ROOT}:{ROOT / 'src'}", "NUMBA_CACHE_DIR": str(folder)},
        preexec_fn=as_a_user(),
        capture_output=True,
        text=True,
    )
    for closed in (folder, folder / "contact"):
        closed.chmod(0o755)
    assert asked.stderr.splitlines()[-1].startswith("roughslip.errors.InputError: ")
    assert "damaged, and cannot be removed (Permission denied)" in asked.stderr
