"""The pages of the reference: all public names are on them, and docstrings come out as they are meant."""

import ast
import re
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def api_pages():
    sys.path.insert(0, str(ROOT / "docs"))
    yield import_module("api_pages")
    sys.path.remove(str(ROOT / "docs"))


def test_each_public_name_is_on_the_page_of_its_package(api_pages, tmp_path):
    api_pages.write(tmp_path / "api")
    for package in api_pages.PACKAGES:
        text = (tmp_path / "api" / f"{package}.md").read_text(encoding="utf-8")
        assert [name for name in import_module(package).__all__ if f"{package}.{name}" not in text] == []
    page = (tmp_path / "api/roughslip.contact.md").read_text(encoding="utf-8")
    assert "Called in {download}`contact_hertz.py <../../../examples/contact_hertz.py>`" in page


@pytest.mark.slow  # compiles contact and motion, and searches limits
def test_each_snippet_runs_by_itself(api_pages):
    """They hold numbers to check, and none is of a function that is gone or that a script shows."""
    shown = api_pages.snippets()
    for name, code in shown.items():
        package, _, function = name.rpartition(".")
        assert function in import_module(package).__all__
        assert name not in api_pages.calls()
        exec(compile(code, name, "exec"), {"__name__": name})  # noqa: S102 - our own examples
    assert shown


def test_a_docstring_becomes_text(api_pages):
    """One mark of a formula, a list of arguments, and errors in a paragraph of their own."""
    lines = [
        *("Solve it.", "", "Find p such that::", "", "    B p = u", "", "tolerance : [-] largest residual"),
        *("    that is accepted", "", "Returns p. Raises ParameterError for others."),
    ]
    api_pages.as_restructured_text(None, "", "", None, None, lines)
    assert sum("::" in line for line in lines) == 1
    assert "    B p = u" in lines
    assert "- **tolerance** – [-] largest residual" in lines
    assert lines[-3:] == ["**Returns** p.", "", "**Raises** ParameterError for others."]


@pytest.mark.parametrize("name", ["chain", "disc", "tribometer"])
def test_a_tutorial_runs_where_there_is_only_the_library(name):
    """As a notebook in a folder of its own: it imports no file of the manual, and reads only what the page offers."""
    page = (ROOT / f"docs/tutorials/{name}.md").read_text(encoding="utf-8")
    cells = re.findall(r"```\{code-cell\}\n(?:---\n.*?\n---\n)?(.*?)```", page, flags=re.DOTALL)
    nodes = list(ast.walk(ast.parse("\n".join(cells))))
    imported = {str(node.module) for node in nodes if isinstance(node, ast.ImportFrom)}
    imported |= {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    assert {module.partition(".")[0] for module in imported} <= {"roughslip", "numpy", "matplotlib", "dataclasses"}
    texts = [node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    for file in (text for text in texts if re.fullmatch(r"\S+\.(nc|csv)", text)):
        assert f"{{download}}`{file}`" in page
        assert (ROOT / "docs/tutorials" / file).is_file()
    assert f"<{name}.ipynb>" in page
