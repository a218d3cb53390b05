"""From a scan to Figure 3, the shipped one and a real one; the shipped cases of engineering as a user runs them."""

from __future__ import annotations

import importlib.util
import json
import math
import re
import shutil
from pathlib import Path

import pytest

from roughslip import store
from roughslip.scene.types import scene_of
from roughslip.study.from_scene.machine import friction_of
from roughslip.study.result_tables.scan_table import NUMBERS
from tests.scene.shipped import CASES, CONFIG, shipped_scene
from tests.workflow.project import Project

pytestmark = pytest.mark.slow

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"

GROUND = """\
extends: tiny
description: After a scan of a ground surface
targets: [figure3]
roughness:
  scan:
    form: plane
    covariance: measured
    marginal: empirical
    file: config/scans/ground.nc
  correct_correlation: true
"""
PRODUCTS = ("surface/scan.nc", "figure_scan.png", "figure_scan.svg", "figure_scan.nc", "report.html")
STRIP = {"contact": 1, "chaos_strip": 1, "expansion_strip": 1, "friction": 1}

needs_library = pytest.mark.skipif(
    importlib.util.find_spec("SurfaceTopography") is None, reason="needs the extra `scans`"
)


@pytest.fixture(scope="module")
def ground(shared):
    """The scene `ground`, made from its scan."""
    shared.scene("ground", GROUND)
    shared.make("-j2", "ground")
    yield shared
    shared.path("config/scenes/ground.yaml").unlink()


@needs_library
def test_a_ground_surface_goes_from_its_scan_to_figure_3(ground):
    results = ground.path("results/ground")
    assert all((results / name).is_file() for name in (*PRODUCTS, "figure3.png"))
    result = store.read(results / "surface/scan.nc")
    assert result["sufficient"] == 1
    assert result["skewness_high"] < 0  # grains leave valleys
    assert result["length_x_low"] > 2 * result["length_y_high"]  # along the belt
    assert set(NUMBERS) <= set(result)


@needs_library
@pytest.mark.filterwarnings("default")  # Snakemake runs in this process, and its warnings are its own
def test_a_change_of_the_scan_repeats_its_dependants(ground, plan):
    """The file by its contents; the scan itself has no random numbers."""

    def planned() -> dict[str, int]:
        return plan(ground.folder, "ground")["ground"]

    scene = ground.path("config/scenes/ground.yaml")
    after = {**STRIP, "figures": 1, "page": 1, "publish": 1}
    scene.write_text(GROUND.replace("empirical\n", "gaussian\n").replace("  correct_correlation: true\n", ""))
    assert planned() == {"scan": 1, **after}
    scene.write_text(GROUND + "seed: 5\n")
    assert planned() == after
    scene.write_text(GROUND)
    file = ground.path("config/scans/ground.nc")
    whole = file.read_bytes()
    file.write_bytes(whole + b" ")
    assert planned() == {"scan": 1, **after}
    file.write_bytes(whole)


@needs_library
@pytest.mark.skipif(not DATA.is_dir(), reason="needs the measured scans in ../shared/data")
def test_a_real_scan_goes_to_figures_3_and_5(shared):
    shutil.copyfile(DATA / "al3d-1.al3d", shared.path("config/scenes/focus.al3d"))
    scan = "{file: focus.al3d, form: quadratic, covariance: best, marginal: gaussian}"
    shared.scene("focus", f"extends: tiny\ntargets: [figure3, figure5]\nroughness: {{scan: {scan}}}\n")
    shared.make("-j2", "focus")
    drawn = (*PRODUCTS, "figure3.png", "figure5.png")
    assert all(shared.path(f"results/focus/{product}").is_file() for product in drawn)
    assert store.read(shared.path("results/focus/surface/scan.nc"))["sufficient"] == 1
    shared.path("config/scenes/focus.yaml").unlink()


DOCUMENT = (CONFIG.parent / "docs" / "cases.md").read_text()
PARAMETERS = {"D": "damping", "v0": "belt_velocity", "N": "load"}
UNITS = {"": 1.0, "m/s": 1.0, "mm/s": 1e-3, "N": 1.0}


@pytest.fixture(scope="module")
def cases(empty, tmp_path_factory) -> Project:
    """The project after a run of all cases."""
    project = empty.copy(tmp_path_factory.mktemp("cases") / "project")
    project.make("-j2", *CASES)
    return project


@pytest.mark.parametrize("name", CASES)
def test_real_area_and_scatter_of_a_case_follow_from_its_load(cases, name):
    """Real area over the apparent one is above Persson's erf(sqrt(2) x), x = p / (E* h'), with h' from the index, and
    below sqrt(2 pi) x of elastic contact and the p / H of what yields.

    Persson, J. Chem. Phys. 115 (2001) 3840, and Bush et al., Wear 35 (1975) 87. Solutions lie between (Hyun et al.,
    Phys. Rev. E 70 (2004) 026117). A pad of n correlation areas, of which the load touches the share A / A0, scatters
    as some n A / A0 contacts do.
    """
    scene, folder = shipped_scene(name), cases.path(f"results/{name}")
    path, load, hardness = folder / "friction/statistics.nc", scene["load"], scene["material"]["hardness_pa"]
    result, case = store.read(path), scene_of(scene)
    x = load["nominal_pressure_pa"] / (result["plasticity_index"] * hardness)
    assert result["real_area_high"] > math.erf(math.sqrt(2.0) * x)
    assert result["real_area_low"] < math.sqrt(2.0 * math.pi) * x + load["nominal_pressure_pa"] / hardness
    friction = friction_of(case, path)
    assert friction.mean == scene["friction"]["mean"]
    scatter = friction.pad_deviation / friction.mean
    assert scatter == pytest.approx(result["load_std"] / friction.mean, rel=1e-9)
    length = scene["roughness"].get("correlation_length_m") or store.read(folder / "surface/scan.nc")["length_x"]
    contacts = load["force_n"] / load["nominal_pressure_pa"] / length**2 * float(result["real_area"])
    assert 0.05 < scatter * math.sqrt(contacts) < 2.0


@pytest.mark.parametrize("name", CASES)
def test_the_document_has_the_answer_of_a_case(cases, name):
    """Each limit that it states lies in the interval of the run, or rounds to it."""
    answer = json.loads(cases.path(f"results/{name}/answer.json").read_text())
    row = next(line for line in DOCUMENT.splitlines() if line.startswith(f"| [`{name}`]("))
    stated = re.findall(r"\b(D|v0|N) [<>] ([\d.]+) ?(m/s|mm/s|N|)", row)
    assert stated
    for symbol, number, unit in stated:
        value, limits = float(number) * UNITS[unit], answer["limits"][PARAMETERS[symbol]]
        nearest = [limits[side]["0.05"] for side in ("below", "above") if limits[side]["0.05"]]
        assert any(0.995 * one["interval"][0] <= value <= 1.005 * one["interval"][1] for one in nearest)
    assert f"| {100 * answer['probability']['value']:.0f} % [" in row
    assert f"| {answer['decides']['by']} |" in row
