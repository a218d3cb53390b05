"""Key files of benchmarks and stress campaigns: their code, the code that they use, and the locked packages."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from roughslip.compilation.source_hash import absolute_imports, closure
from workflow.keys.code_hash import code_hash
from workflow.keys.key_files import write_key
from workflow.keys.monte_carlo_batches import SURFACES, reference_file

# By benchmark the kept files of a scene from which its errors follow. Its costs.json is not among them, because run
# times differ from run to run.
KEPT = {
    "chaos": {"reference": "pressure.nc"},
    "chain": {"reference": "friction.nc"},
}


def evidence_key(kind: str, name: str, root: Path, lock: Path, **configuration: object) -> str:
    """Write the key file of the module workflow.<kind>.<name> if it changed, and return its path.

    kind : "benchmarks" or "stress"
    root : the project's folder
    lock : the lock file of the environment in which it runs
    configuration : what else its results depend on

    Every key has its own folder: in a folder that exists when a run begins, Snakemake takes files that are written
    later for missing ones.
    """
    module, path = f"workflow.{kind}.{name}", f"results/{kind}/keys/{name}/key.json"
    package = {imported: code_hash(imported, root / "src", lock) for imported in _of_the_package(module, root)}
    return write_key(path, {**configuration, "package": package}, module, root, lock)


def measured_scenes(stage: str, scenes: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return what else a benchmark depends on: the scenes with a reference, and hashes of their files in KEPT."""
    if stage not in KEPT:
        return {}
    found = {name: {"scene": scenes[name]} for name in SURFACES if name in scenes}
    for name, depends in found.items():
        for what, kept in KEPT[stage].items():
            file = Path(reference_file(name)).with_name(kept)
            depends[what] = hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else "missing"
    return {"scenes": found}


def _of_the_package(module: str, root: Path) -> list[str]:
    """Return the modules of roughslip that a module imports; the hash of each covers its own imports."""
    files = closure(module, root)
    modules = [".".join(file.relative_to(root).with_suffix("").parts) for file in files]
    found = set()
    for file, name in zip(files, modules, strict=True):
        for target, names in absolute_imports(file, name):
            if target.partition(".")[0] == "roughslip":
                found |= {target, *(f"{target}.{part}" for part in names if _is_module(f"{target}.{part}", root))}
    return sorted(found)


def _is_module(name: str, root: Path) -> bool:
    path = (root / "src").joinpath(*name.split("."))
    return path.with_suffix(".py").is_file() or path.is_dir()


def kept_evidence(name: str = "") -> list[str]:
    """Return the files of benchmarks and stress that git keeps, or that of one benchmark."""
    found = sorted(Path("results/reference/evidence").glob(f"{name or '*'}.json"))
    return [file.as_posix() for file in found]
