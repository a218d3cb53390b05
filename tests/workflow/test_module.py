"""Ways to the study: as a module of another workflow, from an address, from another Python.

A figure and a scene key are added as CONTRIBUTING.md says. Results do not depend on batches or on the number of jobs,
hold what made them, and go elsewhere from a source tree that is read-only.
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
from roughslip.errors import InputError
from roughslip.study.graph import STAGES
from tests.workflow.project import Project, as_a_user, copy_project
from workflow.study.scenes import Scenes, check_config, scene_folders

ROOT = Path(__file__).resolve().parents[2]
MODULE = """\
module roughslip:
    snakefile: {snakefile}
    config: {config}

use rule * from roughslip as roughslip_*

rule mine:
    default_target: True
    input: "results/mine/surface/modes.nc"
    output: "copied.nc"
    shell: "cp {{input}} {{output}}"
"""
NO_NUMPY = "import sys; sys.modules['numpy'] = None; from snakemake.cli import main; main(['-n'])"


def snakemake(project: Project, folder: Path, *words: str) -> subprocess.CompletedProcess:
    """A run in a folder of the caller."""
    command = [sys.executable, "-m", "snakemake", "-j1", *words]
    return subprocess.run(command, capture_output=True, **{**project.options, "cwd": folder})


def jobs(dry_run: subprocess.CompletedProcess) -> dict[str, int]:
    """Jobs by rule that a dry run announces."""
    assert dry_run.returncode == 0, dry_run.stderr
    return {name: int(count) for name, count in re.findall(r"^(\w+) +(\d+)$", dry_run.stdout, re.MULTILINE)}


@pytest.mark.slow
def test_a_module_makes_the_scenes_of_its_caller(empty, tmp_path):
    """A folder with a workflow and a scene of its own, which extends one of the project."""
    (tmp_path / "cases").mkdir()
    (tmp_path / "cases/mine.yaml").write_text("extends: tiny\nseed: 5\n")
    text = MODULE.format(snakefile=repr(str(empty.path("Snakefile"))), config={"scenes_folder": "cases"})
    (tmp_path / "Snakefile").write_text(text)
    profile = ("--workflow-profile", str(empty.path("profiles/default")))
    made = snakemake(empty, tmp_path, *profile)
    assert made.returncode == 0, made.stderr
    assert "modes" in store.read(tmp_path / "copied.nc")
    assert "Nothing to be done" in snakemake(empty, tmp_path, *profile).stderr
    whole = jobs(snakemake(empty, tmp_path, "roughslip_mine", "-n", *profile))  # the rule of the scene itself
    assert whole["roughslip_page"] == whole["roughslip_publish"] == 1


@pytest.mark.slow
def test_an_address_and_another_python_end_in_a_line(empty, tmp_path):
    """Snakemake fetches single files of rules from an address, not the code of the study."""
    folder = empty.copy(tmp_path / "repository").folder
    for words in ("init -q", "add Snakefile workflow", "commit -q -m all", "tag v1"):
        author = ("-c", "user.name=test", "-c", "user.email=test@localhost")
        subprocess.run(["git", *author, *words.split()], cwd=folder, check=True, capture_output=True)
    source = f"gitfile({str(folder)!r}, path='workflow/Snakefile', tag='v1')"
    (tmp_path / "Snakefile").write_text(MODULE.format(snakefile=source, config={"scenes": "tiny"}))
    ended = snakemake(empty, tmp_path, "-n")
    assert (ended.returncode, len(ended.stderr.splitlines())) == (1, 1)
    assert "clone the project" in ended.stderr
    ended = subprocess.run([sys.executable, "-c", NO_NUMPY], capture_output=True, **empty.options)
    (line,) = [line for line in ended.stderr.splitlines() if "profile" not in line]
    assert ended.returncode == 1
    assert "has no numpy: `make setup`" in line


def test_scenes_of_a_caller_are_added_to_the_shipped_ones(tmp_path):
    (tmp_path / "mine.yaml").write_text("extends: smoke\nseed: 5\n")
    own = str(tmp_path)
    scenes = Scenes(ROOT, ["mine"], own=own)
    assert scenes.asked == ["mine"]
    assert scenes["mine"] == {**scenes["smoke"], "seed": 5}
    assert check_config({"scenes_folder": own}, scenes.names)["scenes"] == ["mine"]
    (tmp_path / "smoke.yaml").write_text("extends: paper\n")
    with pytest.raises(InputError, match="a shipped scene has this name"):
        scene_folders(ROOT, own)
    for wrong in ("nowhere", 3, str(ROOT / "docs")):
        with pytest.raises(InputError, match=r"scenes_folder: .* has no scene"):
            scene_folders(ROOT, wrong)


FIGURE = '''"""Slopes along the sliding direction."""

import numpy as np
from matplotlib.figure import Figure

from roughslip.figures.style import Shown, panels


def figure_slopes(result: Shown) -> Figure:
    """Histogram of the slopes of all modes."""
    figure, axes = panels(1, 1, 4.0)
    axes.hist(np.diff(result["modes"].values, axis=1).ravel(), 20)
    axes.set(xlabel="Slope", ylabel="Nodes")
    return figure
'''
ROW = """_ROWS = (
    figure(name="figure_slopes", of="karhunen_loeve", caption="Slopes of the square along the sliding direction."),
"""


@pytest.mark.slow
def test_a_figure_is_a_row_and_its_drawing(empty, tmp_path):
    copy = empty.copy(tmp_path / "copy")
    copy.path("src/roughslip/figures/figure_slopes.py").write_text(FIGURE)
    copy.edit("src/roughslip/study/graph.py", "_ROWS = (\n", ROW)
    copy.scene("steep", "extends: tiny\ntargets: [figure_slopes]\n")
    planned = jobs(snakemake(copy, copy.folder, "-n", "steep"))
    assert {"karhunen_loeve", "figures", "page"} <= planned.keys()
    assert "contact_square" not in planned
    copy.make("-j1", "results/steep/figure_slopes.png", "results/steep/figure_slopes.svg")
    assert copy.path("results/steep/figure_slopes.svg").is_file()


# Strips two by two, so that those that train fall into two batches.
SPLIT = """\
extends: tiny
jobs: 4
"""
BATCHED = {"contact/square-*": 12, "contact/blocks-*": 4, "friction/expansion-*": 4}

# What sums up batches; one figure, as figures draw what is stored in these.
SUMMED_UP = (
    *("chaos/square.nc", "chaos/strip.nc", "friction/statistics.nc", "summary.csv"),
    *("oscillator/deterministic.nc", "oscillator/statistics.nc", "figure5.nc", "figure5.png", "figure5.svg"),
    "claims.json",
)


@pytest.mark.slow
def test_results_are_the_same_bit_for_bit_in_other_batches(shared):
    """Made in large batches by one job at a time, and in small ones by two: other names from there on."""
    shared.scene("split", SPLIT)
    shared.make("-j2", *(f"results/split/{name}" for name in SUMMED_UP))
    tiny, split = shared.path("results/tiny"), shared.path("results/split")
    assert [name for name in SUMMED_UP if (tiny / name).read_bytes() != (split / name).read_bytes()] == []
    for pattern, count in BATCHED.items():
        stored = split.parent.glob(f"store/*/*/{pattern}")
        counts = sorted(Counter(path.parents[1].name for path in stored).values())
        assert counts[-1] == count  # of `split`
        assert len(list(tiny.glob(pattern))) < count


@pytest.mark.slow
def test_every_result_carries_what_made_it(finished):
    folder, stored = finished.path("results/tiny"), set()
    for file in folder.glob("keys/*.json"):
        key, row = json.loads(file.read_text()), STAGES[file.stem]
        files = (
            ["figure*.nc"] if row.name == "figures" else [re.sub(r"\{.*\}", "*", name) for name in row.results.values()]
        )
        for path in (path for name in files for path in folder.glob(name)):
            if path.suffix == ".nc":
                stored.add(path)
                with netCDF4.Dataset(path) as result:
                    assert json.loads(result.configuration) == key["configuration"]
                    assert result.code_hash == key["code"]
                    assert result.seed == str(key["configuration"].get("seed", "none used"))
                    assert {"python", "numpy", "scipy", "numba"} <= set(json.loads(result.versions))
                    labels = [variable.ncattrs() for variable in result.variables.values()]
                    assert all({"units", "long_name"} <= set(names) for names in labels)
    assert stored == set(folder.rglob("*.nc"))


@pytest.mark.slow
def test_results_go_elsewhere_from_a_read_only_tree_without_a_home(tmp_path):
    """The project lies in a folder whose name has spaces and letters beyond ASCII."""
    source, home, elsewhere = tmp_path / "read only é β", tmp_path / "home", tmp_path / "results é"
    copy_project(source)
    home.mkdir(mode=0o555)
    elsewhere.mkdir()
    paths = [source, *source.rglob("*")]
    for path in paths:
        path.chmod(path.stat().st_mode & ~(stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH))
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("XDG_", "NUMBA_", "MPL"))}
    own = {"HOME": str(home), "PYTHONPATH": str(source / "src"), "PYTHONDONTWRITEBYTECODE": "1"}
    own["XDG_CACHE_HOME"] = str(elsewhere / ".cache")  # as the Makefile sets it
    command = ["-m", "snakemake", "-j1", "-s", str(source / "Snakefile"), "results/tiny/surface/modes.nc"]
    made = subprocess.run(
        [sys.executable, *command],
        cwd=elsewhere,
        env=kept | own,
        capture_output=True,
        text=True,
        preexec_fn=as_a_user(),
    )
    for path in paths:
        path.chmod(path.stat().st_mode | stat.S_IWUSR)
    assert made.returncode == 0, made.stdout[-3000:] + made.stderr[-3000:]
    assert "modes" in store.read(elsewhere / "results/tiny/surface/modes.nc")
    assert list(home.iterdir()) == []
    assert not (source / "results").exists()
