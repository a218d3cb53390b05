"""Whole runs: as a module of another workflow, from a scan, and the five cases of engineering. Results hold what made
them."""

import importlib.util
import json
import math
import os
import re
import stat
import subprocess
import sys

import netCDF4
import pytest

from roughslip import store
from roughslip.scene.types import scene_of
from roughslip.study.from_scene.machine import friction_of
from roughslip.study.graph import STAGES
from tests.scene.shipped import CASES, CONFIG, shipped_scene
from tests.workflow.project import Project, as_a_user, copy_project

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


@pytest.mark.slow
def test_a_module_makes_the_scenes_of_its_caller_from_a_read_only_tree_without_a_home(tmp_path):
    """A folder with a workflow and a scene of its own, which extends one of the project. Names of folders have spaces
    and letters beyond ASCII."""
    source, home, elsewhere = copy_project(tmp_path / "read only é β"), tmp_path / "home", tmp_path / "results é"
    home.mkdir(mode=0o555)
    (elsewhere / "cases").mkdir(parents=True)
    (elsewhere / "cases/mine.yaml").write_text("extends: tiny\nseed: 5\n")
    text = MODULE.format(snakefile=repr(str(source.path("Snakefile"))), config={"scenes_folder": "cases"})
    (elsewhere / "Snakefile").write_text(text)
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("XDG_", "NUMBA_", "MPL"))}
    own = {"HOME": str(home), "PYTHONPATH": str(source.path("src")), "PYTHONDONTWRITEBYTECODE": "1"}
    options = {"cwd": elsewhere, "env": kept | own, "capture_output": True, "text": True, "preexec_fn": as_a_user()}
    command = [sys.executable, "-m", "snakemake", "-j1", "--workflow-profile", str(source.path("profiles/default"))]
    paths = [source.folder, *source.folder.rglob("*")]
    for path in paths:
        path.chmod(path.stat().st_mode & ~(stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH))
    made = subprocess.run(command, **options)
    whole = subprocess.run([*command, "roughslip_mine", "-n"], **options).stdout  # the rule of the scene itself
    for path in paths:
        path.chmod(path.stat().st_mode | stat.S_IWUSR)
    assert made.returncode == 0, made.stdout[-3000:] + made.stderr[-3000:]
    assert "modes" in store.read(elsewhere / "copied.nc")
    jobs = dict(re.findall(r"^roughslip_(\w+) +(\d+)$", whole, re.MULTILINE))
    assert (jobs["page"], jobs["publish"], "karhunen_loeve" in jobs) == ("1", "1", False)
    assert list(home.iterdir()) == []
    assert not source.path("results").exists()


@pytest.mark.slow
def test_every_result_carries_what_made_it(finished):
    folder, stored = finished.path("results/tiny"), set()
    for file in folder.glob("keys/*.json"):
        key, row = json.loads(file.read_text()), STAGES[file.stem]
        files = (
            ["figure*.nc"] if row.name == "figures" else [re.sub(r"\{.*\}", "*", name) for name in row.results.values()]
        )
        for path in (path for name in files for path in folder.glob(name) if path.suffix == ".nc"):
            stored.add(path)
            with netCDF4.Dataset(path) as result:
                assert json.loads(result.configuration) == key["configuration"]
                assert result.code_hash == key["code"]
                assert result.seed == str(key["configuration"].get("seed", "none used"))
                assert {"python", "numpy", "scipy", "numba"} <= set(json.loads(result.versions))
                labels = [variable.ncattrs() for variable in result.variables.values()]
                assert all({"units", "long_name"} <= set(names) for names in labels)
    assert stored == set(folder.rglob("*.nc"))


