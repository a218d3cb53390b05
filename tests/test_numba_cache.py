"""Where compiled functions are cached: a folder for exactly one state of the source."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import roughslip

INIT = Path(roughslip.__file__)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project whose package has this package's __init__ and a compiled function that calls one in another file."""
    package = tmp_path / "src" / "roughslip"
    package.mkdir(parents=True)
    shutil.copy(INIT, package / "__init__.py")
    (package / "inner.py").write_text("from numba import njit\n\n@njit(cache=True)\ndef f():\n    return 2\n")
    (package / "outer.py").write_text(
        "from numba import njit\nfrom roughslip.inner import f\n\n@njit(cache=True)\ndef g():\n    return 10 * f()\n"
    )
    (tmp_path / "pyproject.toml").write_text("")
    return tmp_path


def run(project: Path, script: str, **variables: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(project / "src"), **variables}
    out = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    return out.stdout.strip()


def folder(project: Path, **variables: str) -> Path:
    variables = {"NUMBA_CACHE_DIR": "", **variables}
    return Path(run(project, "import roughslip, os; print(os.environ['NUMBA_CACHE_DIR'])", **variables))


def test_cache_lies_in_the_project_and_follows_the_source(project):
    first = folder(project)
    assert first.parent == project / ".cache" / "numba"
    assert folder(project) == first
    (project / "src" / "roughslip" / "inner.py").write_text("x = 1\n")
    assert folder(project) != first


def test_a_users_own_folder_is_kept_but_a_parent_process_is_not_believed(project):
    assert folder(project, NUMBA_CACHE_DIR="/somewhere/mine") == Path("/somewhere/mine")
    assert folder(project, NUMBA_CACHE_DIR="/somewhere/roughslip-0123") == folder(project)


def test_installed_elsewhere_it_lies_in_the_users_cache(project, tmp_path):
    (project / "pyproject.toml").unlink()
    user = tmp_path / "user"
    assert folder(project, XDG_CACHE_HOME=str(user)).parent == user / "roughslip" / "numba"


def test_numba_imported_first_uses_it_too(project):
    script = "import numba, roughslip; print(numba.config.CACHE_DIR)"
    assert Path(run(project, script, NUMBA_CACHE_DIR="")) == folder(project)


def test_an_edit_in_a_called_file_reaches_compiled_callers(project):
    """numba alone would answer 20 again: it looks at the caller's file only."""
    script = "from roughslip.outer import g; print(g())"
    assert run(project, script) == "20"
    inner = project / "src" / "roughslip" / "inner.py"
    inner.write_text(inner.read_text().replace("2", "3"))
    assert run(project, script) == "30"
