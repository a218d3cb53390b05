"""A working folder with the shipped scenes, and a scene that a test writes into it."""

from pathlib import Path

import pytest

from roughslip.scene.loader import load
from tests.scene.shipped import CONFIG, SCENES


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A working folder with the shipped scenes in `scenes/`; a test adds its own."""
    root = tmp_path_factory.mktemp("work")
    (root / "scenes").mkdir()
    for name in SCENES:
        (root / "scenes" / f"{name}.yaml").write_bytes((CONFIG / "scenes" / f"{name}.yaml").read_bytes())
    return root


@pytest.fixture
def mine(folder: Path, monkeypatch: pytest.MonkeyPatch):
    """Load `mine`, a scene of the given text, with further files next to it; all are removed after the test."""
    monkeypatch.chdir(folder)
    written = set()

    def load_mine(content: str | bytes, **others: str) -> dict:
        for name, text in {"mine": content, **others}.items():
            path = folder / "scenes" / f"{name}.yaml"
            path.write_bytes(text if isinstance(text, bytes) else text.encode())
            written.add(path)
        return load("mine", folder / "scenes")

    yield load_mine
    for path in written:
        path.unlink()
