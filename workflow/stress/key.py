"""Key files of the campaigns: what makes problems, judges them and is judged, and the locked packages."""

from __future__ import annotations

from pathlib import Path

from workflow.benchmarks.key import _of_the_package
from workflow.lib.closure import code_hash
from workflow.lib.keys import write_key


def stress_key(stage: str, root: Path, lock: Path, **configuration: object) -> str:
    """Path of the key file of the module workflow.stress.<stage>, written anew where it changed.

    root : the project's folder
    lock : the lock file of the environment that it runs in
    configuration : what else its results depend on
    """
    module, path = f"workflow.stress.{stage}", f"results/stress/keys/{stage}.json"
    package = {imported: code_hash(imported, root / "src", lock) for imported in _of_the_package(module, root)}
    write_key(path, {**configuration, "package": package}, module, root, lock)
    return path
