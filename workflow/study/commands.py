"""The parts of a stage's rule that derive from its declaration: its command, its outputs and its log."""

from __future__ import annotations

from typing import Any

from snakemake.io import report

from roughslip.scene.declarations import declarations
from workflow.keys.names import STORE

CAPTION = "../report/caption.rst"  # from a file of rules


def command(stage: str) -> str:
    """The shell command of a stage, without its log. Its key file says which files it reads and writes.

    With `exec` the stage is a child of Snakemake itself and ends with it. Paths are in the environment: in the command
    they would differ when the tree is moved or .venv is made again.
    """
    declared = declarations()[stage]
    options = " ".join(f"--{name} {{wildcards.{name}}}" for name in declared.placeholders)
    key = f"{STORE}/{stage}/{{wildcards.key}}/key.json"
    return f'exec "$ROUGHSLIP_PYTHON" -m {declared.command} --key {key} {options}'.rstrip()


def outputs(stage: str, category: Any) -> dict[str, Any]:
    """Files that a stage writes, by option, and its record of cost. A picture also goes to Snakemake's report.

    category : function of the wildcards, for the report
    """
    declared = declarations()[stage]
    folder = f"{STORE}/{stage}/{{key}}"
    files: dict[str, Any] = {name: f"{folder}/{file}" for name, file in declared.results.items()}
    if declared.caption:
        files["png"] = report(files["png"], caption=CAPTION, category=category)
    return files | {"usage": f"{folder}/usage/{declared.job_name()}.json"}


def log(stage: str) -> str:
    """The log of a job."""
    return f"{STORE}/{stage}/{{key}}/logs/{declarations()[stage].job_name()}.log"
