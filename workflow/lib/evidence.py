"""Key files of benchmarks and stress campaigns: their code, the code that they measure or use, the locked packages."""

from __future__ import annotations

from pathlib import Path

from workflow.lib.closure import absolute_imports, closure, code_hash
from workflow.lib.keys import write_key


def evidence_key(kind: str, name: str, root: Path, lock: Path, **configuration: object) -> str:
    """Path of the key file of the module workflow.<kind>.<name>, written anew where it changed.

    kind : "benchmarks" or "stress"
    root : the project's folder
    lock : the lock file of the environment that it runs in
    configuration : what else its results depend on
    """
    module, path = f"workflow.{kind}.{name}", f"results/{kind}/keys/{name}.json"
    package = {imported: code_hash(imported, root / "src", lock) for imported in _of_the_package(module, root)}
    write_key(path, {**configuration, "package": package}, module, root, lock)
    return path


def _of_the_package(module: str, root: Path) -> list[str]:
    """Modules of roughslip that the module imports; the hash of each covers what they import in turn."""
    files = closure(module, root)
    modules = [".".join(file.relative_to(root).with_suffix("").parts) for file in files]
    imports = [target for file, name in zip(files, modules, strict=True) for target, _ in absolute_imports(file, name)]
    return sorted({target for target in imports if target.partition(".")[0] == "roughslip"})
