"""Where a project may lie and who may run it: any path, a source tree that is read-only, no home to write to.

Results do not depend on batches or on the number of jobs, and hold their configuration and code hash.
"""

from __future__ import annotations

import json
import os
import re
import stat
import subprocess
import sys
from collections import Counter
from pathlib import Path

import netCDF4
import pytest

from roughslip import store
from roughslip.scene.declarations import declarations
from roughslip.scene.plan import stages_needed
from tests.workflow.project import as_a_user, copy_project
from workflow.study.scenes import Scenes

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
NUMBA = "from roughslip.compilation.source_hash import compiled_folder; print(compiled_folder())"


@pytest.fixture
def source(tmp_path: Path):
    """A read-only project in a folder whose name has spaces and letters beyond ASCII."""
    folder = tmp_path / "read only é β" / "project"
    copy_project(folder)
    paths = [folder, *folder.rglob("*")]
    for path in paths:
        path.chmod(path.stat().st_mode & ~(stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH))
    yield folder
    for path in paths:
        path.chmod(path.stat().st_mode | stat.S_IWUSR)


@pytest.fixture
def home(tmp_path: Path):
    """A home that cannot be written to."""
    folder = tmp_path / "home"
    folder.mkdir()
    folder.chmod(0o555)
    yield folder
    folder.chmod(0o755)


def run(source: Path, home: Path, elsewhere: Path, *command: str, **more: str) -> subprocess.CompletedProcess:
    """A command in a working folder of its own, by one who may not overrule permissions."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("XDG_", "NUMBA_", "MPL"))}
    environment = {**kept, "HOME": str(home), "PYTHONPATH": str(source / "src"), "PYTHONDONTWRITEBYTECODE": "1", **more}
    return subprocess.run(
        [sys.executable, *command],
        cwd=elsewhere,
        env=environment,
        capture_output=True,
        text=True,
        preexec_fn=as_a_user(),
    )


def test_results_go_elsewhere_from_a_read_only_tree_without_a_home(source, home, tmp_path):
    elsewhere = tmp_path / "results é"
    elsewhere.mkdir()
    target = "results/tiny/surface/design.nc"
    command = ("-m", "snakemake", "-j1", "-s", str(source / "Snakefile"), target)
    made = run(source, home, elsewhere, *command, XDG_CACHE_HOME=str(elsewhere / ".cache"))  # as the Makefile sets it
    assert made.returncode == 0, made.stdout[-3000:] + made.stderr[-3000:]
    assert set(store.read(elsewhere / target)) >= {"latin_hypercube", "expansion"}
    assert list(home.iterdir()) == []
    assert not (source / "results").exists()


def test_compiled_functions_go_where_they_can(source, home, tmp_path):
    """Neither the project nor the home will have them: the working folder does."""
    found = run(source, home, tmp_path, "-c", NUMBA).stdout.strip()
    assert Path(found) == tmp_path / ".cache" / "numba"
    home.chmod(0o755)
    assert Path(run(source, home, tmp_path, "-c", NUMBA).stdout.strip()) == home / ".cache/roughslip/numba"


# Strips two by two, so that those that train fall into two batches.
SPLIT = """\
extends: tiny
jobs: 4
"""
BATCHED = {"contact/square-*": 12, "contact/strip-*": 4, "friction/expansion-*": 4, "oscillator/ensemble-*": 4}

# What sums up batches; one figure, as figures draw what is stored in these.
SUMMED_UP = (
    *("chaos/square.nc", "chaos/strip.nc", "friction/statistics.nc", "summary.csv"),
    *("oscillator/deterministic.nc", "oscillator/statistics.nc", "figure5.nc", "figure5.png", "figure5.svg"),
    "claims.json",
)


@pytest.fixture(scope="module")
def both(shared):
    """The scene made in large batches by one job at a time, and in small ones by two: other names from there on."""
    shared.scene("split", SPLIT)
    shared.make("-j2", *(f"results/split/{name}" for name in SUMMED_UP))
    return shared.path("results/tiny"), shared.path("results/split")


def test_results_are_the_same_bit_for_bit(both):
    """Each result that combines batches."""
    tiny, split = both
    assert [name for name in SUMMED_UP if (tiny / name).read_bytes() != (split / name).read_bytes()] == []


def test_the_batches_were_others(both):
    tiny, split = both
    for pattern, count in BATCHED.items():
        stored = split.parent.glob(f"store/*/*/{pattern}")
        counts = sorted(Counter(path.parents[1].name for path in stored).values())
        assert counts[-1] == count  # of `split`
        assert len(list(tiny.glob(pattern))) < count


def test_every_result_carries_what_made_it(shared):
    folder, found = shared.path("results/tiny"), set()
    for stage in stages_needed(Scenes(shared.folder, ["tiny"])["tiny"]):
        key = json.loads((folder / f"keys/{stage}.json").read_text())
        for path in folder.glob(re.sub(r"\{.*\}", "*", declarations()[stage].result)):
            if path.suffix == ".nc":
                found.add(path)
                with netCDF4.Dataset(path) as result:
                    assert json.loads(result.configuration) == key["configuration"]
                    assert result.code_hash == key["code"]
                    assert result.seed == str(key["configuration"].get("seed", "none used"))
                    assert {"python", "numpy", "scipy", "numba"} <= set(json.loads(result.versions))
                    labels = [variable.ncattrs() for variable in result.variables.values()]
                    assert all({"units", "long_name"} <= set(names) for names in labels)
    assert found == set(folder.rglob("*.nc"))
