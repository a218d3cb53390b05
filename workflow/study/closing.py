"""What the terminal shows at the end of a run: for each scene that it made, a few lines from its results."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from workflow.study.publish import LISTED

MOST_WARNINGS = 5  # of a scene; the others are on its page


def print_closing(workflow: Any, jobs: Iterable[Any]) -> None:
    """Print the lines of the results of these jobs; without jobs, of all targets where a run had nothing to do."""
    if not workflow.is_main_process or workflow.dag is None:
        return
    if not jobs and not len(workflow.dag):
        jobs = workflow.dag.jobs
    lines = closing_lines(file for job in jobs for file in job.output)
    print("".join(f"{line}\n" for line in lines), end="", file=sys.stderr)


def closing_lines(results: Iterable[str]) -> list[str]:
    """Lines for each scene that a run published, by their names; then the pages."""
    files = [Path(file) for file in results]
    folders = sorted({file.parent for file in files if file.match(f"results/*/{LISTED}")})
    lines = [f"{folder.name}: {text}" for folder in folders for text in (*_answer(folder), *_warnings(folder))]
    pages = [*(folder / "report.html" for folder in folders), *(file for file in files if file.name == "report.html")]
    return [*lines, *(f"page: {file}" for file in sorted(pages) if "store" not in file.parts)]


def _answer(folder: Path) -> list[str]:
    """The three lines of the answer on stick-slip; none where the scene has none."""
    stages = {row["stage"] for row in json.loads((folder / "costs.json").read_text(encoding="utf-8"))}
    if "answer" not in stages:  # the folder may hold that of older targets
        return []
    lines: list[str] = json.loads((folder / "answer.json").read_text(encoding="utf-8"))["summary"]
    return lines


def _warnings(folder: Path) -> list[str]:
    """The first warnings of a scene, and the number of those that only the page shows."""
    warnings = json.loads((folder / "costs.json").read_text(encoding="utf-8"))[-1]["warnings"]
    lines = [f"warning: {text}" for text in warnings[:MOST_WARNINGS]]
    left = len(warnings) - len(lines)
    return [*lines, f"and {left} more warnings in {folder / 'report.html'}"] if left else lines
