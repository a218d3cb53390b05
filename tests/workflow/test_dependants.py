"""Whatever function of the package is edited, the stages that can run it have another hash, and no others.

What a stage can run is asked of Python: every stage is imported in a process of its own, and its modules are listed.
"""

from __future__ import annotations

import ast
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from roughslip.scene.rules import SLICES
from roughslip.source_hash import _parsed, closure
from workflow.keys.closure import code_hash

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src"
MODULES = sorted((SOURCE / "roughslip").rglob("*.py"))

# Libraries are imported once; each stage then in a child, so that one does not see what another imported.
ASK = """
import json, os, sys
import numpy, numba, xarray, netCDF4, scipy.optimize, scipy.special, scipy.stats, seaborn
found = {}
for stage in sys.argv[1:]:
    reading, writing = os.pipe()
    if os.fork() == 0:
        __import__(f"roughslip.stages.{stage}")
        files = [m.__file__ for n, m in sys.modules.items() if n.partition(".")[0] == "roughslip"]
        os.write(writing, json.dumps(files).encode())
        os._exit(0)
    os.close(writing)
    with open(reading) as answer:
        found[stage] = json.load(answer)
    os.wait()
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def imported() -> dict[str, set[Path]]:
    """The files of the package that each stage has imported when it starts."""
    command = [sys.executable, "-W", "ignore", "-c", ASK, *sorted(SLICES)]
    run = subprocess.run(command, capture_output=True, text=True, check=True, env={"PYTHONPATH": str(SOURCE)})
    return {stage: {Path(file) for file in files} for stage, files in json.loads(run.stdout).items()}


def test_the_closure_of_a_stage_is_what_python_imports(imported):
    for stage, files in imported.items():
        found = {path.resolve() for path in closure(f"roughslip.stages.{stage}", SOURCE)}
        assert found == {path.resolve() for path in files}, stage


def edited(source: str, number: int) -> str:
    """The source with one function that does something more; `number` counts functions from the top."""
    tree = ast.parse(source)
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    functions[number % len(functions)].body.append(*ast.parse("_edited = 1").body)
    return ast.unparse(ast.fix_missing_locations(tree))


def has_functions(path: Path) -> bool:
    return "def " in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "path", [path for path in MODULES if has_functions(path)], ids=lambda path: path.relative_to(SOURCE).as_posix()
)
def test_an_edit_of_any_function_changes_what_its_file_does(path):
    """Every function of every module; with the closures above, what it re-runs."""
    source = path.read_text(encoding="utf-8")
    before = _parsed(path, ast.unparse(ast.parse(source)).encode()).digest
    functions = sum(isinstance(node, ast.FunctionDef) for node in ast.walk(ast.parse(source)))
    found = {_parsed(path, edited(source, number).encode()).digest for number in range(functions)}
    assert before not in found


def test_hashes_follow_the_closures(tmp_path):
    """The last step, on a copy of the package: one edit in each subject, and every stage asked for its hash."""
    shutil.copytree(SOURCE, tmp_path / "src", ignore=shutil.ignore_patterns("__pycache__"))
    copy, lock = tmp_path / "src", ROOT / "requirements.lock"

    def hashes() -> dict[str, str]:
        return {stage: code_hash(f"roughslip.stages.{stage}", copy, lock) for stage in SLICES}

    before = hashes()
    for name in ("surface/embedding", "contact/dense", "chaos/local", "friction/marginal", "oscillator/run", "store"):
        path = copy / "roughslip" / f"{name}.py"
        source = path.read_text(encoding="utf-8")
        path.write_text(edited(source, 0), encoding="utf-8")
        after = hashes()
        path.write_text(source, encoding="utf-8")
        changed = {stage for stage in SLICES if after[stage] != before[stage]}
        assert changed == {stage for stage in SLICES if path in closure(f"roughslip.stages.{stage}", copy)}
        assert changed
