"""What a source file does and imports, without comments, docstrings and layout.

Every start of the workflow asks this of every file of the package, and parsing takes longer than all else where
nothing is to be done. What was parsed is kept for the next one, found by the content of the file, so it never gets old.
"""

from __future__ import annotations

import ast
import contextlib
import hashlib
import json
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

from workflow.lib.whole import write_if_changed

KEPT = Path(".cache/syntax.json")  # below the working folder, as the results are
MOST_KEPT = 2000  # files; more are those of many edits, and it starts anew

_SCOPES = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


class Syntax(NamedTuple):
    """digest : SHA-256 of the syntax tree, the same on every Python
    imports : the import statements, each as level (0 is absolute), module, and names taken from it
    """

    digest: str
    imports: tuple[tuple[int, str, tuple[str, ...]], ...]


@cache
def syntax(file: Path, source: bytes) -> Syntax:
    """Of the file with this content. Raises SyntaxError with the name of the file."""
    name = hashlib.sha256(source).hexdigest()
    if name not in _known():
        _known()[name] = _parsed(file, source)
    return _known()[name]


def keep() -> None:
    """Write down what was parsed. Where the folder cannot be written to, the next start parses again."""
    content = json.dumps(_known())
    with contextlib.suppress(OSError):  # a read-only folder, a full disk
        write_if_changed(KEPT, f"{_seal(content)}\n{content}")


@cache
def _known() -> dict[str, Syntax]:
    """By the hash of a source, what was kept; nothing where the file is damaged or other code wrote it."""
    try:
        seal, _, content = KEPT.read_text(encoding="utf-8").partition("\n")
    except (OSError, UnicodeDecodeError):
        return {}
    if seal != _seal(content):
        return {}
    kept = {
        name: Syntax(digest, tuple((level, module, tuple(names)) for level, module, names in imports))
        for name, (digest, imports) in json.loads(content).items()
    }
    return kept if len(kept) <= MOST_KEPT else {}


def _seal(content: str) -> str:
    """Hash of the content, of this file, and of the Python that parses."""
    return hashlib.sha256(f"{sys.version}\n{_this_file()}\n{content}".encode()).hexdigest()


@cache
def _this_file() -> str:
    return Path(__file__).read_text(encoding="utf-8")


def _parsed(file: Path, source: bytes) -> Syntax:
    tree = ast.parse(source, str(file))
    imports: list[tuple[int, str, tuple[str, ...]]] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imports += [(0, alias.name, ()) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            imports.append((node.level, node.module or "", tuple(alias.name for alias in node.names)))
        elif isinstance(node, _SCOPES) and ast.get_docstring(node, clean=False) is not None:
            del node.body[0]
        elif isinstance(node, ast.JoinedStr):  # Python 3.12 puts empty strings into nested format specifications
            node.values = [part for part in node.values if not (isinstance(part, ast.Constant) and part.value == "")]
    return Syntax(hashlib.sha256(_plain(tree).encode()).hexdigest(), tuple(imports))


def _plain(node: object) -> str:
    """A syntax tree as text that is the same on every Python: ast.dump and ast.unparse change between versions.

    Without positions, and without fields that are empty, because new versions of Python add such fields.
    """
    if isinstance(node, ast.AST):
        fields = ((name, getattr(node, name, None)) for name in node._fields)
        inner = ",".join(f"{name}={_plain(value)}" for name, value in fields if value is not None and value != [])
        return f"{type(node).__name__}({inner})"
    if isinstance(node, list):
        return f"[{','.join(map(_plain, node))}]"
    return repr(node)
