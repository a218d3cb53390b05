"""Load: force and windows over penetration, and periodic cells under a nominal pressure."""

import numpy as np
import pytest

from roughslip.stages import contact_strip, friction
from tests.stages.scenes import CONTACT, changed

STRIPS, MANY = 12, 20
LEVELS = [20.0, 35.0, 50.0, 70.0, 90.0]
SCENE = changed(
    CONTACT,
    strip={"penetration_percentiles": LEVELS, "training_samples": 2, "samples": MANY},
    numerics={"contact_area": "corrected"},
    friction={"mean_at_median": 0.3, "least_contact_fraction": 1e-4},
    oscillator={"normal_force_n": 50.0},
)
WINDOW_AREA = 1e-4 * 2.5e-5


def test_force_pressure_and_windows_of_every_level(run, folder):
    """Means over all windows of the solved strips; windows = force / that of one."""
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
