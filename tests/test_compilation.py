"""The cache of compiled functions: named by code, shared by processes, checked when it is read, and not needed."""

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
@pytest.mark.parametrize("disk", ["no folder", "full"])
def test_where_nothing_can_be_kept_a_line_says_so(project, disk):
    (project / "file").write_text("")
    script = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0)); {OUTER}" if disk == "full" else OUTER
    folder = project / "numba" if disk == "full" else project / "file/numba"
    out, error = run(project, script, NUMBA_CACHE_DIR=str(folder))
    assert out == "20"
    assert error.count("compiled code is not kept") == 1
    assert compiled_files(project) == []


LAW = """
from typing import NamedTuple
from roughslip.compilation.cache import compiled
from roughslip.inner import LAWS, g

class Own(NamedTuple):
    a: float

@compiled()
def friction(law):
    return 2 * law.a

LAWS[Own] = lambda law: friction(law)
print(g((Own(5.0),)))
"""
OF_ANY_LAW = """
from numba.extending import overload
from roughslip.compilation.cache import compiled

LAWS = {}
def of(law): ...

@overload(of)
def _of(law):
    return LAWS[law.instance_class]

@compiled()
def g(laws):
    return of(laws[0])
"""


@pytest.mark.slow
def test_a_law_in_a_file_of_the_user_is_kept_and_an_edit_of_it_is_seen(project, tmp_path):
    """The type of its parameters is all that numba sees of it in the functions of the package."""
    (project / "src/roughslip/inner.py").write_text(OF_ANY_LAW)
    own = tmp_path / "own.py"
    for law, answer in ((LAW, "10.0"), (LAW.replace("2 *", "3 *"), "15.0")):
        own.write_text(law)
        first, again = (run(project, f"import sys; sys.path.append({str(tmp_path)!r}); import own") for _ in range(2))
        assert first[0] == answer
        assert again == (answer, "")


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
