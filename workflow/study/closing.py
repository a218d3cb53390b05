"""What the terminal shows at the end of a run: for each scene that it made, a few lines from its results."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

MOST_WARNINGS = 5  # of a scene; the others are on its page


def closing_lines(results: Iterable[str]) -> list[str]:
    """Lines for each scene whose sum of costs is among the results of a run, by their names; then the pages."""
    files = [Path(file) for file in results]
    folders = sorted({file.parent for file in files if file.match("results/*/costs.json")})
    lines = [f"{folder.name}: {text}" for folder in folders for text in (*_answer(folder), *_warnings(folder))]
    return [*lines, *(f"page: {file}" for file in sorted(files) if file.name == "report.html")]


def _answer(folder: Path) -> list[str]:
    """The three lines of the answer on stick-slip; none where the scene has none."""
    stages = {row["stage"] for row in json.loads((folder / "costs.json").read_text(encoding="utf-8"))}
    if "answer" not in stages:  # the folder may hold that of older targets
        return []
    lines: list[str] = json.loads((folder / "answer.json").read_text(encoding="utf-8"))["summary"]
    return lines


def _warnings(folder: Path) -> list[str]:
    """The first warnings of a scene, and the number of those that only the page shows."""
    found = json.loads((folder / "costs.json").read_text(encoding="utf-8"))[-1]["warnings"]
    lines = [f"warning: {text}" for text in found[:MOST_WARNINGS]]
    left = len(found) - len(lines)
    return [*lines, f"and {left} more warnings in {folder / 'report.html'}"] if left else lines
