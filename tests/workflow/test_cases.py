"""The shipped cases of engineering as a user runs them: what follows from the load, the answers of docs/cases.md."""

import json
import math
import re

import pytest

from roughslip import store
from roughslip.scene.types import scene_of
from roughslip.stages.from_scene.mass_on_belt import friction_numbers, independent_windows
from tests.scene.shipped import CASES, CONFIG, shipped_scene
from tests.workflow.project import Project

pytestmark = pytest.mark.slow

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
    path, load, hardness = folder / "friction/under_load.nc", scene["load"], scene["material"]["hardness_pa"]
    found, case, contact = store.read(path), scene_of(scene), store.read(folder / "contact/periodic.nc")
    x = load["nominal_pressure_pa"] / (contact["plasticity_index"] * hardness)
    assert found["real_area_high"] > math.erf(math.sqrt(2.0) * x)
    assert found["real_area_low"] < math.sqrt(2.0 * math.pi) * x + load["nominal_pressure_pa"] / hardness
    numbers = friction_numbers(case, path)
    assert numbers.mean == load["mean_friction"]
    scatter = numbers.standard_deviation / numbers.mean / math.sqrt(independent_windows(case, path))
    assert scatter == pytest.approx(found["load_std"] / numbers.mean, rel=1e-9)
    length = scene["roughness"].get("correlation_length_m") or store.read(folder / "surface/scan.nc")["length_x"]
    contacts = load["apparent_area_m2"] / length**2 * float(found["real_area"])
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
        found = [limits[side]["0.05"] for side in ("below", "above") if limits[side]["0.05"]]
        assert any(0.995 * one["interval"][0] <= value <= 1.005 * one["interval"][1] for one in found)
    assert f"| {100 * answer['probability']['value']:.0f} % [" in row
    assert f"| {answer['decides']['by']} |" in row