GROUND = """\
extends: tiny
targets: [figure3]
roughness:
  scan: {form: plane, covariance: measured, marginal: empirical, file: config/scans/ground.nc}
  correct_correlation: true
"""


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("SurfaceTopography") is None, reason="needs the extra `scans`")
@pytest.mark.filterwarnings("default")  # Snakemake runs in this process, and its warnings are its own
def test_a_ground_surface_goes_from_its_scan_to_figure_3(project, plan):
    """Other contents of the file of the scan repeat all that depends on it."""
    project.scene("ground", GROUND)
    project.make("-j2", "ground")
    results = project.path("results/ground")
    drawn = ("figure_scan.png", "figure_scan.svg", "figure3.png", "report.html")
    assert all((results / name).is_file() for name in drawn)
    result = store.read(results / "surface/scan.nc")
    assert result["sufficient"] == 1
    assert result["skewness_high"] < 0  # grains leave valleys
    assert result["length_x_low"] > 2 * result["length_y_high"]  # along the belt
    file = project.path("config/scans/ground.nc")
    file.write_bytes(file.read_bytes() + b" ")
    strip = ("contact", "expansion_strip", "friction")
    again = ("scan", *strip, "figures", "page", "publish")
    assert plan(project.folder, "ground") == {"ground": dict.fromkeys(again, 1)}


DOCUMENT = (CONFIG.parent / "docs" / "cases.md").read_text()
PARAMETERS = {"D": "damping", "v0": "belt_velocity", "N": "load"}
UNITS = {"": 1.0, "m/s": 1.0, "mm/s": 1e-3, "N": 1.0}


@pytest.fixture(scope="module")
def cases(empty, tmp_path_factory) -> Project:
    """The project after a run of all cases."""
    project = empty.copy(tmp_path_factory.mktemp("cases") / "project")
    project.make("-j2", *CASES)
    return project


@pytest.mark.nightly
@pytest.mark.parametrize("name", CASES)
def test_a_case_has_the_answer_of_the_document_and_the_contact_of_theory(cases, name):
    """Each limit that the document states lies in the interval of the run, or rounds to it.

    Real area over the apparent one is above Persson's erf(sqrt(2) x), x = p / (E* h'), with h' from the index, and
    below sqrt(2 pi) x of elastic contact and the p / H of what yields.

    Persson, J. Chem. Phys. 115 (2001) 3840, and Bush et al., Wear 35 (1975) 87. Solutions lie between (Hyun et al.,
    Phys. Rev. E 70 (2004) 026117). A pad of n correlation areas, of which the load touches the share A / A0, scatters
    as some n A / A0 contacts do.
    """
    scene, folder = shipped_scene(name), cases.path(f"results/{name}")
    path, load, hardness = folder / "friction/statistics.nc", scene["load"], scene["material"]["hardness_pa"]
    result, friction = store.read(path), friction_of(scene_of(scene), path)
    x = load["nominal_pressure_pa"] / (result["plasticity_index"] * hardness)
    assert result["real_area_high"] > math.erf(math.sqrt(2.0) * x)
    assert result["real_area_low"] < math.sqrt(2.0 * math.pi) * x + load["nominal_pressure_pa"] / hardness
    scatter = friction.pad_deviation / friction.mean
    assert scatter == pytest.approx(result["load_std"] / scene["friction"]["mean"], rel=1e-9)
    length = scene["roughness"].get("correlation_length_m") or store.read(folder / "surface/scan.nc")["length_x"]
    contacts = load["force_n"] / load["nominal_pressure_pa"] / length**2 * float(result["real_area"])
    assert 0.05 < scatter * math.sqrt(contacts) < 2.0
    answer = json.loads((folder / "answer.json").read_text())
    row = next(line for line in DOCUMENT.splitlines() if line.startswith(f"| [`{name}`]("))
    stated = re.findall(r"\b(D|v0|N) [<>] ([\d.]+) ?(m/s|mm/s|N|)", row)
    assert stated
    for symbol, number, unit in stated:
        value, limits = float(number) * UNITS[unit], answer["limits"][PARAMETERS[symbol]]
        nearest = [limits[side]["0.05"] for side in ("below", "above") if limits[side]["0.05"]]
        assert any(0.995 * one["interval"][0] <= value <= 1.005 * one["interval"][1] for one in nearest)
    assert f"| {100 * answer['probability']['value']:.0f} % [" in row
    assert f"| {answer['decides']['by']} |" in row
