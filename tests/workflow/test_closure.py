"""Import closures and code hashes on small packages written to disk."""

import ast
from collections import Counter
from pathlib import Path

import pytest

from roughslip import source_hash
from roughslip.scene.rules import SLICES
from roughslip.source_hash import closure
from workflow.keys.closure import code_hash

ROOT = Path(__file__).resolve().parents[2]
STAGE = "pkg.stages.contact"

# A stage that reaches each module in another way; `lonely` and `other` stay out.
PACKAGE = {
    "pkg/__init__.py": "",
    "pkg/errors.py": "class E(Exception): pass\n",
    "pkg/grid.py": "from .errors import E\n",
    "pkg/lazy.py": "import os\n",
    "pkg/types.py": "from pkg import errors as _\n",
    "pkg/lonely.py": "import pkg.stages.contact\n",
    "pkg/sub/__init__.py": "from . import inner\n",
    "pkg/sub/inner.py": "from ..grid import E\n",
    "pkg/sub/deep/__init__.py": "",
    "pkg/sub/deep/leaf.py": "import numpy\n",
    "pkg/sub/other.py": "",
    "pkg/stages/__init__.py": "",
    "pkg/stages/contact.py": (
        "from __future__ import annotations\n"
        "from typing import TYPE_CHECKING\n"
        "import pkg.sub.deep.leaf as leaf\n"
        "if TYPE_CHECKING:\n"
        "    from pkg.types import Q\n"
        "def run(x):\n"
        '    """Solve."""\n'
        "    from pkg import lazy\n"
        "    return x + 1\n"
    ),
}
REACHED = sorted(set(PACKAGE) - {"pkg/lonely.py", "pkg/sub/other.py"})


@pytest.fixture
def source(tmp_path: Path) -> Path:
    for name, text in PACKAGE.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    (tmp_path / "lock").write_text("numpy==2.0\n")
    return tmp_path


def edited(source: Path, name: str, old: str, new: str) -> bool:
    """Does this edit change the hash of the stage?"""
    before = code_hash(STAGE, source, source / "lock")
    text = (source / name).read_text()
    assert old in text
    (source / name).write_text(text.replace(old, new, 1))
    return code_hash(STAGE, source, source / "lock") != before


def test_closure_is_what_an_import_can_execute(source):
    assert [file.relative_to(source).as_posix() for file in closure(STAGE, source)] == REACHED


def test_cycles_end(source):
    (source / "pkg/errors.py").write_text("import pkg.grid\n")
    assert len(closure(STAGE, source)) == len(REACHED)


def test_module_without_a_file_is_named_with_who_imports_it(source):
    (source / "pkg/lazy.py").write_text("import pkg.gone\n")
    with pytest.raises(ModuleNotFoundError, match=r"lazy\.py imports pkg\.gone"):
        closure(STAGE, source)
    with pytest.raises(ModuleNotFoundError, match=r"the workflow imports pkg\.stages\.nothing"):
        closure("pkg.stages.nothing", source)


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("pkg/stages/contact.py", "return x + 1", "return (\n        x + 1  # one more\n    )"),
        ("pkg/stages/contact.py", '"""Solve."""', '"""Solve it.\n\n    With care."""'),
        ("pkg/errors.py", "class E(Exception): pass", '"""Errors."""\n\n\nclass E(Exception):\n    pass'),
        ("pkg/lonely.py", "import", "import os\nimport"),
        ("pkg/sub/other.py", "", "x = 1\n"),
        ("lock", "numpy==2.0\n", "# newer tool\n\nnumpy==2.0\n    # via scipy\n"),
    ],
)
def test_comments_docstrings_layout_and_strangers_leave_the_hash_alone(source, name, old, new):
    assert not edited(source, name, old, new)


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("pkg/stages/contact.py", "x + 1", "x + 2"),
        ("pkg/stages/contact.py", "x + 1", "x - 1"),
        ("pkg/stages/contact.py", "x + 1", "x + 1.0"),
        ("pkg/stages/contact.py", "from pkg import lazy", "from pkg import lazy, lonely"),
        ("pkg/errors.py", "pass", "text = 'pass'"),
        ("pkg/sub/deep/__init__.py", "", "x = 1\n"),
        ("pkg/__init__.py", "", "__version__ = '1'\n"),
        ("lock", "2.0", "2.1"),
    ],
)
def test_any_edit_that_acts_changes_the_hash(source, name, old, new):
    assert edited(source, name, old, new)


def test_a_docstring_that_becomes_a_value_counts(source):
    assert edited(source, "pkg/stages/contact.py", '"""Solve."""', 'y = """Solve."""')


def test_the_hash_does_not_depend_on_where_the_tree_stands(source, tmp_path):
    moved = tmp_path / "elsewhere"
    for name, text in PACKAGE.items():
        (moved / name).parent.mkdir(parents=True, exist_ok=True)
        (moved / name).write_text(text)
    assert code_hash(STAGE, moved, source / "lock") == code_hash(STAGE, source, source / "lock")


# Hash from Python 3.11.7; 3.12.1 and 3.13.0 gave the same. f-strings, empty lists of arguments and new fields of nodes
# are where ast.dump and ast.unparse differ.
TRICKY = '''
def f(a, /, b=1, *args, c: int = 2, **kw):
    """Doc."""
    w = 3
    return f"{a!r:>{w}} {b:.3e}{'x'}" "y" f"{a=}", a[1, ::2], [*args], {**kw}, 1e400, "é\\n", b"\\x00", lambda: (yield)


class C(dict[str, int]):
    """Doc."""

    x: "C | None" = None
'''
TRICKY_HASH = "e59c7286fa54230fcba312e3ae2a8db9878148d6bfa79e8e23ea00d58c049421"


