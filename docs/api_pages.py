"""The reference of the library: a page for each package and one for each function, written before the manual is read.

A page of a package begins with its docstring, then tables by purpose. A page of a function has its docstring, a link
to the source, and the shortest of `examples` on its subject that calls it, or its own lines in `snippets.md`. Tests
run all of them.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import shutil
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
UP = "../../../examples"  # from a page
SNIPPETS = re.compile(r"^## (\S+)\n```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# Packages whose other functions take a file, or draw: where the manual calls them.
SHOWN = {"roughslip.record": "tribometer", "roughslip.plot": "chain"}
FIRST = ("surface", "scan", "contact", "chaos", "friction", "oscillator", "probability")  # along the chain
_LISTED = sorted(file.parent.name for file in (EXAMPLES.parent / "src/roughslip").glob("*/__init__.pyi"))
PACKAGES = (
    "roughslip",
    *(f"roughslip.{name}" for name in (*FIRST, *(name for name in _LISTED if name not in FIRST), "plot")),
)


def write(folder: Path) -> None:
    """Write all pages into an empty folder."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for package in PACKAGES:
        functions = _public(package, inspect.isfunction)
        for name in functions:
            (folder / f"{package}.{name}.md").write_text(_function_page(package, name), encoding="utf-8")
        (folder / f"{package}.md").write_text(_package_page(package, functions), encoding="utf-8")


def packages() -> str:
    """A table of the packages, with what their docstrings say first, and the list for the menu."""
    rows = (f"| [{name}](api/{name}.md) | {_first_sentence(importlib.import_module(name))} |" for name in PACKAGES)
    pages = "\n".join(f"api/{name}" for name in PACKAGES)
    return "\n".join(["| package | what it does |", "|---|---|", *rows, f"\n```{{toctree}}\n:hidden:\n{pages}\n```"])


def _public(package: str, kind: Any = None) -> dict[str, Any]:
    """The public names of a package, of one kind where that is given."""
    module = importlib.import_module(package)
    values = {name: getattr(module, name) for name in module.__all__}
    return {name: value for name, value in values.items() if kind is None or kind(value)}


def _package_page(package: str, functions: dict[str, Any]) -> str:
    shown = [name for name in functions if calls(package, name)]
    others = [name for name in functions if name not in shown]
    classes = _public(package, inspect.isclass)
    errors = {name: value for name, value in classes.items() if issubclass(value, Exception)}
    results = {name: value for name, value in classes.items() if name not in errors}
    text = [f"# {package}\n", f"```{{eval-rst}}\n.. automodule:: {package}\n```\n"]
    for title, names in (("Main functions", shown), ("More functions" if shown else "Functions", others)):
        text += _table(title, {f"[{name}]({package}.{name}.md)": functions[name] for name in names})
    for title, table in (("Parameters and results", results), ("Errors", errors)):
        text += _table(title, {f"{{py:class}}`{name} <{package}.{name}>`": value for name, value in table.items()})
    for name in results:
        text.append(f"## {name}\n\n```{{eval-rst}}\n.. autoclass:: {package}.{name}\n   :members:\n```\n")
    for name in errors:
        text.append(f"```{{eval-rst}}\n.. autoexception:: {package}.{name}\n```\n")
    for name, value in _public(package, lambda value: not callable(value)).items():
        meaning = f"{value:g}" if isinstance(value, float) else f"One of {', '.join(f'`{word}`' for word in value)}"
        text.append(f"```{{py:data}} {package}.{name}\n{meaning}.\n```\n")
    pages = "\n".join(f"{package}.{name}" for name in functions)
    text.append(f"```{{toctree}}\n:hidden:\n{pages}\n```\n" if functions else "")
    return "\n".join(text)


def _table(title: str, rows: dict[str, Any]) -> list[str]:
    lines = [f"| {name} | {_first_sentence(value)} |" for name, value in rows.items()]
    return [f"## {title}\n", "| name | what it is |", "|---|---|", *lines, ""] if rows else []


def _first_sentence(value: Any) -> str:
    text = " ".join((inspect.getdoc(value) or "").partition("\n\n")[0].split())
    return re.split(r"(?<=[a-z)][.]) ", text, maxsplit=1)[0].replace("|", "\\|").replace("*", "\\*").removesuffix("::")


