"""Ways to the study: by its two Snakefiles, as a module of another workflow, from an address, from another Python.

The recipes of CONTRIBUTING.md, carried out in a copy of the project.

Where a project may lie and who may run it: any path, a source tree that is read-only, no home to write to.

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
from roughslip.errors import InputError
from roughslip.scene.declarations import declarations
from roughslip.scene.plan import stages_needed
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


@pytest.fixture
def caller(empty: Project, tmp_path: Path) -> Path:
    """A folder with a workflow and a scene of its own, which extends one of the project."""
    (tmp_path / "cases").mkdir()
    (tmp_path / "cases/mine.yaml").write_text("extends: tiny\nseed: 5\n")
    config = {"scenes_folder": "cases"}
    (tmp_path / "Snakefile").write_text(MODULE.format(snakefile=repr(str(empty.path("Snakefile"))), config=config))
    return tmp_path


def snakemake(project: Project, folder: Path, *words: str) -> subprocess.CompletedProcess:
    """A run in a folder of the caller."""
    command = [sys.executable, "-m", "snakemake", "-j1", *words]
    return subprocess.run(command, capture_output=True, **{**project.options, "cwd": folder})


def jobs(dry_run: subprocess.CompletedProcess) -> dict[str, int]:
    """Jobs by rule that a dry run announces."""
    assert dry_run.returncode == 0, dry_run.stderr
    return {name: int(count) for name, count in re.findall(r"^(\w+) +(\d+)$", dry_run.stdout, re.MULTILINE)}


@pytest.mark.slow
def test_a_module_makes_the_scenes_of_its_caller(empty, caller):
    profile = ("--workflow-profile", str(empty.path("profiles/default")))
    made = snakemake(empty, caller, *profile)
    assert made.returncode == 0, made.stderr
    assert set(store.read(caller / "copied.nc")) >= {"modes", "eigenvalue"}
    assert "Nothing to be done" in snakemake(empty, caller, *profile).stderr
    whole = jobs(snakemake(empty, caller, "roughslip_mine", "-n", *profile))  # the rule of the scene itself
    assert whole["roughslip_scene_report"] == whole["roughslip_publish"] == 1


@pytest.mark.slow
def test_both_snakefiles_make_the_same(empty, tmp_path):
    """From any folder, with `--directory` or without, and with the options of the default profile."""
    planned = []
    for snakefile in ("Snakefile", "workflow/Snakefile"):
        for words, folder in ((), tmp_path), (("--directory", str(tmp_path)), empty.folder):
            run = snakemake(empty, folder, "-n", "-s", str(empty.path(snakefile)), "tiny", *words)
            assert "profiles/default" in run.stderr
            planned.append(jobs(run))
    assert planned == [planned[0]] * 4
    assert planned[0]["contact"] == 1


@pytest.mark.slow
def test_an_address_ends_in_a_line(empty, tmp_path):
    """Snakemake fetches single files of rules from it, not the code of the study."""
    folder = empty.copy(tmp_path / "repository").folder
    for words in ("init -q", "add Snakefile workflow", "commit -q -m all", "tag v1"):
        author = ("-c", "user.name=test", "-c", "user.email=test@localhost")
        subprocess.run(["git", *author, *words.split()], cwd=folder, check=True, capture_output=True)
    source = f"gitfile({str(folder)!r}, path='workflow/Snakefile', tag='v1')"
    (tmp_path / "Snakefile").write_text(MODULE.format(snakefile=source, config={"scenes": "tiny"}))
    ended = snakemake(empty, tmp_path, "-n")
    assert ended.returncode == 1
    assert "clone the project" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


@pytest.mark.slow
def test_another_python_ends_in_a_line(empty):
    ended = subprocess.run([sys.executable, "-c", NO_NUMPY], capture_output=True, **empty.options)
    assert ended.returncode == 1
    lines = [line for line in ended.stderr.splitlines() if "profile" not in line]
    assert len(lines) == 1
    assert "has no numpy: `make setup`" in lines[0]


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


SECTION = '''"""Section `slopes` of a scene."""

from roughslip.scene.section import Section, number


class Slopes(Section):
    """Slopes of the square, of figure_slopes."""

    bins: int = number("Bins of the histogram", ge=2, le=1000)
'''

FIGURE = '''"""Slopes along the sliding direction."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from roughslip.figures.style import panels

DRAWN = ("modes",)


def figure_slopes(result: Mapping[str, np.ndarray], bins: int) -> Figure:
    """Histogram of the slopes of all modes."""
    figure, axes = panels(1, 1, 4.0)
    axes.hist(np.diff(result["modes"], axis=1).ravel(), bins)
    axes.set(xlabel="Slope", ylabel="Nodes")
    return figure
'''

STAGE = '''"""Stage figure_slopes: draw the slopes of the square."""

from functools import partial

from roughslip.figures.figure_slopes import DRAWN, figure_slopes
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import Job
from roughslip.stages.runtime.drawing import draw_and_save

STAGE = Stage(
    name="figure_slopes",
    reads="description slopes",
    many={"results": "karhunen_loeve"},
    result="figure_slopes.nc",
    target="figure_slopes",
    caption="Slopes of the square along the sliding direction.",
    memory_mb=320,
)


def work(job: Job) -> None:
    """Draw the figure and write its numbers."""
    draw_and_save(job, partial(figure_slopes, bins=job.scene.slopes.bins), DRAWN)
