"""Import closures and hashes of what code does: on a small package written to disk, and on this one."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

from roughslip.compilation import source_hash
from roughslip.compilation.source_hash import closure, closure_hash, syntax
from roughslip.scene.declarations import declarations

SOURCE = Path(source_hash.__file__).resolve().parents[2]
MODULES = sorted((SOURCE / "roughslip").rglob("*.py"))
STAGE = "pkg.stages.contact"

# A stage that reaches each module in another way; `lonely`, `other` and `two` are outside its closure.
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
    "pkg/public/__init__.py": "",
    "pkg/public/__init__.pyi": "from pkg.public.one import A as A\nfrom pkg.public.two import B as B\n",
    "pkg/public/one.py": "A = 1\n",
    "pkg/public/two.py": "B = 2\n",
    "pkg/stages/__init__.py": "",
    "pkg/stages/contact.py": (
        "from __future__ import annotations\n"
        "from typing import TYPE_CHECKING\n"
        "import pkg.sub.deep.leaf as leaf\n"
        "from pkg.public import A\n"
        "STAGE = dict(memory_mb=260)\n"
        "if TYPE_CHECKING:\n"
        "    from pkg.types import Q\n"
        "def run(x):\n"
        '    """Solve."""\n'
        "    from pkg import lazy\n"
        "    return x + 1\n"
    ),
}
OUTSIDE = {"pkg/lonely.py", "pkg/sub/other.py", "pkg/public/__init__.pyi", "pkg/public/two.py"}
REACHED = sorted(set(PACKAGE) - OUTSIDE)


@pytest.fixture
def source(tmp_path: Path) -> Path:
    for name, text in PACKAGE.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path


def test_a_closure_is_what_an_import_can_execute(source):
    """Also where imports run in a circle, and without a subpackage and what only that imports."""

    def names(**options: str) -> list[str]:
        return [file.relative_to(source).as_posix() for file in closure(STAGE, source, **options)]

    assert names() == REACHED
    without = [name for name in REACHED if not name.startswith("pkg/sub/") and name != "pkg/grid.py"]
    assert names(without=("pkg.sub",)) == without
    (source / "pkg/errors.py").write_text("import pkg.grid\n")
    assert names() == REACHED
    (source / "pkg/lazy.py").write_text("import pkg.gone\n")
    with pytest.raises(ModuleNotFoundError, match=r"lazy\.py imports pkg\.gone"):
        closure(STAGE, source)


@pytest.mark.parametrize(
    ("name", "old", "new", "acts"),
    [
        ("pkg/stages/contact.py", "return x + 1", "return (\n        x + 1  # one more\n    )", False),
        ("pkg/stages/contact.py", '"""Solve."""', '"""Solve it.\n\n    With care."""', False),
        ("pkg/lonely.py", "import", "import os\nimport", False),
        ("pkg/stages/contact.py", "memory_mb=260", "memory_mb=300", False),
        ("pkg/stages/contact.py", "STAGE = dict(memory_mb=260)", "STAGES = [dict(), dict()]", False),
        ("pkg/sub/other.py", "", "x = 1\n", False),
        ("pkg/stages/contact.py", "x + 1", "x + 2", True),
        ("pkg/stages/contact.py", "x + 1", "x + 1.0", True),
        ("pkg/stages/contact.py", '"""Solve."""', 'y = """Solve."""', True),
        ("pkg/stages/contact.py", "from pkg import lazy", "from pkg import lazy, lonely", True),
        ("pkg/sub/deep/__init__.py", "", "x = 1\n", True),
    ],
)
def test_an_edit_changes_the_hash_if_it_acts(source, name, old, new, acts):
    before = closure_hash(STAGE, source)
    text = (source / name).read_text()
    assert old in text
    (source / name).write_text(text.replace(old, new, 1))
    assert (closure_hash(STAGE, source) != before) is acts


def forget(monkeypatch: pytest.MonkeyPatch, kept: Path) -> None:
    """Act as a new process that finds this memory of parsed files."""
    monkeypatch.setattr(source_hash, "_memory", lambda: kept)
    source_hash.syntax.cache_clear()
    source_hash._kept.cache_clear()


@pytest.mark.parametrize("damage", ["none", "flip", "cut", "bytes", "folder", "other Python"])
def test_parsed_files_are_remembered_and_a_damaged_memory_is_not_used(source, tmp_path, monkeypatch, damage):
    kept = tmp_path / "cache/syntax.json"
    forget(monkeypatch, kept)
    first = closure_hash(STAGE, source)
    source_hash.keep()
    text = kept.read_text()
    digest = syntax(source / "pkg/grid.py", (source / "pkg/grid.py").read_bytes()).digest
    if damage == "folder":
        kept.unlink()
        kept.mkdir()
    elif damage == "other Python":
        monkeypatch.setattr("roughslip.compilation.source_hash.sys.version", "3.99")
    else:
        changes = {"none": text, "flip": text.replace(digest, digest[::-1]), "cut": text[:-9], "bytes": f"\udcff{text}"}
        kept.write_bytes(changes[damage].encode(errors="surrogateescape"))
    forget(monkeypatch, kept)
    if damage == "none":
        monkeypatch.setattr("roughslip.compilation.source_hash.ast.parse", None)
    else:
        assert source_hash._kept() == {}
    assert closure_hash(STAGE, source) == first
    source_hash.keep()  # where it cannot be written, this passes without a message


# Libraries are imported once, and each stage then in a child, so that no stage sees the imports of another.
ASK = """
import json, os, sys
import numpy, numba, xarray, netCDF4, scipy.optimize, scipy.special, scipy.stats, seaborn
found = {}
for modules in sys.argv[1:]:
    reading, writing = os.pipe()
    if os.fork() == 0:
        for module in modules.split():
            __import__(module)
        files = [m.__file__ for n, m in sys.modules.items() if n.partition(".")[0] == "roughslip"]
        os.write(writing, json.dumps(files).encode())
        os._exit(0)
    os.close(writing)
    with open(reading) as answer:
        found[modules] = json.load(answer)
    os.wait()
