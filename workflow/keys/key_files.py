"""Write key files: what the results of a stage depend on, as an input file of its rules.

Snakemake compares inputs by content. So a stage runs again when its slice of the scene, its code or the locked packages
change, and after no other edit. Unlike parameters, this also holds without the folder .snakemake.

A dry run does not change key files: it writes drafts to a temporary folder. A job that a run would repeat
gets the draft as its input in place of the key file.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterable
from pathlib import Path

from snakemake.io import ancient

from roughslip.atomic_write import write_if_changed
from workflow.keys.code_hash import code_hash

_draft_folders: list[tempfile.TemporaryDirectory] = []  # of a dry run; it is removed when the process ends
_up_to_date: set[str] = set()
_out_of_date: set[str] = set()


def write_drafts() -> None:
    """From now on write drafts of key files, for a dry run."""
    while _draft_folders:
        _draft_folders.pop().cleanup()
    _draft_folders.append(tempfile.TemporaryDirectory(prefix="roughslip-dry-run-"))


def is_dry_run() -> bool:
    """Whether drafts are written."""
    return bool(_draft_folders)


def write_key(
    path: str, configuration: dict, module: str, source_root: str | Path, lock: str | Path, given: dict | None = None
) -> str:
    """Write a stage's key file if its content changed, and return the path that a rule takes as its input.

    path : the key file, results/<scene>/keys/<stage>.json
    configuration : JSON values that the stage reads, its only configuration
    module : dotted name of the stage module, such as roughslip.stages.contact
    source_root : folder that holds the package
    lock : the lock file of what runs
    given : JSON values that it works with and that no scene holds

    Other processes read the old file or the new one, whole. Raises ValueError for NaN or infinity and TypeError for
    what JSON cannot hold.
    """
    key = {"configuration": configuration, "code": code_hash(module, source_root, lock)}
    return replace_if_changed(path, key | ({"given": given} if given else {}))


def replace_if_changed(path: str, key: dict) -> str:
    """Write a key file if its content changed, and return the path that a rule takes; raises as write_key."""
    text = json.dumps(key, indent=2, sort_keys=True, allow_nan=False, ensure_ascii=False) + "\n"
    write_if_changed(content_of(path), text)
    return key_input(path)


def content_of(path: str | Path) -> Path:
    """The file that holds what a run would write to this path: the draft of a key file, else the file itself."""
    if not _draft_folders or not ("keys" in Path(path).parts or Path(path).name == "key.json"):
        return Path(path)
    return Path(_draft_folders[0].name, path)


def expect(up_to_date: Iterable[str], out_of_date: Iterable[str]) -> None:
    """Note for a dry run which jobs are up to date and which a run would repeat, by their records of cost."""
    for known, records in ((_up_to_date, up_to_date), (_out_of_date, out_of_date)):
        known.clear()
        known.update(records)


def key_input(path: str, record: str = "") -> str:
    """The key file as the input of a job. record : the job's record of cost"""
    draft = content_of(path)
    if draft == Path(path):
        return path
    if record in _up_to_date and Path(path).is_file():
        return ancient(path)
    is_equal = Path(path).is_file() and Path(path).read_bytes() == draft.read_bytes()
    return path if is_equal and record not in _out_of_date else str(draft)
