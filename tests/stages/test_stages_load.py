"""Load: force and windows over penetration, and periodic cells under a nominal pressure."""

import numpy as np
import pytest

from roughslip.errors import IllPosedError
from roughslip.friction.pad import WINDOWS
from roughslip.stages import contact_periodic, contact_strip, friction, friction_under_load
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
    of_blocks = found["pad_std"][:, 0] * found["std"][0] / found["combined_std"]
    full = found["missing_share"] == 0.0  # else other strips change the scatter as they do at the next such level
    np.testing.assert_allclose(of_blocks[full], influence[full], rtol=0.1)


NOMINAL, AREA, MEAN = 4e8, 1e-7, 0.25
CELLS = changed(
    CONTACT,
    strip={"samples": 20},
    numerics={"contact_area": "corrected", "contact_tolerance": 1e-5},
    friction={"mean_at_median": MEAN, "least_contact_fraction": 1e-3},
    load={"force_n": NOMINAL * AREA, "nominal_pressure_pa": NOMINAL, "apparent_area_m2": AREA},
    oscillator={"windows_in_parallel": 40},
)


def blocks_of(result):
    return result["block_area"], result["block_force"]


def test_every_cell_bears_the_nominal_pressure_and_is_the_same_alone(run):
    """Six windows along and six across, 8 x 15 um: 30 x 6 blocks of 20 x 25 um. Cells of 36 windows, not of 24."""
    area, force = blocks_of(run(contact_periodic, CELLS))
    assert force.shape == (16, 30, 6)
    np.testing.assert_allclose(force.sum(axis=(1, 2)), NOMINAL * 30 * 6 * 20e-6 * 25e-6, rtol=1e-12)
    assert np.all(area[force == 0.0] == 0.0)
    more = blocks_of(run(contact_periodic, changed(CELLS, strip={"samples": 30}), "more"))
    for few, many in zip((area, force), more, strict=True):
        np.testing.assert_array_equal(many[:16], few)


def test_friction_under_the_load_by_hand(run, folder):
    """All windows of five blocks, around the period too. Their first-order influence has the variance of a pad of one.

    Shear strength gives sum(A) tau / sum(N) the mean of the scene; real area over apparent area is that of all blocks.
    """
    area, force = blocks_of(run(contact_periodic, CELLS))
    found = run(friction_under_load, CELLS, contact=folder / "contact_periodic.nc")
    tau = MEAN * force.sum() / area.sum()
    assert found["shear_strength"] == pytest.approx(tau, rel=1e-12)
    assert found["real_area"] == pytest.approx(area.sum() / (area.size * 20e-6 * 25e-6), rel=1e-12)
    mu, influence, empty = [], [], []
    for first in range(30):
        a, n = (np.roll(part, -first, axis=1)[:, :5].sum(axis=1) for part in (area, force))
        touches = a >= 1e-3 * WINDOW_AREA
        mu.append(tau * a[touches] / n[touches])
        empty.append(n == 0.0)
        influence.append((tau * a - MEAN * n) / (5 * force.mean()))
    assert found["mean"] == pytest.approx(np.concatenate(mu).mean(), rel=1e-9)
    assert found["std"] == pytest.approx(np.concatenate(mu).std(), rel=1e-9)
    assert found["no_contact"] == pytest.approx(np.mean(empty), rel=1e-9)
    assert found["missing_share"] == pytest.approx(1.0 - np.concatenate(mu).size / np.size(empty), rel=1e-9)
    assert 0.0 < found["no_contact"] <= found["missing_share"] < 0.1
    within = np.array(influence[:26])  # that do not reach around the period
    assert found["pad_std"][0] == pytest.approx(np.sqrt(np.mean(within**2)), rel=1e-9)
    logs = np.log(WINDOWS), np.log(found["pad_std"])
    assert np.log(found["load_std"]) == pytest.approx(np.interp(np.log(40.0), *logs), abs=1e-9)
    for name in ("shear_strength", "real_area", "load_std", "std"):
        assert found[f"{name}_low"] < found[name] < found[f"{name}_high"]
    measured = changed(CELLS, load={"mean_friction": 0.5})
    twice = run(friction_under_load, measured, "twice", contact=folder / "contact_periodic.nc")
    assert twice["load_mean"] == 0.5
    np.testing.assert_allclose(twice["pad_std"], 2 * found["pad_std"], rtol=1e-9)


def test_cells_are_solved_until_friction_is_as_accurate_as_asked(run, folder):
    """Scatter to 6 % needs more than the first 16; a limit of cost names the nearest, and that is then reached."""
    strip = {**CELLS["strip"], "samples": "auto"}
    asked = {"friction_mean": 0.05, "friction_std": 0.06, "cost_limit_cpu_s": 10.0}
    cells = len(run(contact_periodic, CELLS | {"strip": strip, "accuracy": asked}, "asked")["residual"])
    assert cells > 16
    assert run.did["friction_std_reached"] <= 0.06
    limited = asked | {"friction_std": 0.01, "cost_limit_cpu_s": 3.6e-3 * 40}
    with pytest.raises(IllPosedError, match=r"nearest is .*friction_std: 0\.0"):
        run(contact_periodic, CELLS | {"strip": strip, "accuracy": limited}, "limited")
