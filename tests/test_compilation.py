"""The cache of compiled functions, named by code and shared by processes; import closures and their hashes."""

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
INNER = '"""Inner."""\nfrom roughslip.compilation.cache import compiled\n\n@compiled()\ndef f():\n    return 2\n'
OUTER = INNER.replace("\n\n@", "\nfrom roughslip.inner import f\n\n@").replace(
    "f():\n    return 2", "g():\n    return 10 * f()"
)


@pytest.mark.slow
def test_equal_code_is_compiled_once_and_an_edit_reaches_callers_in_other_files(tmp_path):
    """Equal after two processes that compile together, after edits of docstrings, and in another folder. numba alone
    compares the file of the caller only. It compiles `f` with the options of its first caller, and bits depend on them.
    """
    package, cache = tmp_path / "src/roughslip", tmp_path / "shared"
    package.mkdir(parents=True)
    for name in ("__init__.py", "__init__.pyi", "public_names.py", "atomic_write.py"):
        shutil.copy(COPIED / name, package)
    shutil.copytree(COPIED / "compilation", package / "compilation")
    (tmp_path / "pyproject.toml").write_text("")
    (package / "inner.py").write_text(INNER)
    (package / "outer.py").write_text(OUTER)

    def start(folder: Path, program: str = "from roughslip.outer import g; print(g())") -> subprocess.Popen:
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": str(folder)}
        return subprocess.Popen(
            [sys.executable, "-c", program], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    said = [process.communicate() for process in [start(tmp_path / "src") for _ in range(2)]]
    assert [found for found, _ in said] == ["20\n"] * 2
    assert ["compiling" in messages for _, messages in said].count(True) == 1  # the other process waits for it
    files = sorted(cache.rglob("*.nbc"))
    assert len(files) == 2
    (package / "inner.py").write_text(INNER.replace("Inner.", "Another text,\n\nlonger.") + "# and a comment\n")
    shutil.copytree(tmp_path / "src", tmp_path / "copy")
    assert start(tmp_path / "copy").communicate()[0] == "20\n"
    assert sorted(cache.rglob("*.nbc")) == files
    (package / "inner.py").write_text(INNER.replace("f():\n    return 2", "f(x=0.0):\n    return 1.0 / x"))
    (package / "outer.py").write_text(OUTER.replace("@compiled()", '@compiled(error_model="python")'))
    assert start(tmp_path / "src").communicate()[0] == "inf\n"
    (package / "area.py").write_text(INNER.replace("f():\n    return 2", "area(p):\n    return p.x"))
    for name in ("small", "renamed"):  # the module of an argument's type, which numba imports by its old name
        (package / f"{name}.py").write_text("from typing import NamedTuple\n\nclass P(NamedTuple):\n    x: float\n")
        program = f"from roughslip.area import area; from roughslip.{name} import P; print(area(P(2.0)))"
        assert start(tmp_path / "src", program).communicate()[0] == "2.0\n"
        (package / f"{name}.py").unlink()


SOURCE = Path(source_hash.__file__).resolve().parents[2]
STAGE = "pkg.stages.contact"
# A stage that reaches each module in another way; `lonely` and `two` are outside its closure.
PACKAGE = {
    "pkg/__init__.py": "",
    "pkg/errors.py": "class E(Exception): pass\n",
    "pkg/lazy.py": "import os\n",
    "pkg/types.py": "from pkg import errors as _\n",
    "pkg/lonely.py": "import pkg.stages.contact\n",
    "pkg/sub/__init__.py": "from ..errors import E\n",
    "pkg/sub/leaf.py": "import numpy\n",
    "pkg/public/__init__.py": "",
    "pkg/public/__init__.pyi": "from pkg.public.one import A as A\nfrom pkg.public.two import B as B\n",
    "pkg/public/one.py": "A = 1\n",
    "pkg/public/two.py": "B = 2\n",
    "pkg/stages/__init__.py": "",
    "pkg/stages/contact.py": """\
from __future__ import annotations
from typing import TYPE_CHECKING
import pkg.sub.leaf as leaf
from pkg.public import A
if TYPE_CHECKING:
    from pkg.types import Q
def run(x):
    'Solve.'
    from pkg import lazy
    return x + 1
""",
}
OUTSIDE = {"pkg/lonely.py", "pkg/public/__init__.pyi", "pkg/public/two.py"}
EDITS = [  # and whether they act
    ("pkg/stages/contact.py", "Solve.", "Solve it, with care.", False),
    ("pkg/lonely.py", "import", "import os\nimport", False),
    ("pkg/stages/contact.py", "x + 1", "x + 1.0", True),
    ("pkg/stages/contact.py", "from pkg import lazy", "from pkg import lazy, lonely", True),
    ("pkg/sub/__init__.py", "from", "x = 1\nfrom", True),
]


def test_a_closure_is_what_an_import_can_execute_and_its_hash_changes_where_an_edit_acts(tmp_path):
    """Also where imports run in a circle, and without a subpackage and what only that imports."""
    for name, text in PACKAGE.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)

    def names(**options: str) -> list[str]:
        return [file.relative_to(tmp_path).as_posix() for file in closure(STAGE, tmp_path, **options)]

    reached, before = sorted(set(PACKAGE) - OUTSIDE), closure_hash(STAGE, tmp_path)
    assert names() == reached
    assert names(without=("pkg.sub",)) == [name for name in reached if not name.startswith("pkg/sub/")]
    for name, old, new, acts in EDITS:
        assert old in PACKAGE[name]
        (tmp_path / name).write_text(PACKAGE[name].replace(old, new, 1))
        assert (closure_hash(STAGE, tmp_path) != before) is acts, new
        (tmp_path / name).write_text(PACKAGE[name])
    (tmp_path / "pkg/errors.py").write_text("import pkg.types\n")
    assert names() == reached
    (tmp_path / "pkg/lazy.py").write_text("import pkg.gone\n")
    with pytest.raises(ModuleNotFoundError, match=r"lazy\.py imports pkg\.gone"):
        closure(STAGE, tmp_path)


OF_SCENES = set(closure("roughslip.scene.schema", SOURCE))  # which the stage of the budget asks for sources
# Libraries are imported once, and each stage then in a child, so that no stage sees the imports of another.
ASK = """
import json, os, sys
import numpy, numba, xarray, netCDF4, scipy.optimize, scipy.special, scipy.stats, matplotlib.figure
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
    """So an edit of a module re-runs the stages that execute it, and no others; the check of scenes is no part."""
    codes = [stage.modules for stage in STAGES.values() if stage.modules]
    command = [sys.executable, "-W", "ignore", "-c", ASK, *codes]
    run = subprocess.run(command, capture_output=True, text=True, check=True, env={"PYTHONPATH": str(SOURCE)})
    for modules, files in json.loads(run.stdout).items():
        sources = set(closure(modules, SOURCE, ["roughslip.scene"]))
        imported = {file for file in map(Path, files) if file.parent.name != "scene"}
        assert sources <= imported <= sources | OF_SCENES, modules
