"""Which source files a stage depends on, and one hash of what they do.

Snakemake does not see edits to imported modules, so each stage's key file carries this hash. Only imports written as
statements are found: `importlib.import_module` would escape, and a test forbids it in the package.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from workflow.lib.installed import departures
from workflow.lib.syntax import syntax


def closure(module_name: str, source_root: str | Path) -> list[Path]:
    """Files of the package that importing a module can execute: its own, those it imports, and every parent package.

    module_name : dotted name of the module, such as roughslip.stages.contact
    source_root : folder that holds the package

    Imports inside functions and under TYPE_CHECKING count. Raises ModuleNotFoundError for a module of the package
    that has no file.
    """
    root = Path(source_root)
    package = module_name.partition(".")[0]
    found: dict[str, Path] = {}
    pending = [(module_name, "the workflow")]
    while pending:
        module, importer = pending.pop()
        if module in found:
            continue
        file = _module_file(module, root)
        if file is None:
            raise ModuleNotFoundError(f"{importer} imports {module}, which has no file in {root}")
        found[module] = file
        parent = module.rpartition(".")[0]
        wanted = [parent] if parent else []
        for target, names in absolute_imports(file, module):
            if target.partition(".")[0] == package:
                wanted.append(target)
                wanted += [f"{target}.{name}" for name in names if _module_file(f"{target}.{name}", root)]
        pending += [(name, str(file)) for name in wanted]
    return sorted(found.values())


def code_hash(module_name: str, source_root: str | Path, lock: str | Path) -> str:
    """SHA-256 of what the closure of a module does, of the locked packages, and of those installed in their place.

    Comments, docstrings and layout leave it alone, and so does the Python version. A file that moves changes it.
    """
    root = Path(source_root)
    digest = hashlib.sha256()
    for file in closure(module_name, root):
        digest.update(f"{file.relative_to(root).as_posix()} {syntax(file, file.read_bytes()).digest}\n".encode())
    locked = Path(lock).read_text(encoding="utf-8")
    pins = (line.strip() for line in locked.splitlines())
    digest.update(
        "\n".join([*(line for line in pins if line and not line.startswith("#")), *departures(locked)]).encode()
    )
    return digest.hexdigest()


def absolute_imports(file: Path, module: str) -> list[tuple[str, tuple[str, ...]]]:
    """The import statements of a file as (absolute module, names taken from it), relative ones resolved."""
    package = module if file.name == "__init__.py" else module.rpartition(".")[0]
    resolved = []
    for level, target, names in syntax(file, file.read_bytes()).imports:
        if level:
            base = package.rsplit(".", level - 1)[0]
            target = f"{base}.{target}" if target else base
        resolved.append((target, names))
    return resolved


def _module_file(module: str, root: Path) -> Path | None:
    path = root.joinpath(*module.split("."))
    candidates = (path / "__init__.py", path.with_name(f"{path.name}.py"))
    return next((file for file in candidates if file.is_file()), None)
