"""What the terminal shows of a run: lines of progress, of a failure the stage's own error, at its end a few lines.

The file below .snakemake/log keeps all that Snakemake says. The last lines are from the results of the scenes.
"""

from __future__ import annotations

import json
import logging
import re
import sys
import time
from collections import Counter
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
_FINISHED = re.compile(r"Finished jobid: \d+ \(Rule: (\w+)\)")
_OTHERS_S = 0.5  # of a job that only copies files
_LINES = 20  # of progress
SURE = 0.2  # of the work: from then on an estimate of the time to go is within a factor of two
_INTERRUPTED = ("Terminating processes on user request", "died with <Signals.SIGINT")


class OwnErrors(DefaultFormatter):
    """Snakemake's lines, with the error that a stage states in its log in place of a failed job's block.

    A job that ends without a stated error, killed or by a fault of the code, keeps its block and its log.
    """

    is_interrupted = False
    scene_of: Callable[[str], str]
    progress: Progress | None = None

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a record says anything new: after Ctrl-C no job's error does, and progress has a line of its own."""
        text = record.getMessage()
        self.is_interrupted |= any(word in text for word in _INTERRUPTED)
        if self.progress and record.levelno <= logging.INFO and not text.startswith((*_KEPT, *_INTERRUPTED)):
            return self.progress.takes(record, text)
        return not text.startswith(_ECHOES) and not (self.is_interrupted and text.startswith("Error in "))

    def format(self, record: logging.LogRecord) -> str:
        """A line of progress in place of Snakemake's."""
        is_progress = self.progress is not None and getattr(record, "event", None) == LogEvent.PROGRESS
        return self.progress.line() if is_progress else super().format(record)

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


class Progress:
    """Lines of progress: jobs done, and the time to go of scenes whose kept runs say what a job of a stage costs.

    seconds : returns that by stage, or nothing where other scenes are asked for, whose stages may cost far more
    """

    def __init__(self, seconds: Callable[[], dict[str, float]]) -> None:
        self._costs, self._seconds, self._began, self._lines = seconds, {}, time.monotonic(), 0
        self._total, self._done = Counter[str](), Counter[str]()

    def takes(self, record: logging.LogRecord, text: str) -> bool:
        """Count a record of Snakemake; whether it asks for a line of progress."""
        event = getattr(record, "event", None)
        if event == LogEvent.RUN_INFO:
            self._began, self._total = time.monotonic(), Counter(record.stats)  # type: ignore[attr-defined]
            self._seconds = self._costs()
            del self._total["total"]
        if (finished := _FINISHED.match(text)) is not None:
            self._done[finished[1]] += 1
        if event != LogEvent.PROGRESS:
            return False
        lines = int(self._work(self._done) / max(self._work(self._total), 1e-9) * _LINES)
        is_due, self._lines = lines > self._lines or self._done == self._total, lines
        return is_due

    def _work(self, jobs: Counter[str]) -> float:
        return sum(count * self._seconds.get(stage, _OTHERS_S) for stage, count in jobs.items())

    def line(self) -> str:
        """`41 of 308 steps done, about 3 min to go`."""
        done, of = self._work(self._done), self._work(self._total)
        to_go = (time.monotonic() - self._began) * (of - done) / max(done, 1e-9)
        left = f", about {to_go / 60:.0f} min to go" if to_go >= 90.0 else f", about {to_go:.0f} s to go"
        is_known = self._seconds and SURE * of <= done < of
        return f"{self._done.total()} of {self._total.total()} steps done{left if is_known else ''}"


def seconds_of_stages(reference: Path, scenes: Iterable[str]) -> dict[str, float]:
    """Mean wall time of a job of each stage in the runs that git keeps; nothing where it keeps none of a scene.

    reference : their folder
    """
    files = [reference / scene / "costs.json" for scene in scenes]
    if not all(file.is_file() for file in files):
        return {}
    rows = [row for file in files for row in json.loads(file.read_text(encoding="utf-8"))]
    return {row["stage"]: row["wall_seconds"] / row["jobs"] for row in rows if row["jobs"]}


def show_own_errors(scene_of: Callable[[str], str], seconds: Callable[[], dict[str, float]] | None = None) -> None:
    """Let Snakemake's handler for the terminal show a line an error, unless --verbose asks for all.

    scene_of : name of the scene that has a folder of the store
    seconds : as of Progress; None where nothing runs
    """
    for handler in logger.handlers:
        shown = handler.formatter
        if handler.name == "DefaultStreamHandler" and isinstance(shown, DefaultFormatter):
            own = OwnErrors(shown.quiet, shown.show_failed_logs)
            own.scene_of = scene_of
            own.progress = None if seconds is None else Progress(seconds)
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
