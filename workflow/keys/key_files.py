"""Key files: what a stage's results depend on, as an input file of its rules.

Snakemake compares inputs by content, so a stage re-runs when its slice of the scene, its code or the locked packages
change, and for no other edit; unlike parameters, this holds when the folder .snakemake is gone.
"""

from __future__ import annotations

import json
from pathlib import Path

from workflow.keys.atomic_write import write_if_changed
from workflow.keys.closure import code_hash


def write_key(path: str | Path, configuration: dict, module: str, source_root: str | Path, lock: str | Path) -> None:
    """Write a stage's key file if its content changed; an equal file keeps its time stamp.

    path : the key file, results/<scene>/keys/<stage>.json
    configuration : JSON values that the stage reads, its only configuration
    module : dotted name of the stage module, such as roughslip.stages.contact
    source_root : folder that holds the package
    lock : the lock file of what runs

    Safe beside other invocations and in dry runs: readers see the old file or the new one, whole.
    Raises ValueError for NaN or infinity and TypeError for what JSON cannot hold.
    """
    replace_if_changed(Path(path), {"configuration": configuration, "code": code_hash(module, source_root, lock)})


def replace_if_changed(path: Path, key: dict) -> None:
    """Write a key whole where the file is not there or holds another one; raises as write_key."""
    text = json.dumps(key, indent=2, sort_keys=True, allow_nan=False, ensure_ascii=False) + "\n"
    write_if_changed(path, text)