def _function_page(package: str, name: str) -> str:
    text = [f"# {name}\n", f"```{{eval-rst}}\n.. autofunction:: {package}.{name}\n```\n"]
    if found := calls(package, name):
        first, lines = found[0]
        marked = ",".join(map(str, lines))
        text.append(f"## Example\n\n{_download(first)}, which the tests run:\n")
        text.append(f"```{{literalinclude}} {UP}/{first.name}\n:emphasize-lines: {marked}\n```\n")
        if more := ", ".join(_download(file) for file, _ in found[1:]):
            text.append(f"Also called in {more}.\n")
    elif code := snippets().get(f"{package}.{name}"):
        text.append(f"## Example\n\n```python\n{code}```\n")
    elif package in SHOWN:
        text.append(f"## Example\n\n[A tutorial](../../tutorials/{SHOWN[package]}.md) calls it, with what comes out.\n")
    text.append(f"All names: [{package}]({package}.md).\n")
    return "\n".join(text)


def _download(file: Path) -> str:
    return f"{{download}}`{file.name} <{UP}/{file.name}>`"


@cache
def snippets() -> dict[str, str]:
    """By public name, an example of a function that no script of `examples` calls."""
    text = (EXAMPLES.parent / "docs/reference/snippets.md").read_text(encoding="utf-8")
    return dict(SNIPPETS.findall(text))


@cache
def _called_in_examples() -> dict[str, list[tuple[Path, list[int]]]]:
    """By public name, the examples that import it, the shortest first, and the lines where it is called."""
    found: dict[str, list[tuple[Path, list[int]]]] = {}
    texts = {file: file.read_text(encoding="utf-8") for file in EXAMPLES.glob("*.py")}
    for file in sorted(texts, key=lambda one: len(texts[one])):
        nodes = list(ast.walk(ast.parse(texts[file])))
        for node in nodes:
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("roughslip"):
                for name in [alias.name for alias in node.names]:
                    called = (one.func for one in nodes if isinstance(one, ast.Call))
                    lines = sorted({one.lineno for one in called if isinstance(one, ast.Name) and one.id == name})
                    found.setdefault(f"{node.module}.{name}", []).append((file, lines or [node.lineno]))
            elif isinstance(node, ast.Call) and ast.unparse(node.func).startswith("plot."):
                found.setdefault(f"roughslip.{ast.unparse(node.func)}", []).append((file, [node.lineno]))
    return found


def calls(package: str, name: str) -> list[tuple[Path, list[int]]]:
    """The examples that call a function, and the lines; first those named by the package."""
    found = _called_in_examples().get(f"{package}.{name}", [])
    return sorted(found, key=lambda one: not one[0].stem.startswith(package.rpartition(".")[2]))


def as_restructured_text(app: Sphinx, what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    """Docstrings of the project as reStructuredText: `name : (shape) [unit] what it is` becomes an item of a list."""
    made: list[str] = []
    text = re.sub(r"(?<=\.)\s+(?=Raises )", "\n\n", "\n".join(lines))
    lines[:] = text.split("\n")
    block = ""  # what indented lines continue: an item of a list, or a formula that is written out
    for line in lines:
        field = re.match(r"(\w[\w, ]*?) : (.*)", line)
        if field:
            made += [] if block == "item" else [""]
            made.append(f"- **{_escaped(field[1])}** – {_escaped(field[2])}")
            block = "item"
        elif line.startswith("    ") and block == "item":
            made.append(f"  {_escaped(line.strip())}")
        elif line.startswith("    "):
            is_announced = "".join(made[-2:]).endswith("::")  # by the sentence before
            made += [line] if block or is_announced else ["::", "", line]
            block = "formula"
        elif not line:
            made.append(line)
            block = "formula" if block == "formula" else ""
        else:
            made += ["", _escaped(line)] if block else [_escaped(line)]
            block = ""
    lines[:] = made


def _escaped(text: str) -> str:
    """A line without marks of reStructuredText; what stands between backticks is code."""
    parts = re.split(r"(`[^`]+`)", text.replace("\\", "\\\\"))
    text = "".join(f"`{part}`" if part.startswith("`") else re.sub(r"([*|_])", r"\\\1", part) for part in parts)
    return re.sub(r"^(Returns|Raises)(?= )", r"**\1**", text)
