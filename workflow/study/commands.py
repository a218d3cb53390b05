"""The parts of a stage's rule that derive from its declaration: its command, its outputs and its log."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import PurePosixPath
from typing import Any

from snakemake.io import report
from snakemake.utils import format

from roughslip.scene.declarations import Stage, declarations

CAPTION = "../report/caption.rst"  # from a file of rules

# With `exec` the stage is a child of Snakemake itself and ends with it. Paths are in the environment: in the command
# they would re-run all jobs when the tree is moved or .venv is made again.
_PYTHON = 'exec "$ROUGHSLIP_PYTHON" -m roughslip.stages'


def run(stage: str, **given: str) -> str:
    """The shell command of a stage, for a rule whose inputs and outputs have the names of the stage's options.

    given : by option, what the command takes in place of the input of that name
    """
    return f"{_pattern(stage, **given)} 2> {{log:q}}"


def command(stage: str) -> Callable[..., str]:
    """A parameter function: the same without the log, for rules in a loop.

    Snakemake evaluates shell commands when the loop has ended, so there they cannot name the stage.
    """
    pattern = _pattern(stage)
    return lambda wildcards, input, output: format(pattern, wildcards=wildcards, input=input, output=output)


def _pattern(stage: str, **given: str) -> str:
    declared = declarations()[stage]
    options = {"key": "{input.key:q}"}
    options |= {name: f"{{input.{name}:q}}" for name in declared.options} | given
    options |= {name: f"{{wildcards.{name}}}" for name in declared.placeholders}
    options |= {name: f"{{output.{name}:q}}" for name in (*declared.results, "usage")} | given
    return f"{_PYTHON}.{stage} {' '.join(f'--{name} {value}' for name, value in options.items())}"


def outputs(stage: str, folder: str = "results/{scene}") -> dict[str, Any]:
    """Files that a stage writes, by option, and its record of cost. A picture also goes to Snakemake's report."""
    declared = declarations()[stage]
    files: dict[str, Any] = {name: f"{folder}/{file}" for name, file in declared.results.items()}
    if declared.caption:
        files["png"] = report(files["png"], caption=CAPTION, category=PurePosixPath(folder).name)
    return files | {"usage": f"{folder}/usage/{job_name(declared)}.json"}


def log(stage: str, folder: str = "results/{scene}") -> str:
    """The log of a job."""
    return f"{folder}/logs/{job_name(declarations()[stage])}.log"


def job_name(stage: Stage, **values: object) -> str:
    """The name of a job, for its record of cost and its log: its stage, and the design and range of its samples.

    values : of the placeholders in the name of the result; without them they stay as they are
    """
    name = "-".join((stage.name, *(f"{{{part}}}" for part in stage.placeholders)))
    return name.format(**values) if values else name
