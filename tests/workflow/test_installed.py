"""Packages beside those of the lock file: told, and their results kept apart."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

import pytest

from roughslip.errors import InputError
from workflow.keys.closure import code_hash
from workflow.keys.environment_check import departures, told

ROOT = Path(__file__).resolve().parents[2]
NUMPY, YAML = version("numpy"), version("PyYAML")
HASH = " \\\n    --hash=sha256:0\n    # via nothing==1\n"


def test_nothing_is_told_of_what_the_lock_pins():
    lock = f"# made by hand==1\nnumpy=={NUMPY}{HASH}pyyaml=={YAML}{HASH}"
    assert departures(lock) == ()
    assert told(lock) == []


def test_other_versions_and_missing_packages_are_told():
    lock = f"numpy==1.0.0{HASH}PyYAML=={YAML}{HASH}no-such-package==3.1{HASH}"
    numpy, absent = f"numpy {NUMPY} in place of 1.0.0", "no-such-package missing in place of 3.1"
    assert departures(lock) == (numpy, absent)
    (line,) = told(lock)
    assert line.startswith(f"requirements.lock: installed are {numpy}, {absent}; ")
    (line,) = told(lock + "".join(f"absent-{k}==1{HASH}" for k in range(5)))
    assert " and 4 more; " in line


def test_pins_for_other_machines_do_not_count():
    lock = f"colorama==9.9 ; sys_platform == 'win32' or python_version < '3.0'{HASH}"
    assert departures(lock) == ()


def test_a_line_that_pins_nothing_is_named():
    with pytest.raises(InputError, match=r"requirements.lock: 'num py==1' pins no package"):
        departures("num py==1\n")


def test_they_are_part_of_the_code_and_only_they(tmp_path):
    """The lock of a project is the same; what is installed is not."""
    lock = tmp_path / "requirements.lock"
    hashes = []
    for text in (f"numpy=={NUMPY}\n", f"# same\nnumpy=={NUMPY}\n", "numpy==1.0.0\n"):
        lock.write_text(text)
        hashes.append(code_hash("roughslip.grid", ROOT / "src", lock))
    assert hashes[0] == hashes[1] != hashes[2]


def test_departures_change_the_hash_of_one_and_the_same_lock(tmp_path, monkeypatch):
    lock = tmp_path / "requirements.lock"
    lock.write_text(f"numpy=={NUMPY}\n")
    pinned = code_hash("roughslip.grid", ROOT / "src", lock)
    monkeypatch.setattr("workflow.keys.closure.departures", lambda text: ("numpy 0.1 in place of 2",))
    assert code_hash("roughslip.grid", ROOT / "src", lock) != pinned
