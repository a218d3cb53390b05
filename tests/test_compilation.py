"""The cache of compiled functions, named by code and shared by processes; import closures of stages."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import roughslip
from roughslip.compilation import source_hash
from roughslip.compilation.source_hash import closure
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