print(json.dumps(found))
"""


@pytest.mark.parametrize("stage", ["karhunen_loeve", "contact_square", "contact_strip", "expansion_strip", "report"])
def test_an_edit_of_friction_statistics_solves_no_contact_again(stage):
    friction = {path.stem for path in closure(f"roughslip.stages.{stage}", SOURCE) if path.parent.name == "friction"}
    assert friction <= {"__init__", "bowden_tabor"}


def test_an_edit_of_one_figure_draws_no_other_again():
    """Each figure has the code of its own drawing, next to that of all figures."""
    drawn = {stage.draws: stage.modules for stage in declarations().values() if stage.draws}
    drawings = {name: SOURCE / f"roughslip/figures/{name}.py" for name in drawn}
    for name, modules in drawn.items():
        files = set(closure(modules, SOURCE))
        assert files & set(drawings.values()) == {drawings[name]}
        assert SOURCE / "roughslip/stages/figures.py" in files


@pytest.mark.slow
def test_the_closure_of_a_stage_is_what_python_imports():
    """So an edit of a module re-runs the stages that execute it, and no others."""
    codes = [stage.modules for stage in declarations().values()]
    command = [sys.executable, "-W", "ignore", "-c", ASK, *codes]
    run = subprocess.run(command, capture_output=True, text=True, check=True, env={"PYTHONPATH": str(SOURCE)})
    for modules, files in json.loads(run.stdout).items():
        found = {path.resolve() for path in closure(modules, SOURCE)}
        assert found == {Path(file).resolve() for file in files}, modules


@pytest.mark.slow
def test_an_edit_of_a_function_changes_the_digest_of_its_module():
    for path in MODULES:
        tree = ast.parse(path.read_text("utf-8"))
        functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
        if functions:
            functions[-1].body.append(*ast.parse("_edited = 1").body)
            edited = ast.unparse(ast.fix_missing_locations(tree)).encode()
            assert syntax(path, edited).digest != syntax(path, path.read_bytes()).digest, path