def test_the_hash_is_the_same_on_every_python(tmp_path):
    (tmp_path / "tricky.py").write_text(TRICKY, encoding="utf-8")
    (tmp_path / "lock").write_text("")
    assert code_hash("tricky", tmp_path, tmp_path / "lock") == TRICKY_HASH


# Modules of src/roughslip and the stages whose code they belong to.
CONTACT = {"contact_square", "training_square", "field_square", "contact_strip"}
SAMPLING = {"surface", *CONTACT, "chaos_square", "chaos_strip", "expansion_strip", "scan", "twins", "report"}
MODULES = {
    "figures": {
        "figure2",
        "figure3",
        "figure3_law",
        "figure5",
        "figure_scan",
        "figure_field",
        "figure_map",
        "comparison",
    },
    "figures_friction": {"figure3", "figure3_law", "comparison"},
    "figures_scan": {"figure_scan"},
    "figures_field": {"figure_field"},
    "figures_map": {"figure_map"},
    "report": {"report"},
    "claims": {"claims"},
    "ranges": {"claims"},
    "bracket": {"deterministic", "claims"},
    "surface/karhunen_loeve": {"surface", "contact_square", "training_square", "field_square", "report"},
    "surface/embedding": {*SAMPLING, "grinding"},
    "surface/model": SAMPLING,
    "surface/covariance_fit": {"scan"},
    "contact/conjugate_gradients": CONTACT,
    "contact/solve": CONTACT,
    "chaos/regression": {"training_square", "chaos_square", "field_square", "chaos_strip", "expansion_strip"},
    "chaos/field": {"field_square"},
    "friction/correlation": {"friction"},
    "friction/recursion": {"spacing", "oscillator", "stick_slip_map", "survival"},
    "oscillator/stick": {"deterministic", "spacing", "oscillator", "stick_slip_map", "survival"},
    "oscillator/return_map": {"deterministic", "stick_slip_map", "survival"},
    "oscillator/survival": {"stick_slip_map", "survival"},
    "oscillator/periodic": {"deterministic"},
}


@pytest.mark.parametrize("module", MODULES)
def test_an_edit_of_a_module_reaches_these_stages(module):
    file = ROOT / f"src/roughslip/{module}.py"
    assert {name for name in SLICES if file in closure(f"roughslip.stages.{name}", ROOT / "src")} == MODULES[module]


def forget(monkeypatch, kept: Path) -> None:
    """A new process that finds this file."""
    monkeypatch.setattr("roughslip.source_hash._memory", lambda: kept)
    source_hash.syntax.cache_clear()
    source_hash._kept.cache_clear()


def test_each_file_is_parsed_once_for_all_stages(monkeypatch):
    """Parsing is what hashing costs, and every start of Snakemake hashes all stages."""
    parsed = Counter()

    def parse(source: bytes, name: str = "", *more: object, **named: object) -> ast.AST:
        parsed.update([name] if name.endswith(".py") else [])  # a reader of version numbers parses, too
        return ast_parse(source, name, *more, **named)

    ast_parse = ast.parse
    monkeypatch.setattr("roughslip.source_hash.ast.parse", parse)
    forget(monkeypatch, Path("nowhere.json"))
    for stage in SLICES:
        code_hash(f"roughslip.stages.{stage}", ROOT / "src", ROOT / "requirements.lock")
    assert len(parsed) > 60
    assert set(parsed.values()) == {1}


def test_what_was_parsed_is_kept_for_the_next_process(source, tmp_path, monkeypatch):
    kept = tmp_path / "cache/syntax.json"
    forget(monkeypatch, kept)
    first = code_hash(STAGE, source, source / "lock")
    source_hash.keep()

    def no_parser(*_: object) -> None:
        raise AssertionError("parsed again")

    forget(monkeypatch, kept)
    with monkeypatch.context() as without:
        without.setattr("roughslip.source_hash.ast.parse", no_parser)
        assert code_hash(STAGE, source, source / "lock") == first
    assert edited(source, "pkg/grid.py", "import E", "import E as F")


@pytest.mark.parametrize("damage", ["flip", "cut", "empty", "bytes", "folder", "other code", "other Python"])
def test_a_damaged_memory_of_what_was_parsed_is_not_believed(source, tmp_path, monkeypatch, damage):
    kept = tmp_path / "syntax.json"
    forget(monkeypatch, kept)
    first = code_hash(STAGE, source, source / "lock")
    source_hash.keep()
    text = kept.read_text()
    digest = source_hash.syntax(source / "pkg/grid.py", (source / "pkg/grid.py").read_bytes()).digest
    if damage == "flip":
        kept.write_text(text.replace(digest, digest[::-1]))
    elif damage == "cut":
        kept.write_text(text[:-9])
    elif damage == "empty":
        kept.write_text("")
    elif damage == "bytes":
        kept.write_bytes(b"\xff" + text.encode())
    elif damage == "folder":
        kept.unlink()
        kept.mkdir()
    elif damage == "other code":
        source_hash._this_file.cache_clear()
        monkeypatch.setattr("roughslip.source_hash._this_file", lambda: "another parser")
    else:
        monkeypatch.setattr("roughslip.source_hash.sys.version", "3.99")
    forget(monkeypatch, kept)
    assert source_hash._kept() == {}
    assert code_hash(STAGE, source, source / "lock") == first
    source_hash.keep()  # over a folder it cannot, and says nothing
