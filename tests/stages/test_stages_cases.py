"""The shipped cases of engineering, coarser still: real area, penetration and scatter follow from the load."""

import math

import numpy as np
import pytest

from roughslip.scene.types import scene_of
from roughslip.stages import contact_strip, friction
from roughslip.stages.from_scene.mass_on_belt import friction_numbers, independent_windows, pad_at
from tests.scene.shipped import CASES, shipped_scene

STRIPS, MANY = {"slideway": 200}, 120


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_real_area_and_scatter_of_a_case_follow_from_its_load(run, folder, name):
    """Real area over the apparent one lies between Persson's erf(sqrt(2) x) and sqrt(2 pi) x, x = p / (E* h').

    h' is the rms slope, 2 Sq / L here. Persson, J. Chem. Phys. 115 (2001) 3840, and Bush et al., Wear 35 (1975) 87;
    solutions lie between (Hyun et al., Phys. Rev. E 70 (2004) 026117), and so do these cells at light load.
    A pad of n correlation areas, of which the load touches the share A / A0, scatters as some n A / A0 contacts do.
    """
    scene, strips = shipped_scene(name), STRIPS.get(name, 60)
    for kind, count in (("s", strips), ("m", strips + MANY)):
        run(contact_strip, scene, f"{name}-{kind}", first=0, last=count)
    paths = {"contact": [folder / f"{name}-s.nc"], "expansion": [folder / f"{name}-m.nc"]}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction, "REPLICATES", 100)
        found = run(friction, scene, f"{name}-friction", **paths)
    load, roughness, material = scene["load"], scene["roughness"], scene["material"]
    slope = 2.0 * roughness["rms_height_m"] / roughness["correlation_length_m"]
    modulus = material["young_modulus_pa"] / (1.0 - material["poisson_ratio"] ** 2)
    x = load["nominal_pressure_pa"] / (modulus * slope)
    windows = scene["oscillator"]["windows_in_parallel"]
    job_scene = scene_of(scene)
    share = pad_at(job_scene, found, "pad_mean", windows) / found["shear_strength"] * load["nominal_pressure_pa"]
    assert math.erf(math.sqrt(2.0) * x) < share < math.sqrt(2.0 * math.pi) * x
    assert found["load_percentile_low"] < found["load_percentile"] < found["load_percentile_high"]
    numbers = friction_numbers(job_scene, folder / f"{name}-friction.nc")
    assert numbers.mean == load["mean_friction"]
    independent = independent_windows(job_scene, folder / f"{name}-friction.nc")
    scatter = numbers.standard_deviation / numbers.mean / math.sqrt(independent)
    contacts = load["apparent_area_m2"] / roughness["correlation_length_m"] ** 2 * share
    assert 0.05 < scatter * np.sqrt(contacts) < 2.0
