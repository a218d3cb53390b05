"""Every package of the lock has its licence listed, and none binds users unawares."""

from pathlib import Path

import pytest

from workflow.study.licences import COPYLEFT, is_copyleft, licence, locked

ROOT = Path(__file__).resolve().parents[1]
NAMES = locked(ROOT / "requirements.lock")
PAGE = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8")
ROWS = [line.strip("|").split(" | ") for line in PAGE.splitlines() if line.startswith("| ")][1:]
LISTED = {name.strip(): text.strip() for text, names in ROWS for name in names.split(", ")}


def test_the_page_lists_the_lock():
    assert sorted(LISTED) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_licence_is_known_and_what_it_asks_is_told(name):
    """Of a package for another system the page must do, which was made where it is installed or read by hand."""
    found = licence(name) or LISTED[name]
    assert found != "not stated"
    assert is_copyleft(found) == (name in COPYLEFT), found


def test_the_page_tells_what_copyleft_means_here():
    for name in COPYLEFT:
        assert f"- **{name}** (" in PAGE
