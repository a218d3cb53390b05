"""The cache of compiled functions: named by code, shared by processes, and checked when it is read."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import roughslip
from roughslip.compilation import cache as compilation

SOURCE = Path(roughslip.__file__).parent
OUTER = "from roughslip.outer import g; print(g())"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project with a compiled function that calls one in another file."""
    package = tmp_path / "src" / "roughslip"
    package.mkdir(parents=True)
    for name in ("__init__.py", "__init__.pyi", "public_names.py", "atomic_write.py"):
        shutil.copy(SOURCE / name, package)
    shutil.copytree(SOURCE / "compilation", package / "compilation")
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
    """By one of two processes that start together; not after edits of docstrings, and not in another folder."""
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "shared")}
    processes = [start(project, OUTER, **cache) for _ in range(2)]
    answers = [process.communicate() for process in processes]
    assert [out.strip() for out, _ in answers] == ["20", "20"]
    assert sum("compiling, once" in error for _, error in answers) == 1
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


@pytest.mark.slow
def test_calls_from_compiled_code_share_one_form_without_a_wrapper(project, tmp_path):
    """Constants as arguments make no forms of their own; a call from Python takes another form, of the same value."""
    edit(project, "def f():\n    return 2", "def f(x):\n    return 2 * x")
    outer = project / "src" / "roughslip" / "outer.py"
    outer.write_text(outer.read_text().replace("10 * f()", "f(3) + f(4)"))
    cache = tmp_path / "shared"
    script = f"{OUTER}; from roughslip.inner import f; print(f(7)); print(f(3) + f(4))"
    for _ in range(2):  # compiled, and read from the cache
        assert run(project, script, NUMBA_CACHE_DIR=str(cache))[0].split() == ["14"] * 3
    assert [file.name.split(".")[-3] for file in compiled_files(cache)] == ["inner", "outer", "outer"]


@pytest.mark.slow
def test_damaged_files_are_compiled_again(project, tmp_path):
    """Without a project the cache is that of the user."""
    (project / "pyproject.toml").unlink()
    user = {"XDG_CACHE_HOME": str(tmp_path / "user")}
    run(project, OUTER, **user)
    cache = tmp_path / "user" / "roughslip" / "numba"
    damaged = [*cache.glob("outer-*/*.nbc"), *cache.glob("inner-*/*.nbi")]
    assert len(damaged) == 2
    for file in damaged:
        content = bytearray(file.read_bytes())
        content[len(content) // 2] ^= 1
        file.write_bytes(content)
    out, error = run(project, OUTER, **user)
    assert out == "20"
    assert "compiling, once" in error
    assert run(project, OUTER, **user) == ("20", "")


def test_older_code_is_removed_after_a_month(tmp_path):
    folders = [tmp_path / name for name in ("contact.kernels-1", "contact.kernels-2", "contact.kernels-3", "chaos-1")]
    for folder in folders:
        folder.mkdir()
    for folder in (folders[0], folders[1], folders[3]):
        os.utime(folder, (1.0e9, 1.0e9))
    compilation._remove_old_versions(folders[0])
    assert sorted(tmp_path.iterdir()) == sorted([folders[0], *folders[2:]])
