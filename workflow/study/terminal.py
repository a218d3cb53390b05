"""What the terminal shows of a run: lines of progress, of a failure the stage's own error, at its end a few lines.

The file below .snakemake/log keeps all that Snakemake says. The last lines are from the results of the scenes.
"""

import json
import logging
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from snakemake.logging import DefaultFormatter, LogEvent, logger

from workflow.study.publish import LISTED

# What Snakemake says of a failure in addition to the error of the job
_ECHOES = (
    "RuleException:\nCalledProcessError",
    "Shutting down,",
    "Exiting because a job",
    "WorkflowError:\nAt least one",
)
_KEPT = ("Nothing to be done", "Complete log")  # of what Snakemake says by the way
_LINES = 20  # of progress
_INTERRUPTED = ("Terminating processes on user request", "died with <Signals.SIGINT")


class OwnErrors(DefaultFormatter):
    """Snakemake's lines, with the error that a stage states in its log in place of a failed job's block.

    A job that ends without a stated error, killed or by a fault of the code, keeps its block and its log.
    """

    is_interrupted = False
    scene_of: Callable[[str], str]
    shows_progress = False
    _lines = 0  # of progress that were shown

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a record says anything new: after Ctrl-C no job's error does, and progress has a line of its own."""
        text = record.getMessage()
        self.is_interrupted |= any(word in text for word in _INTERRUPTED)
        if self.shows_progress and record.levelno <= logging.INFO and not text.startswith((*_KEPT, *_INTERRUPTED)):
            return getattr(record, "event", None) == LogEvent.PROGRESS and self._is_due(record)
        return not text.startswith(_ECHOES) and not (self.is_interrupted and text.startswith("Error in "))

    def _is_due(self, record: Any) -> bool:
        """Whether a twentieth of the steps was done since the last line of progress."""
        before, self._lines = self._lines, record.done * _LINES // record.total
        return self._lines > before

    def format_job_error(self, msg: dict[str, Any]) -> str:
        """The stated error behind the name of its scene."""
        stated = stated_error(msg["log"])
        folder = Path(*msg["log"][:1]).parent.parent
        name = self.scene_of(folder.as_posix()) if "store" in folder.parts else folder.name
        return f"{name}: {stated} [{msg['log'][0]}]" if stated else super().format_job_error(msg)


def stated_error(logs: list[str]) -> str:
    """The error that `roughslip.study.command` wrote at the end of a job's log; "" where it wrote none."""
    text = "".join(Path(file).read_text(encoding="utf-8", errors="replace") for file in logs if Path(file).is_file())
    stated = re.search(r"^(\w+): error: (.*)\Z", text, re.MULTILINE | re.DOTALL)
    return f"{stated[1]}: {stated[2].strip()}" if stated else ""


def show_own_errors(scene_of: Callable[[str], str], shows_progress: bool) -> None:
    """Let Snakemake's handler show a line an error. scene_of : of a folder of the store"""
    for handler in logger.handlers:
        shown = handler.formatter
        if handler.name == "DefaultStreamHandler" and isinstance(shown, DefaultFormatter):
            own = OwnErrors(shown.quiet, shown.show_failed_logs)
            own.scene_of = scene_of
            own.shows_progress = shows_progress
            handler.setFormatter(own)
            handler.addFilter(own.filter)


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
    lines = [f"{folder.name}: {text}" for folder in folders for text in _of_scene(folder)]
    pages = [*(folder / "report.html" for folder in folders), *(file for file in files if file.name == "report.html")]
    return [*lines, *(f"page: {file}" for file in sorted(pages) if "store" not in file.parts)]


def _of_scene(folder: Path) -> list[str]:
    """The answer on stick-slip where the scene has one, its first warnings, and how many more are on its page."""
    costs = json.loads((folder / "costs.json").read_text(encoding="utf-8"))
    has_answer = any(row["stage"] == "answer" for row in costs)  # the folder may hold that of older targets
    lines = json.loads((folder / "answer.json").read_text(encoding="utf-8"))["summary"] if has_answer else []
    warnings, page = costs[-1]["warnings"], folder / "report.html"
    lines += [f"warning: {text}" for text in warnings[:MOST_WARNINGS]]
    left = len(warnings) - MOST_WARNINGS
    return [*lines, f"and {left} more warnings in {page}"] if left > 0 else lines
