"""Load: force and windows over penetration, and periodic cells under a nominal pressure."""

import numpy as np
import pytest

from roughslip import store
from roughslip.friction.pad import WINDOWS
from roughslip.friction.windows import window_sums
from roughslip.scene.types import scene_of
from roughslip.study import contact, friction
from roughslip.study.from_scene import domain
from roughslip.study.graph import STAGES
from roughslip.surface.models import covariance_of
from roughslip.surface.plausibility import rms_slope, yielding
from tests.study.scenes import CONTACT, changed

STRIPS, MANY = 12, 20
LEVELS = [20.0, 35.0, 50.0, 70.0, 90.0]
SCENE = changed(
    CONTACT,
    strip={"penetration_percentiles": LEVELS, "training_samples": 2, "samples": MANY},
    numerics={"contact_area": "corrected"},
    friction={"mean": 0.3},
    oscillator={"normal_force_n": 50.0},
)
WINDOW_AREA = 1e-4 * 2.5e-5


def test_force_pressure_and_windows_of_every_level(run, folder):
    """Means over all windows of the solved strips; windows = force / that of one."""
    solved = run(contact, SCENE, "s", first=0, last=STRIPS)
    more = run(contact, SCENE, "m", first=0, last=MANY)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction, "REPLICATES", 100)
        names = {name: more.variable(name) for name in ("area", "force")}
        store.write(folder / "e.nc", names, store.Key({}, "code"), {"first": 0, "model": "expansion"})
        result = run(friction, SCENE, "statistics", blocks=[folder / "s.nc", folder / "e.nc"])
    area, forces = (window_sums(solved[name][:, :, :, 0], 5, 1) for name in ("area", "force"))
    force = forces.mean(axis=(0, 2))
    np.testing.assert_allclose(result["force_per_window"], force, rtol=1e-12)
    np.testing.assert_allclose(result["nominal_pressure"], force / WINDOW_AREA, rtol=1e-12)
    np.testing.assert_allclose(result["load_windows"], 50.0 / force, rtol=1e-12)
    for level, windows in enumerate(result["load_windows"]):  # between stored pads on a power law
        logs = np.log(result["pad_windows"]), np.log(result["pad_std"][level])
        assert np.log(result["load_std"][level]) == pytest.approx(np.interp(np.log(max(windows, 1.0)), *logs))
    lines = (folder / "statistics.csv").read_text().splitlines()
    header, *rows = (line for line in lines if not line.startswith("#"))
    place = header.split(",").index("nominal_pressure_pa")
    assert [float(row.split(",")[place]) for row in rows] == pytest.approx(force / WINDOW_AREA, rel=1e-5)
    # blocks give a window the scatter of its influence; windows share the middle of a strip, blocks do not
    tau = result["shear_strength"]
    mean = tau * area.sum(axis=(0, 2)) / forces.sum(axis=(0, 2))
    influence = np.sqrt(np.mean((tau * area - mean[:, None] * forces) ** 2, axis=(0, 2))) / force
    of_blocks = result["pad_std"][:, 0] * result["std"][0] / result["combined_std"]
    full = result["missing_share"] == 0.0  # else other strips change the scatter as they do at the next such level
    np.testing.assert_allclose(of_blocks[full], influence[full], rtol=0.1)


NOMINAL, AREA, MEAN = 4e8, 1e-7, 0.25
CELLS = changed(
    CONTACT,
    strip={"samples": 20},
    numerics={"contact_area": "corrected", "contact_tolerance": 1e-5},
    friction={"mean": MEAN},
    load={"force_n": NOMINAL * AREA, "nominal_pressure_pa": NOMINAL},
    oscillator={"windows_in_parallel": 40},
)


def blocks_of(result):
    """Area and force (cells, along, across) under the load of the scene."""
    return result["area"][:, 0], result["force"][:, 0]


