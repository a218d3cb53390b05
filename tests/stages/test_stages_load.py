"""Load of a pad: from nominal pressure, modulus, heights and hardness to penetration, force and windows."""

import numpy as np
import pytest

from roughslip.errors import IllPosedError
from roughslip.friction.pad import percentile_of_pressure
from roughslip.friction.statistics import resampled, strip_weights
from roughslip.stages import contact_strip, friction
from tests.stages.scenes import CONTACT, changed

STRIPS, MANY = 12, 20
LEVELS = [20.0, 35.0, 50.0, 70.0, 90.0]
MODULUS, RMS, NOMINAL = 2.1e11, 2e-7, 4e8
SCENE = changed(
    CONTACT,
    strip={"penetration_percentiles": LEVELS, "training_samples": 2, "samples": MANY},
    numerics={"contact_area": "corrected"},
    friction={"mean_at_median": 0.3, "least_contact_fraction": 1e-4},
    oscillator={"normal_force_n": 50.0},
    load={"nominal_pressure_pa": NOMINAL},
)
WINDOW_AREA = 1e-4 * 2.5e-5
WEIGHTS = strip_weights(STRIPS, 100, np.random.default_rng(1))


@pytest.fixture(scope="module")
def percentile_at(run):
    """percentile_at(nominal pressure, rms height, material) by the strips solved with them."""

    def found(pressure_pa, rms=RMS, **material):
        scene = changed(SCENE, material=material, roughness={"rms_height_m": rms})
        force = run(contact_strip, scene, f"{rms}-{material}", first=0, last=STRIPS)["force"].mean(axis=2)
        return percentile_of_pressure(np.array(LEVELS), resampled(WEIGHTS, force) / STRIPS / WINDOW_AREA, pressure_pa)

    return found


def test_penetration_follows_from_the_pressure_over_the_modulus(percentile_at):
    """Elastic contact at a given plane has p ~ E* Sq: twice the modulus under twice the pressure penetrates as far.

    Twice the modulus under the same pressure penetrates as far as half the pressure, and twice the heights as well.
    """
    own, half = percentile_at(NOMINAL), percentile_at(NOMINAL / 2)
    for found, same in (
        (percentile_at(2 * NOMINAL, young_modulus_pa=2 * MODULUS), own),
        (percentile_at(NOMINAL, young_modulus_pa=2 * MODULUS), half),
        (percentile_at(NOMINAL, rms=2 * RMS), half),
    ):
        np.testing.assert_allclose(found, same, rtol=1e-6)
    assert 20.0 < half[0] < own[0] - 5.0 < 85.0


def test_a_surface_that_yields_penetrates_farther(percentile_at):
    assert np.all(percentile_at(NOMINAL, hardness_pa=2e9) > percentile_at(NOMINAL) + 1.0)


@pytest.mark.slow
def test_light_levels_continue_those_of_windows(run, folder):
    """Blocks of all strips at a light level give pads as they follow from windows where it is one of theirs.

    Windows lie on the middle of a strip twice as often as on its ends, and change the mean by the factor of their own
    level: on 40 strips the mean stays within 2 %, pressure and scatter within 10 %.
    """
    found, levels = {}, LEVELS[1:]
    for name, strip in (
        ("light", {"penetration_percentiles": levels, "light_percentiles": [0.0001, LEVELS[0]]}),
        ("windows", {}),
    ):
        scene = changed(SCENE, strip={**strip, "training_samples": 2}, load={"nominal_pressure_pa": 0.7 * NOMINAL})
        run(contact_strip, scene, f"{name}-s", first=0, last=40)
        run(contact_strip, scene, f"{name}-m", first=0, last=60)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(friction, "REPLICATES", 100)
            paths = {"contact": [folder / f"{name}-s.nc"], "expansion": [folder / f"{name}-m.nc"]}
            found[name] = run(friction, scene, f"{name}-statistics", **paths)
    light, windows = found["light"], found["windows"]
    assert light["light_percentile"] == [LEVELS[0]]  # at 0.0001 % hardly a strip touches
    assert light["light_pressure"][0] == pytest.approx(windows["nominal_pressure"][0], rel=0.1)
    assert light["light_pad_mean"][0, -1] == pytest.approx(windows["pad_mean"][0, -1], rel=0.02)
    np.testing.assert_allclose(light["light_pad_std"][0], windows["pad_std"][0], rtol=0.15)
    assert light["load_percentile"] == pytest.approx(windows["load_percentile"], rel=0.05)
    # as many more strips as it takes, or lighter levels, where a load is below them all
    with pytest.raises(IllPosedError, match=r"to strip\.light_percentiles, solve more strips"):
        run(friction, changed(scene, strip=strip, load={"nominal_pressure_pa": 1e3}), **paths)


def test_force_pressure_and_windows_of_every_level(run, folder, percentile_at):
    """Means over all windows of the solved strips; windows = force / that of one; at the load, the nominal pressure."""
    solved = run(contact_strip, SCENE, "s", first=0, last=STRIPS)
    run(contact_strip, SCENE, "m", first=0, last=MANY)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction, "REPLICATES", 100)
        paths = {"contact": [folder / "s.nc"], "expansion": [folder / "m.nc"]}
        found = run(friction, SCENE, "statistics", **paths)
    force = solved["force"].mean(axis=(0, 2))
    np.testing.assert_allclose(found["force_per_window"], force, rtol=1e-12)
    np.testing.assert_allclose(found["nominal_pressure"], force / WINDOW_AREA, rtol=1e-12)
    np.testing.assert_allclose(found["load_windows"], 50.0 / force, rtol=1e-12)
    assert found["load_percentile"] == pytest.approx(percentile_at(NOMINAL)[0], rel=1e-9)
    assert found["load_percentile_low"] < found["load_percentile"] < found["load_percentile_high"]
    for level, windows in enumerate(found["load_windows"]):  # between stored pads on a power law
        logs = np.log(found["pad_windows"]), np.log(found["pad_std"][level])
        assert np.log(found["load_std"][level]) == pytest.approx(np.interp(np.log(max(windows, 1.0)), *logs))
    lines = (folder / "summary.csv").read_text().splitlines()
    header, *rows = (line for line in lines if not line.startswith("#"))
    place = header.split(",").index("nominal_pressure_pa")
    assert [float(row.split(",")[place]) for row in rows] == pytest.approx(force / WINDOW_AREA, rel=1e-5)
    # blocks give a window the scatter of its influence; windows share the middle of a strip, blocks do not
    area, forces, tau = solved["area"], solved["force"], found["shear_strength"]
    mean = tau * area.sum(axis=(0, 2)) / forces.sum(axis=(0, 2))
    influence = np.sqrt(np.mean((tau * area - mean[:, None] * forces) ** 2, axis=(0, 2))) / force
    of_blocks = found["adjacent_std"][:, 0] * found["std"][0] / found["combined_std"]
    full = found["missing_share"] == 0.0  # else other strips change the scatter as they do at the next such level
    np.testing.assert_allclose(of_blocks[full], influence[full], rtol=0.1)
    assert np.all(found["pad_independent_windows"][:, 0] == 1.0)