'''


@pytest.fixture
def copy(empty, tmp_path):
    return empty.copy(tmp_path / "copy")


def jobs_of(project, scene: str) -> str:
    return project.make("-n", scene).partition("Job stats:")[2].partition("Reasons:")[0]


@pytest.mark.slow
def test_a_stage_with_its_figure(copy):
    copy.path("src/roughslip/stages/figure_slopes.py").write_text(STAGE)
    copy.path("src/roughslip/figures/figure_slopes.py").write_text(FIGURE)
    copy.path("src/roughslip/scene/slopes.py").write_text(SECTION)
    copy.edit(
        "src/roughslip/scene/types.py",
        "from roughslip.scene.roughness import",
        "from roughslip.scene.slopes import Slopes\nfrom roughslip.scene.roughness import",
    )
    copy.edit(
        "src/roughslip/scene/types.py",
        "    numerics: Numerics",
        "    slopes: Slopes = part()\n    numerics: Numerics",
    )
    copy.scene("steep", "extends: tiny\ntargets: [figure_slopes]\nslopes: {bins: 20}\n")
    assert "figure_slopes" not in jobs_of(copy, "tiny")
    planned = jobs_of(copy, "steep")
    assert {"karhunen_loeve", "figure_slopes", "scene_report"} <= set(planned.split())
    assert "contact_square" not in planned
    copy.make("-j1", "results/steep/figure_slopes.png", "results/steep/figure_slopes.svg")
    (file,) = copy.path("results/store/figure_slopes").glob("*/key.json")
    key = json.loads(file.read_text())
    assert key["configuration"]["slopes"] == {"bins": 20}
    assert copy.path("results/steep/figure_slopes.svg").is_file()
    copy.scene("lacking", "extends: tiny\ntargets: [figure_slopes]\n")
    run = copy.snakemake("-n", "lacking")
    assert "slopes" in run.stderr
    assert "missing; needed for figure_slopes" in run.stderr


@pytest.mark.slow
def test_a_scene_key(copy):
    """A new key of the material, with a default, that one stage reads."""
    copy.edit(
        "src/roughslip/scene/contact.py",
        "    poisson_ratio",
        '    yield_share: float = number("Share of the hardness", gt=0, le=1, default=1.0)\n    poisson_ratio',
    )
    copy.edit("src/roughslip/stages/karhunen_loeve.py", 'reads="', 'reads="material.yield_share ')
    ask = "from roughslip.scene.types import slice_for; from roughslip.scene.loader import load\n"
    ask += "from pathlib import Path\n"
    ask += "print(slice_for(load(Path('config/scenes/{}.yaml'), Path('config/scenes')), 'karhunen_loeve')['material'])"
    copy.scene("mine", "extends: tiny\nmaterial: {yield_share: 0.5}\n")
    for name, value in (("tiny", 1.0), ("mine", 0.5)):
        code = copy.path(f"ask_{name}.py")  # of its own name, so that no cached bytecode stands in
        code.write_text(ask.format(name))
        assert copy.python(f"ask_{name}").stdout.strip() == f"{{'yield_share': {value}}}"
    copy.scene("wrong", "extends: tiny\nmaterial: {yield_share: 2}\n")
    assert "material.yield_share: 2 is not allowed" in copy.snakemake("-n", "wrong").stderr


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


@pytest.mark.slow
def test_results_go_elsewhere_from_a_read_only_tree_without_a_home(source, home, tmp_path):
    elsewhere = tmp_path / "results é"
    elsewhere.mkdir()
    target = "results/tiny/surface/modes.nc"
    command = ("-m", "snakemake", "-j1", "-s", str(source / "Snakefile"), target)
    made = run(source, home, elsewhere, *command, XDG_CACHE_HOME=str(elsewhere / ".cache"))  # as the Makefile sets it
    assert made.returncode == 0, made.stdout[-3000:] + made.stderr[-3000:]
    assert set(store.read(elsewhere / target)) >= {"modes", "eigenvalue"}
    assert list(home.iterdir()) == []
    assert not (source / "results").exists()


@pytest.mark.slow
def test_compiled_functions_go_where_they_can(source, home, tmp_path):
    """Neither the project nor the home will have them: the working folder does."""
    version = run(source, home, tmp_path, "-c", NUMBA).stdout.strip()
    assert Path(version) == tmp_path / ".cache" / "numba"
    home.chmod(0o755)
    assert Path(run(source, home, tmp_path, "-c", NUMBA).stdout.strip()) == home / ".cache/roughslip/numba"


# Strips two by two, so that those that train fall into two batches.
SPLIT = """\
extends: tiny
jobs: 4
"""
BATCHED = {"contact/square-*": 12, "contact/blocks-*": 4, "friction/expansion-*": 4, "oscillator/ensemble-*": 4}

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


@pytest.mark.slow
def test_results_are_the_same_bit_for_bit(both):
    """Each result that combines batches."""
    tiny, split = both
    assert [name for name in SUMMED_UP if (tiny / name).read_bytes() != (split / name).read_bytes()] == []


@pytest.mark.slow
def test_the_batches_were_others(both):
    tiny, split = both
    for pattern, count in BATCHED.items():
        stored = split.parent.glob(f"store/*/*/{pattern}")
        counts = sorted(Counter(path.parents[1].name for path in stored).values())
        assert counts[-1] == count  # of `split`
        assert len(list(tiny.glob(pattern))) < count


@pytest.mark.slow
def test_every_result_carries_what_made_it(shared):
    folder, stored = shared.path("results/tiny"), set()
    for stage in stages_needed(Scenes(shared.folder, ["tiny"])["tiny"]):
        key = json.loads((folder / f"keys/{stage}.json").read_text())
        for path in folder.glob(re.sub(r"\{.*\}", "*", declarations()[stage].result)):
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