def solved(run, scene, name="contact"):
    """The contact of all cells of a scene, under its own load alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(domain, "FACTORS", ())
        return run(contact, scene, name, first=0, last=scene["strip"]["samples"])


def test_every_cell_bears_the_nominal_pressure_and_is_the_same_alone(run):
    """Six windows along and six across, 8 x 15 um: 30 x 6 blocks of 20 x 25 um. 20 cells of 36 windows for 90 of 8."""
    area, force = blocks_of(solved(run, CELLS))
    assert force.shape == (16, 30, 6)
    np.testing.assert_allclose(force.sum(axis=(1, 2)), NOMINAL * 30 * 6 * 20e-6 * 25e-6, rtol=1e-12)
    assert np.all(area[force == 0.0] == 0.0)
    more = blocks_of(solved(run, changed(CELLS, strip={"samples": 90}), "more"))
    for few, many in zip((area, force), more, strict=True):
        assert len(many) == 20
        np.testing.assert_array_equal(many[:16], few)


def test_a_figure_solves_the_first_of_these_cells_from_what_it_reads(run):
    cells = domain.own_cells(scene_of(CELLS, STAGES["figure_chain"].keys), None)
    (solution,) = cells.solutions(cells.heights(0))
    np.testing.assert_array_equal(cells.blocks(solution.pressure), blocks_of(solved(run, CELLS))[1][0])


def test_a_cell_follows_from_windows_correlation_and_contacts():
    """Six windows of 100 um and two of 25 um, 8 L = 120 um: 600 x 150 um. A light load doubles the shorter edge."""
    scene = scene_of(CELLS)
    for light_area, lengths, edges in (
        (1.0, (15e-6, 15e-6), (600e-6, 150e-6)),
        (1.0, (15e-6, 1e-6), (600e-6, 50e-6)),
        (1.0, (150e-6, 15e-6), (1200e-6, 150e-6)),
        (4 * 15e-6**2 / (600e-6 * 300e-6), (15e-6, 15e-6), (600e-6, 300e-6)),
        (4 * 15e-6**2 / (1200e-6 * 600e-6), (15e-6, 15e-6), (1200e-6, 600e-6)),
        (1e-9, (15e-6, 15e-6), (9600e-6, 4800e-6)),  # twice as many nodes would be more than 2^21
    ):
        grid = domain.mesh_of(scene, lengths, light_area)
        assert (grid.nx * grid.dx, grid.ny * grid.dy) == pytest.approx(edges)


def test_friction_under_the_load_by_hand(run, folder):
    """All windows of five blocks, around the period too. Their first-order influence has the variance of a pad of one.

    Shear strength gives sum(A) tau / sum(N) the mean of the scene; real area over apparent area is that of all blocks.
    """
    area, force = blocks_of(solved(run, CELLS))
    result = run(friction, CELLS, blocks=[folder / "contact.nc"])
    tau = MEAN * force.sum() / area.sum()
    assert result["shear_strength"] == pytest.approx(tau, rel=1e-12)
    assert result["real_area"] == pytest.approx(area.sum() / (area.size * 20e-6 * 25e-6), rel=1e-12)
    mu, influence, empty = [], [], []
    for first in range(30):
        a, n = (np.roll(part, -first, axis=1)[:, :5].sum(axis=1) for part in (area, force))
        touches = a >= 1e-3 * WINDOW_AREA
        mu.append(tau * a[touches] / n[touches])
        empty.append(n == 0.0)
        influence.append((tau * a - MEAN * n) / (5 * force.mean()))
    assert result["mean"] == pytest.approx(np.concatenate(mu).mean(), rel=1e-9)
    assert result["std"] == pytest.approx(np.concatenate(mu).std(), rel=1e-9)
    assert result["no_contact"] == pytest.approx(np.mean(empty), rel=1e-9)
    assert result["missing_share"] == pytest.approx(1.0 - np.concatenate(mu).size / np.size(empty), rel=1e-9)
    assert 0.0 < result["no_contact"] <= result["missing_share"] < 0.1
    assert 0.0 <= result["no_contact_low"] < result["no_contact_high"] <= 1.0
    within = np.array(influence[:26])  # that do not reach around the period
    assert result["pad_std"][0] == pytest.approx(np.sqrt(np.mean(within**2)), rel=1e-9)
    logs = np.log(WINDOWS), np.log(result["pad_std"])
    assert np.log(result["load_std"]) == pytest.approx(np.interp(np.log(40.0), *logs), abs=1e-9)
    for name in ("shear_strength", "real_area", "load_std", "std"):
        assert result[f"{name}_low"] < result[name] < result[f"{name}_high"]
    measured = changed(CELLS, friction={"mean": 0.5})
    twice = run(friction, measured, "twice", blocks=[folder / "contact.nc"])
    assert twice["load_mean"] == 0.5
    np.testing.assert_allclose(twice["pad_std"], 2 * result["pad_std"], rtol=1e-9)


def test_friction_over_loads_has_cells_for_each_pressure_and_the_load_among_them(run, folder):
    """Two batches together are one; every pressure is borne by all of a cell; a heavier load leaves fewer windows bare.

    The mean falls to that of the scene at its own load, by the shear strength there."""
    batches = [run(contact, CELLS, f"b{first}", first=first, last=first + 10) for first in (0, 10)]
    pressures = [value for size in range(1, 5) if (name := f"at_{size}") in batches[0] for value in batches[0][name]]
    factors = [0.1, 10**-0.5, 10**0.5, 10.0]
    assert set(np.round(np.array(pressures) / NOMINAL, 6)) <= set(np.round(factors, 6))
    force = store.join(batches, "force_1")
    cell = force[0, 0].size * 20e-6 * 25e-6
    np.testing.assert_allclose(force.sum(axis=(2, 3)), np.tile(batches[0]["at_1"] * cell, (len(force), 1)), rtol=1e-9)
    result = run(friction, CELLS, "loads", blocks=[batch.path for batch in batches])
    at = result["over_loads_nominal_pressure"]
    np.testing.assert_allclose(at, sorted([NOMINAL, *pressures]))
    (own,) = np.flatnonzero(at == NOMINAL)
    assert result["over_loads_mean"][own] == pytest.approx(MEAN, rel=1e-12)
    assert result["over_loads_real_area"][own] == pytest.approx(result["real_area"], rel=1e-12)
    assert np.all(np.diff(result["over_loads_real_area"]) > 0)
    assert np.all(np.diff(result["over_loads_no_contact"]) <= 0)
    assert np.all(np.diff(result["over_loads_variation"]) < 0)
    rows = store.table_rows((folder / "loads.csv").read_text())
    assert [float(row["nominal_pressure_pa"]) for row in rows] == pytest.approx(at, rel=1e-5)


def test_a_soft_surface_touches_on_the_load_over_its_hardness(run):
    """An index of 30 by hand; nearly all of the real area bears the hardness, and the log says both."""
    material, roughness = CONTACT["material"], CONTACT["roughness"]
    modulus = material["young_modulus_pa"] / (1 - material["poisson_ratio"] ** 2)
    covariance = covariance_of(*(roughness[key] for key in ("covariance", "rms_height_m", "correlation_length_m")))
    hardness = modulus * rms_slope(covariance, CONTACT["strip"]["cell_m"]) / 30
    load = {"nominal_pressure_pa": 0.1 * hardness, "force_n": 0.1 * hardness * AREA}
    soft = changed(CELLS, material={"hardness_pa": hardness}, load=load)
    result = solved(run, soft, "soft")
    friction_of = run(friction, soft, "soft-friction", blocks=[result.path])
    assert friction_of["plasticity_index"] == result["plasticity_index"] == pytest.approx(30)
    assert 0.9 < friction_of["yielded_share"] < 1
    real = result["area"].sum() / (result["area"].size * 20e-6 * 25e-6)
    assert real == pytest.approx(0.1, rel=0.05)
    elastic = solved(run, CELLS, "elastic")
    assert elastic["plasticity_index"] == 0
    assert not elastic["yielded"].any()
    assert yielding(30.0, 0.954).endswith("H is 30; 95 % of the real area bears the hardness.")
    assert "material.hardness_pa is not given" in yielding(0.0, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("load", "area", "variation"),
    [(0.031, 2.30, 0.150), (0.109, 2.11, 0.094)],
)
def test_real_area_and_scatter_of_windows_over_the_load(run, load, area, variation):
    """A E* h' / N and the coefficient of variation of 25 x 600 um windows, as belts of cells half as long had them.

    64 cells, 2304 windows, know the area to 0.5 % and the variation to 2 %; the belts knew theirs to as much.
    """
    rms, length = 5e-8, 1.416e-5
    pressure = load * 2.1e11 / (1 - 0.3**2) * 2 * rms / length
    scene = changed(
        CELLS,
        roughness={"rms_height_m": rms, "correlation_length_m": length},
        strip={"cell_m": 2.5e-6, "window_m": 6e-4, "window_spacing_m": 1.5e-5, "samples": 288},
        numerics={"contact_tolerance": 1e-4},
        load={"nominal_pressure_pa": pressure},
    )
    result = run(friction, scene, blocks=[solved(run, scene).path])
    assert result["real_area"] / load == pytest.approx(area, rel=0.012)
    assert result["variation"] == pytest.approx(variation, rel=0.06)


@pytest.mark.slow
def test_a_pad_of_many_windows_scatters_as_one_that_is_cut_out(run):
    """Squares of 6 windows along and 24 across, by the powers of the correlation, and cut out of cells of four of them.

    256 of them know their scatter to 4.4 %. That of the model comes from lags along single rows of blocks.
    """
    scene = changed(CELLS, load={"nominal_pressure_pa": 1.5e8})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(domain, "WINDOWS", (24, 24))
        patch.setattr(domain, "FEWEST", 64)
        large = solved(run, scene, "large")
    area, force = blocks_of(large)
    result = run(friction, scene, "pads", blocks=[large.path])
    mean = area.sum() / force.sum()
    influence = (area - mean * force).reshape(64, 4, 30, 1, 24).sum(axis=(2, 4)) / (force.mean() * 30 * 24)
    scatter = MEAN / mean * np.sqrt(np.mean(influence**2))
    at = np.interp(np.log(6 * 24), np.log(WINDOWS), np.log(result["pad_std"]))
    assert scatter == pytest.approx(np.exp(at), rel=0.1)
