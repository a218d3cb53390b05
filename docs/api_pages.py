"""The reference of the library: a page for each package, written before the manual is read.

A page begins with the docstring of the package and a table of its functions. Each function has its docstring, a link
to the source, and lines of `snippets.md`, which tests run.
"""

import importlib
import inspect
import re
import shutil
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parents[1]
SNIPPETS = re.compile(r"^## (\S+)\n```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FIRST = ("surface", "scan", "record", "contact", "chaos", "friction", "oscillator", "probability")  # along the chain
_LISTED = sorted(file.parent.name for file in (ROOT / "src/roughslip").glob("*/__init__.pyi"))
_INNER = (*FIRST, *(name for name in _LISTED if name not in FIRST), "plot")
PACKAGES = ("roughslip", *(f"roughslip.{name}" for name in _INNER))


def write(folder: Path) -> None:
    """Write all pages into an empty folder."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for package in PACKAGES:
        (folder / f"{package}.md").write_text(_page(package), encoding="utf-8")


def packages() -> str:
    """A table of the packages, with what their docstrings say first, and the list for the menu."""
    rows = (f"| [{name}](api/{name}.md) | {_first_sentence(importlib.import_module(name))} |" for name in PACKAGES)
    pages = "\n".join(f"api/{name}" for name in PACKAGES)
    return "\n".join(["| package | what it does |", "|---|---|", *rows, f"\n```{{toctree}}\n:hidden:\n{pages}\n```"])


def _page(package: str) -> str:
    module = importlib.import_module(package)
    values = {name: getattr(module, name) for name in module.__all__}
    functions = {name: value for name, value in values.items() if inspect.isfunction(value)}
    rows = [
        f"| {{py:func}}`{name} <{package}.{name}>` | {_first_sentence(value)} |" for name, value in functions.items()
    ]
    text = [f"# {package}\n", f"```{{eval-rst}}\n.. automodule:: {package}\n```\n"]
    text += ["| function | what it does |", "|---|---|", *rows, ""] if rows else []
    for name, value in values.items():
        if inspect.isclass(value):
            kind, more = ("exception", "") if issubclass(value, Exception) else ("class", "\n   :members:")
            text.append(f"```{{eval-rst}}\n.. auto{kind}:: {package}.{name}{more}\n```\n")
        elif name in functions:
            text.append(f"```{{eval-rst}}\n.. autofunction:: {package}.{name}\n```\n")
            if code := snippets().get(f"{package}.{name}"):
                text.append(f"```python\n{code}```\n")
        elif not callable(value):
            meaning = f"{value:g}" if isinstance(value, float) else ", ".join(f"`{word}`" for word in value)
            text.append(f"```{{py:data}} {package}.{name}\n{meaning}.\n```\n")
    return "\n".join(text)


def _first_sentence(value: Any) -> str:
    text = " ".join((inspect.getdoc(value) or "").partition("\n\n")[0].split())
    return re.split(r"(?<=[a-z)][.]) ", text, maxsplit=1)[0].replace("|", "\\|").replace("*", "\\*").removesuffix("::")


@cache
def snippets() -> dict[str, str]:
    """By public name, an example of a function."""
    return dict(SNIPPETS.findall((ROOT / "docs/reference/snippets.md").read_text(encoding="utf-8")))


def as_restructured_text(app: "Sphinx", what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    """Docstrings of the project as reStructuredText: `name : (shape) [unit] what it is` becomes an item of a list."""
    made: list[str] = []
    text = re.sub(r"(?<=\.)\s+(?=Raises )", "\n\n", "\n".join(lines))
    block = ""  # what indented lines continue: an item of a list, or a formula that is written out
    for line in text.split("\n"):
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
