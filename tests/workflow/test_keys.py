"""Key files: content, stable time stamps, whole files only."""

import json
import os
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib.metadata import version
from pathlib import Path
from unittest.mock import Mock

import pytest

from roughslip.errors import InputError
from workflow.keys.code_hash import code_hash, departures, report
from workflow.keys.key_files import write_key

CONFIGURATION = {"seed": 7, "mesh": {"nx": 10, "edge_m": 2.5e-05}, "levels": [5, 50]}


@pytest.fixture
def source(tmp_path: Path) -> Path:
    (tmp_path / "stage.py").write_text("x = 1\n")
    (tmp_path / "lock").write_text("numpy==2.0\n")
    return tmp_path


@pytest.fixture
def key(source: Path) -> Path:
    return source / "results" / "mine" / "keys" / "stage.json"


@pytest.fixture
def write(source: Path, key: Path):
    return partial(write_key, key, module="stage", source_root=source, lock=source / "lock")


def identity(path: Path) -> tuple[int, int]:
    """Changes whenever a file is replaced or written into."""
    return path.stat().st_ino, path.stat().st_mtime_ns


def test_a_key_holds_configuration_and_code_and_keeps_its_time(write, key, source):
    write(CONFIGURATION)
    stored = json.loads(key.read_text())
    assert stored == {"configuration": CONFIGURATION, "code": code_hash("stage", source, source / "lock")}
    os.utime(key, (1.0, 1.0))
    before = identity(key)
    write(dict(reversed(CONFIGURATION.items())))
    assert identity(key) == before


@pytest.mark.parametrize(("name", "old", "new"), [("stage.py", "1", "2"), ("lock", "2.0", "2.1")])
def test_code_and_lock_change_the_key(write, key, source, name, old, new):
    write(CONFIGURATION)
    before = key.read_text()
    (source / name).write_text((source / name).read_text() + "# comment\n")
    write(CONFIGURATION)
    assert key.read_text() == before
    (source / name).write_text((source / name).read_text().replace(old, new))
    write(CONFIGURATION)
    assert key.read_text() != before


def test_order_of_a_list_and_equal_values_under_other_names_count(write, key):
    seen = set()
    for configuration in ({"a": [1, 2], "b": 3}, {"a": [2, 1], "b": 3}, {"b": [1, 2], "a": 3}, {"a": [1, 2.0], "b": 3}):
        write(configuration)
        seen.add(key.read_text())
    assert len(seen) == 4


@pytest.mark.parametrize("value", [float("nan"), float("inf"), {1}, "full disk"])
def test_a_write_that_fails_leaves_the_old_key_and_no_other_file(write, key, monkeypatch, value):
    """Of a value that JSON cannot hold, or on a full disk. A truncated key is written again."""
    write(CONFIGURATION)
    whole = key.read_text()
    key.write_text(whole[:20])
    write(CONFIGURATION)
    assert key.read_text() == whole
    before = identity(key)
    if value == "full disk":
        monkeypatch.setattr("roughslip.atomic_write.os.replace", Mock(side_effect=OSError("no space left on device")))
    with pytest.raises((ValueError, TypeError, OSError)):
        write({"x": value})
    assert identity(key) == before
    assert [path.name for path in key.parent.iterdir()] == [key.name]


def test_writers_at_once_leave_one_whole_file(write, key):
    """Two workflows in one folder: any reader sees one of the configurations, whole, and nothing else is left over."""
    configurations = [{"n": n, "pad": "x" * 20000} for n in range(2)]
    write(configurations[0])
    with ThreadPoolExecutor(4) as pool:
        writers = [pool.submit(write, configurations[i % 2]) for i in range(200)]
        while not all(job.done() for job in writers):
            assert json.loads(key.read_text())["configuration"] in configurations
        for job in writers:
            job.result()
    assert [path.name for path in key.parent.iterdir()] == [key.name]


NUMPY, HASH = version("numpy"), " \\\n    --hash=sha256:0\n    # via nothing==1\n"


@pytest.mark.parametrize(
    ("lock", "found"),
    [
        (f"# made by hand==1\nnumpy=={NUMPY}{HASH}", ()),
        (f"numpy==1.0.0{HASH}", (f"numpy {NUMPY} in place of 1.0.0",)),
        (f"no-such-package==3.1{HASH}", ("no-such-package missing in place of 3.1",)),
        (f"colorama==9.9 ; sys_platform == 'win32' or python_version < '3.0'{HASH}", ()),
    ],
)
def test_packages_that_differ_from_the_lock_are_reported(lock, found):
    assert departures(lock) == found
    assert [line.startswith(f"requirements.lock: installed are {', '.join(found)}; ") for line in report(lock)] == [
        True
    ] * len(found)


def test_a_line_of_the_lock_that_pins_nothing_is_named():
    with pytest.raises(InputError, match=r"requirements.lock: 'num py==1' pins no package"):
        departures("num py==1\n")


def test_other_packages_change_the_hash_under_the_same_lock(source, monkeypatch):
    pinned = code_hash("stage", source, source / "lock")
    monkeypatch.setattr("workflow.keys.code_hash.departures", lambda text: ("numpy 0.1 in place of 2",))
    assert code_hash("stage", source, source / "lock") != pinned
