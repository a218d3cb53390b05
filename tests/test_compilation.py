"""The cache of compiled functions: named by code and shared by processes.

Import closures and hashes of what code does: on a small package written to disk, and on this one.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import roughslip
from roughslip.compilation import source_hash
from roughslip.compilation.source_hash import closure, closure_hash
from roughslip.study.graph import STAGES

COPIED = Path(roughslip.__file__).parent
OUTER = "from roughslip.outer import g; print(g())"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project with a compiled function that calls one in another file."""
    package = tmp_path / "src" / "roughslip"
    package.mkdir(parents=True)
    for name in ("__init__.py", "__init__.pyi", "public_names.py", "atomic_write.py"):
        shutil.copy(COPIED / name, package)
    shutil.copytree(COPIED / "compilation", package / "compilation")
    inner = '"""Inner."""\nfrom roughslip.compilation.cache import compiled\n\n@compiled()\ndef f():\n    return 2\n'
    (package / "inner.py").write_text(inner)
    outer = "from roughslip.compilation.cache import compiled\nfrom roughslip.inner import f\n\n@compiled()\ndef g():\n"
    (package / "outer.py").write_text(outer + "    return 10 * f()\n")
    (tmp_path / "pyproject.toml").write_text("")
    return tmp_path


def start(project: Path, script: str, **variables: str) -> subprocess.Popen:
    environment = {**os.environ, "NUMBA_CACHE_DIR": "", "PYTHONPATH": str(project / "src"), **variables}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([sys.executable, "-c", script], env=environment, **pipes)


def run(project: Path, script: str, **variables: str) -> tuple[str, str]:
    process = start(project, script, **variables)
    out, error = process.communicate()
    assert process.returncode == 0, error
    return out.strip(), error


def edit(project: Path, old: str, new: str) -> None:
    inner = project / "src" / "roughslip" / "inner.py"
    inner.write_text(inner.read_text().replace(old, new))


def compiled_files(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.nbc"))


@pytest.mark.slow
def test_equal_code_is_compiled_once(project, tmp_path):
    """Also after two processes that compile together, after edits of docstrings, and in another folder."""
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "shared")}
    processes = [start(project, OUTER, **cache) for _ in range(2)]
    assert [process.communicate()[0].strip() for process in processes] == ["20", "20"]
    files = compiled_files(tmp_path / "shared")
    assert len(files) == 2
    edit(project, '"""Inner."""', '"""Another text,\n\nlonger."""\n# and a comment')
    shutil.copytree(project / "src", tmp_path / "copy" / "src")
    assert run(tmp_path / "copy", OUTER, **cache) == ("20", "")
    assert compiled_files(tmp_path / "shared") == files


@pytest.mark.slow
def test_an_edit_in_a_called_file_reaches_compiled_callers(project):
    """numba alone would return 20 again: it compares the file of the caller only."""
    assert run(project, OUTER)[0] == "20"
    edit(project, "2", "3")
    assert run(project, OUTER)[0] == "30"


@pytest.mark.slow
def test_options_of_a_caller_do_not_reach_what_it_calls(project):
    """numba alone would compile `f` with the options of whichever caller comes first, and bits depend on them."""
    edit(project, "def f():\n    return 2", "def f(x=0.0):\n    return 1.0 / x")
    outer = project / "src" / "roughslip" / "outer.py"
    outer.write_text(outer.read_text().replace("@compiled()", '@compiled(error_model="python")'))
    assert run(project, OUTER)[0] == "inf"


SOURCE = Path(source_hash.__file__).resolve().parents[2]
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


@pytest.mark.slow
def test_the_closure_of_a_stage_is_what_python_imports():
    """So an edit of a module re-runs the stages that execute it, and no others."""
    codes = [stage.modules for stage in STAGES.values() if stage.modules]
    command = [sys.executable, "-W", "ignore", "-c", ASK, *codes]
    run = subprocess.run(command, capture_output=True, text=True, check=True, env={"PYTHONPATH": str(SOURCE)})
    for modules, files in json.loads(run.stdout).items():
        sources = {path.resolve() for path in closure(modules, SOURCE)}
        assert sources == {Path(file).resolve() for file in files}, modules
