"""Where compiled functions are cached: a folder a module, named by what its import closure does."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import roughslip

SOURCE = Path(roughslip.__file__).parent
OUTER = "from roughslip.outer import g; print(g())"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project with a compiled function that calls one in another file."""
    package = tmp_path / "src" / "roughslip"
    package.mkdir(parents=True)
    for name in ("__init__.py", "compilation.py", "source_hash.py"):
        shutil.copy(SOURCE / name, package)
    inner = '"""Inner."""\nfrom roughslip.compilation import compiled\n\n@compiled()\ndef f():\n    return 2\n'
    (package / "inner.py").write_text(inner)
    outer = "from roughslip.compilation import compiled\nfrom roughslip.inner import f\n\n@compiled()\ndef g():\n"
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


def test_a_second_process_compiles_nothing_and_only_the_first_announces_it(project):
    out, error = run(project, OUTER)
    assert out == "20"
    assert "compiling" in error
    files = compiled_files(project / ".cache" / "numba")
    assert len(files) == 2
    assert run(project, OUTER) == ("20", "")
    assert compiled_files(project / ".cache" / "numba") == files


def test_an_edit_in_a_called_file_reaches_compiled_callers(project):
    """numba alone would answer 20 again: it looks at the caller's file only."""
    assert run(project, OUTER)[0] == "20"
    edit(project, "2", "3")
    assert run(project, OUTER)[0] == "30"


def test_docstrings_and_comments_compile_nothing(project):
    run(project, OUTER)
    edit(project, '"""Inner."""', '"""Another text,\n\nlonger."""\n# and a comment')
    assert run(project, OUTER) == ("20", "")


def test_equal_code_in_another_folder_is_not_compiled_again(project, tmp_path):
    cache = str(tmp_path / "shared")
    run(project, OUTER, NUMBA_CACHE_DIR=cache)
    shutil.copytree(project / "src", tmp_path / "copy" / "src")
    assert run(tmp_path / "copy", OUTER, NUMBA_CACHE_DIR=cache) == ("20", "")


def test_two_processes_that_start_together_compile_once(project):
    processes = [start(project, OUTER) for _ in range(2)]
    assert [process.communicate()[0].strip() for process in processes] == ["20", "20"]
    assert len(compiled_files(project / ".cache" / "numba")) == 2


def test_without_a_project_the_cache_is_the_users(project, tmp_path):
    (project / "pyproject.toml").unlink()
    run(project, OUTER, XDG_CACHE_HOME=str(tmp_path / "user"))
    assert len(compiled_files(tmp_path / "user" / "roughslip" / "numba")) == 2
