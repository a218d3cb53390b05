"""Hash what source code does: import closures, without comments, docstrings and layout.

Key files of stages and the cache of compiled functions use it. Parsing takes most of the time, so a parsed file is
remembered under the hash of its bytes.
"""

import ast
import contextlib
import hashlib
import json
import os
import sys
from collections.abc import Collection
from functools import cache
from pathlib import Path
from typing import NamedTuple

from roughslip.atomic_write import write_if_changed

# What surrounds a stage and changes none of its numbers: values of a scene are in the key of a stage, and these modules
# hold, check, refuse and report.
FRAME = (
    "roughslip.scene",
    "roughslip.errors",
    "roughslip.public_names",
    "roughslip.validation",
    *(f"roughslip.study.{name}" for name in ("graph", "plan", "job")),
)
MOST_KEPT = 2000  # files; more are the remains of many edits, and the memory starts anew

_SCOPES = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


class Syntax(NamedTuple):
    """digest : SHA-256 of the syntax tree; it depends on Python's minor version, which names of results hold too
    imports : the import statements, each as level (0 is absolute), module, and names taken from it
    """

    digest: str
    imports: list[tuple[int, str, list[str]]]


def cache_folder() -> Path:
    """The folder of caches: of the project if the package runs from one, else of the user."""
    project = Path(__file__).resolve().parents[3]
    if (project / "pyproject.toml").is_file() and os.access(project, os.W_OK):
        return project / ".cache"
    return Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")) / "roughslip"


def compiled_folder() -> Path:
    """The folder of all compiled functions: NUMBA_CACHE_DIR where the user sets it, else below the cache folder."""
    return Path(os.environ.get("NUMBA_CACHE_DIR") or cache_folder() / "numba")


def closure(modules: str, source_root: Path, without: Collection[str] = ()) -> list[Path]:
    """Files of the package that importing modules can execute: their own, those they import, and every parent package.

    modules : their dotted names, such as roughslip.study.contact, separated by spaces
    source_root : folder that holds the package
    without : dotted names of modules and subpackages that are left out, with what only they import

    Imports inside functions and under TYPE_CHECKING count, and a public name of a package counts as the module that
    `__init__.pyi` gives for it. `importlib.import_module` is not seen. Raises ModuleNotFoundError for a module of the
    package that has no file.
    """
    package = modules.partition(".")[0]
    files: dict[str, Path] = {}
    pending = [(name, "the caller") for name in modules.split()]
    while pending:
        module, importer = pending.pop()
        if module in files or f"{module}.".startswith(tuple(f"{name}." for name in without)):
            continue
        file = _module_file(module, source_root)
        if file is None:
            raise ModuleNotFoundError(f"{importer} imports {module}, which has no file in {source_root}")
        files[module] = file
        parent = module.rpartition(".")[0]
        wanted = [*([parent] if parent else []), *imported_modules(file, module, package, source_root)]
        pending += [(name, str(file)) for name in wanted]
    return sorted(files.values())


def imported_modules(file: Path, module: str, package: str, source_root: Path) -> list[str]:
    """The modules of a package that the statements of a file import. module : its dotted name"""
    modules = []
    for target, names in absolute_imports(file, module):
        if target.partition(".")[0] == package:
            if names == ["*"]:  # of a package: all its modules
                names = sorted(one.stem for one in source_root.joinpath(*target.split(".")).glob("*.py"))
            submodules = [f"{target}.{name}" for name in names if _module_file(f"{target}.{name}", source_root)]
            listed = _public_names(target, source_root)
            modules += [target, *submodules, *(place for place, of_place in listed if {*names} & {*of_place})]
    return modules


@cache
def _public_names(package: str, root: Path) -> list[tuple[str, list[str]]]:
    """What `__init__.pyi` of a package imports, as `absolute_imports`."""
    file = root.joinpath(*package.split("."), "__init__.pyi")
    return absolute_imports(file, package) if file.is_file() else []


def closure_hash(modules: str, source_root: Path, without: Collection[str] = ()) -> str:
    """SHA-256 of what the closure of modules does. A file that moves changes it; raises as `closure`.

    Templates of a package in the closure count as code.
    """
    digest = hashlib.sha256()
    for file in closure(modules, source_root, without):
        if file.name == "__init__.py":
            for template in sorted(file.parent.glob("templates/*.j2")):
                digest.update(template.read_bytes())
        digest.update(f"{file.relative_to(source_root).as_posix()} {syntax(file, file.read_bytes()).digest}\n".encode())
    return digest.hexdigest()


def absolute_imports(file: Path, module: str) -> list[tuple[str, list[str]]]:
    """The import statements of a file as (absolute module, names taken from it), relative ones resolved."""
    package = module if file.name == "__init__.py" else module.rpartition(".")[0]
    resolved = []
    for level, target, names in syntax(file, file.read_bytes()).imports:
        if level:
            base = package.rsplit(".", level - 1)[0]
            target = f"{base}.{target}" if target else base
        resolved.append((target, names))
    return resolved


@cache
def syntax(file: Path, source: bytes) -> Syntax:
    """The syntax of a file with this content. Raises SyntaxError with the name of the file."""
    name = hashlib.sha256(source).hexdigest()
    if name not in _kept():
        _kept()[name] = _parsed(file, source)
    return _kept()[name]


def keep() -> None:
    """Write the memory of parsed files, with what others wrote. Where it cannot be, the next process parses again."""
    with contextlib.suppress(OSError):  # a read-only folder, a full disk
        write_if_changed(_memory(), json.dumps(_remembered() | _kept()))


def _memory() -> Path:
    """The file of parsed files, named by the code and the Python that parse."""
    parser = f"{sys.version}\n{Path(__file__).read_text(encoding='utf-8')}"
    return cache_folder() / f"syntax-{hashlib.sha256(parser.encode()).hexdigest()[:16]}.json"


@cache
def _kept() -> dict[str, Syntax]:
    """The memory as this process found it, and what it has parsed since."""
    return _remembered()


def _remembered() -> dict[str, Syntax]:
    """Remembered files by the hash of their source; none where the memory is damaged or full of old files."""
    try:
        kept = {name: Syntax(*parts) for name, parts in json.loads(_memory().read_text(encoding="utf-8")).items()}
    except (OSError, ValueError, TypeError, AttributeError):
        return {}
    return kept if len(kept) <= MOST_KEPT else {}


@cache  # no file appears or moves while a study is planned
def _module_file(module: str, root: Path) -> Path | None:
    path = root.joinpath(*module.split("."))
    candidates = (path / "__init__.py", path.with_name(f"{path.name}.py"))
    return next((file for file in candidates if file.is_file()), None)


def _parsed(file: Path, source: bytes) -> Syntax:
    """The syntax of a file, without docstrings."""
    tree = ast.parse(source, str(file))
    imports: list[tuple[int, str, list[str]]] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imports += [(0, alias.name, []) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            imports.append((node.level, node.module or "", [alias.name for alias in node.names]))
        elif isinstance(node, _SCOPES) and ast.get_docstring(node, clean=False) is not None:
            del node.body[0]
    return Syntax(hashlib.sha256(ast.dump(tree).encode()).hexdigest(), imports)
