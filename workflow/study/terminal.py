"""What the terminal shows of a failed or interrupted run: the stage's own error, not the shell command around it.

The file below .snakemake/log keeps all that Snakemake says.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from snakemake.logging import DefaultFormatter, logger

# What Snakemake says of a failure in addition to the error of the job
_ECHOES = (
    "RuleException:\nCalledProcessError",
    "Shutting down,",
    "Exiting because a job",
    "WorkflowError:\nAt least one",
)
_INTERRUPTED = ("Terminating processes on user request", "died with <Signals.SIGINT")


class OwnErrors(DefaultFormatter):
    """Snakemake's lines, with the error that a stage states in its log in place of a failed job's block.

    A job that ends without a stated error, killed or by a fault of the code, keeps its block and its log.
    """

    is_interrupted = False
    scene_of: Callable[[str], str]

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a record says anything new: after Ctrl-C no job's error does."""
        text = record.getMessage()
        self.is_interrupted |= any(word in text for word in _INTERRUPTED)
        return not text.startswith(_ECHOES) and not (self.is_interrupted and text.startswith("Error in "))

    def format_job_error(self, msg: dict[str, Any]) -> str:
        """The stated error behind the name of its scene."""
        stated = stated_error(msg["log"])
        folder = Path(*msg["log"][:1]).parent.parent
        name = self.scene_of(folder.as_posix()) if "store" in folder.parts else folder.name
        return f"{name}: {stated} [{msg['log'][0]}]" if stated else super().format_job_error(msg)


def stated_error(logs: list[str]) -> str:
    """The error that `roughslip.stages.runtime.command` wrote at the end of a job's log; "" where it wrote none."""
    text = "".join(Path(file).read_text(encoding="utf-8", errors="replace") for file in logs if Path(file).is_file())
    stated = re.search(r"^(\w+): error: (.*)\Z", text, re.MULTILINE | re.DOTALL)
    return f"{stated[1]}: {stated[2].strip()}" if stated else ""


def show_own_errors(scene_of: Callable[[str], str]) -> None:
    """Let Snakemake's handler for the terminal show a line an error, unless --verbose asks for all.

    scene_of : name of the scene that has a folder of the store
    """
    for handler in logger.handlers:
        shown = handler.formatter
        if handler.name == "DefaultStreamHandler" and isinstance(shown, DefaultFormatter):
            own = OwnErrors(shown.quiet, shown.show_failed_logs)
            own.scene_of = scene_of
            handler.setFormatter(own)
            handler.addFilter(own.filter)
