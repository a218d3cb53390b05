"""The parts of a stage's rule that derive from its declaration: its command, its outputs and its log."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from pathlib import PurePosixPath
from typing import Any

from snakemake.io import report

from roughslip.scene.declarations import Stage, declarations

CAPTION = "../report/caption.rst"  # from a file of rules

# With `exec` the stage is a child of Snakemake itself and ends with it. Paths are in the environment: in the command
# they would re-run all jobs when the tree is moved or .venv is made again.
_PYTHON = 'exec "$ROUGHSLIP_PYTHON" -m roughslip.stages'

# The shell command of a stage, for rules that are made in a loop: Snakemake evaluates it when the loop has ended.
RUN = f"{_PYTHON}.{{params.module}} {{params.options}} 2> {{log:q}}"


def options_of(stage: str) -> Callable[..., str]:
    """A parameter function: the options of a stage's command, for a rule whose files have the names of its options."""
    declared = declarations()[stage]

    def options(wildcards: Any, input: Any, output: Any) -> str:
        files = {name: input.get(name) or [] for name in ("key", *declared.options)}
        files |= {name: output.get(name) for name in (*declared.results, "usage")}
        words = [f"--{name} {_quoted(given)}" for name, given in files.items()]
        return " ".join([*words, *(f"--{name} {shlex.quote(wildcards[name])}" for name in declared.placeholders)])

    return options


def run(stage: str, **given: str) -> str:
    """The shell command of a stage, for a rule whose inputs and outputs have the names of the stage's options.

    given : by option, what the command takes in place of the input of that name
    """
    declared = declarations()[stage]
    options = {name: f"{{input.{name}:q}}" for name in ("key", *declared.options)} | given
    options |= {name: f"{{output.{name}:q}}" for name in (*declared.results, "usage")} | given
    return f"{_PYTHON}.{stage} {' '.join(f'--{name} {value}' for name, value in options.items())} 2> {{log:q}}"


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


def _quoted(files: Any) -> str:
    return " ".join(shlex.quote(str(file)) for file in ([files] if isinstance(files, str) else files))
