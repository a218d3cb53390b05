"""A scene that a test writes, in a working folder of its own."""

from pathlib import Path

import pytest

from roughslip.scene.loader import load


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Load `mine`, a scene of the given text, with further files next to it; it may extend shipped scenes."""
    monkeypatch.chdir(tmp_path)

    def load_mine(content: str | bytes, **others: str) -> dict:
        for name, text in {"mine": content, **others}.items():
            path = tmp_path / "scenes" / f"{name}.yaml"
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return load("mine", tmp_path / "scenes")

    return load_mine
