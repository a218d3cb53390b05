"""The parts of a stage's rule that derive from its declaration: its command, its outputs, its log and its memory."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from snakemake.io import report

from roughslip.scene.declarations import declarations
from workflow.keys.names import STORE

CAPTION = "../report/caption.rst"  # from a file of rules
NODE_MB = 400  # of the two Snakemakes that start a job on a node of a cluster
MORE = 4  # times the memory at each further attempt: the largest meshes take some six times what a stage declares


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


def asked_mb(stage: str, attempt: int, of_a_node: int | None) -> int:
    """Megabytes that a job asks for. of_a_node : what a node of a cluster gives to a job; None on this machine"""
    needed = declarations()[stage].memory_mb + (NODE_MB if of_a_node else 0)
    return min(needed * MORE ** (attempt - 1), of_a_node or sys.maxsize)


def machine_mb() -> int:
    """Megabytes of this machine, or of the container or control group that holds this process where that is less."""
    limits = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    for file in map(Path, ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")):
        if file.is_file() and (text := file.read_text(encoding="ascii").strip()).isdigit():
            limits.append(int(text))
    return min(limits) // 1_000_000
