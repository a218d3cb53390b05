"""Whose lock is dead: that of a run whose lock of the kernel is free."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from roughslip.errors import InputError
from workflow.recovery import run_lock

ROOT = Path(__file__).resolve().parents[2]
HOLD = (
    "import sys; from pathlib import Path; from workflow.recovery import run_lock\n"
    "start = run_lock.hold(Path(sys.argv[1])); print(start.alone, *start.lines, sep='|', flush=True); sys.stdin.read()"
)


class Other:
    """Another process that holds the folder until it is killed."""

    def __init__(self, state: Path) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", HOLD, str(state)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
            env={"PYTHONPATH": f"{ROOT / 'src'}:{ROOT}"},
        )
        self.said = self.process.stdout.readline().strip().split("|")

    def kill(self) -> None:
        self.process.kill()
        self.process.communicate()


@pytest.fixture
def held(monkeypatch: pytest.MonkeyPatch):
    """What this process holds, let go at the end."""
    files: list = []
    monkeypatch.setattr(run_lock, "_held", files)
    yield files
    for file in files:
        file.close()


@pytest.fixture
def state(tmp_path: Path, held: list) -> Path:
    """Snakemake's folder with the lock of some run in it."""
    (tmp_path / ".snakemake" / "locks").mkdir(parents=True)
    (tmp_path / ".snakemake" / "locks" / "0.input.lock").write_text("results/a.nc\n")
    return tmp_path / ".snakemake"


def locks(state: Path) -> list[str]:
    return [path.name for path in (state / "locks").iterdir()]


def test_a_lock_without_an_owner_is_cleared_and_told(state):
    found = run_lock.hold(state)
    assert found.alone
    assert found.lines == [f"{state / 'locks'}: left by a run that was killed, as nothing is at work here; cleared"]
    assert locks(state) == []


def test_a_living_run_keeps_its_lock_and_a_killed_one_does_not(state, held):
    """However many starts look at it meanwhile."""
    other = Other(state)
    try:
        assert other.said[0] == "True"
        (state / "locks" / "0.input.lock").write_text("results/a.nc\n")
        for _ in range(2):
            found = run_lock.hold(state)
            assert not found.alone
            assert found.lines == [f"{state.parent}: another run is at work here; wait for it, or stop it"]
            assert locks(state) == ["0.input.lock"]
    finally:
        other.kill()
    for file in held:
        file.close()
    assert run_lock.hold(state).alone
    assert locks(state) == []


def test_one_that_only_looks_on_is_told(state):
    """It holds no lock of Snakemake's, as a dry run: nothing is checked beside it, and nobody should think it was."""
    other = Other(state)
    (state / "locks" / "0.input.lock").unlink(missing_ok=True)
    try:
        assert run_lock.hold(state) == run_lock.Start(
            alone=False, lines=[f"{state.parent}: another snakemake looks at this folder; results were not checked"]
        )
    finally:
        other.kill()


def test_a_file_in_place_of_the_locks_goes(state):
    (state / "locks" / "0.input.lock").unlink()
    (state / "locks").rmdir()
    (state / "locks").write_text("")
    assert run_lock.hold(state).alone
    assert not (state / "locks").exists()


def test_without_a_lock_nothing_is_told(state):
    (state / "locks" / "0.input.lock").unlink()
    assert run_lock.hold(state) == run_lock.Start(alone=True, lines=[])


def test_a_folder_that_cannot_be_written_to_is_named(tmp_path):
    (tmp_path / ".snakemake").write_text("in the way")
    with pytest.raises(InputError, match=r"\.snakemake: cannot be written to"):
        run_lock.hold(tmp_path / ".snakemake")
