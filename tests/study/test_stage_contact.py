"""From contact to friction: stored blocks, expansions and statistics of strips and periodic cells obey identities."""

import math

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from scipy.special import erf, ndtri

from roughslip import store
from roughslip.contact.influence import Influence
from roughslip.contact.solve import solve
from roughslip.friction import scatter_of_friction
from roughslip.friction.pad import WINDOWS, pad_edges
from roughslip.scene.types import scene_of
from roughslip.study import expansion_strip, page
from roughslip.study.from_scene import domain, geometry
from roughslip.study.from_scene.surface_model import surface_model
from roughslip.study.graph import STAGES
from roughslip.surface.models import covariance_of
from roughslip.surface.plausibility import rms_slope, yielding
from tests.study.conftest import CONTACT, MODULUS, SQ, changed, job_of

STRIPS, MANY, TRAINED = 12, 40, 6
LEVELS = np.array([20.0, 50.0, 90.0])
SCENE = changed(
    CONTACT,
    roughness={"correlation_length_across_m": 9e-6},
    strip={"penetration_percentiles": LEVELS.tolist(), "samples": STRIPS, "training_samples": TRAINED},
    numerics={"contact_area": "corrected"},
    expansion={"target": "squared_pressure", "degree": 1},
    friction={"mean": 0.3},
    oscillator={"normal_force_n": 50.0},
)
NX, NY, FIRST, CELL = 100, 5, 10, 25e-12  # nodes of a strip, first of the 80 columns under windows; m2
COLUMNS = np.arange(FIRST + 4, FIRST + 80, 8)  # whose pressure and gap train the expansion
PLANES = -SQ * ndtri(LEVELS / 100)
WINDOW_AREA = 1e-4 * 2.5e-5
STRIP = 4  # stream of random numbers


def strip(number: int, scene: dict = SCENE) -> np.ndarray:
    """Heights (nx, ny) of the strip of this number; they are the field, as the surface is Gaussian."""
    sample = surface_model(scene_of(scene)).sampler(geometry.strip_grid(scene_of(scene)))
    return sample(np.random.default_rng([7, STRIP, number]))


def windows(blocks: np.ndarray) -> np.ndarray:
    """Sums of five blocks one behind the other, of arrays (strips, levels, along, 1)."""
    return sliding_window_view(blocks[..., 0], 5, axis=-1).sum(axis=-1)


@pytest.fixture(scope="module")
def chain(run):
    """Results from contact to friction: two batches, named in another order than numbered, of 12 of 40 strips."""
    late, early = (run("contact", SCENE, name, first=k, last=n) for name, k, n in (("a", 5, STRIPS), ("b", 0, 5)))
    expanded = run("expansion_strip", SCENE, contact=[late.path, early.path])
    blocks = [late.path, early.path, expanded.path]
    return early, late, expanded, run("friction", SCENE, "chain", {"REPLICATES": 100}, blocks=blocks)


def test_blocks_and_training_columns_are_those_of_a_solve_of_each_strip(run, chain):
    """Alone, from heights that follow from its number, at a plane above which the share of heights lies."""
    early, late, *_ = chain
    assert (early.attributes["first"], late.attributes["first"]) == (0, 5)
    for batch, row in ((early, 3), (late, 0), (late, 6)):
        heights = strip(row + int(batch.attributes["first"]))
        assert batch["number"][row] == row + batch.attributes["first"]
        for level, plane in enumerate(PLANES):
            solution = solve(Influence(geometry.strip_grid(scene_of(SCENE)), MODULUS), heights - plane, 1e-12)
            parts = solution.pressure, solution.shares, solution.contact.astype(float)
            sums = [part[FIRST : FIRST + 80].reshape(20, 4 * NY).sum(axis=1) for part in parts]
            force, area, nodes = CELL * np.array(sums)
            np.testing.assert_allclose(batch["force"][row, level, :, 0], force, rtol=1e-6, atol=1e-9 * force.max())
            np.testing.assert_allclose(batch["area"][row, level, :, 0], area, rtol=1e-6, atol=1e-6 * CELL)
            assert batch["area_of_nodes"][row, level] == pytest.approx(nodes.sum(), rel=1e-12)
            assert 0.0 <= batch["residual"][row, level] < 1e-9
            if row + batch.attributes["first"] < TRAINED:
                pressure, gap = solution.pressure[COLUMNS], solution.gap[COLUMNS]
                np.testing.assert_allclose(batch["pressure"][row, level], pressure, atol=1e-7 * pressure.max())
                np.testing.assert_allclose(batch["gap"][row, level], gap, atol=1e-7 * SQ)
    assert (len(early["pressure"]), len(late["pressure"])) == (5, 1)
    nodes = run("contact", changed(SCENE, numerics={"contact_area": "nodes"}), "nodes", first=6, last=8)
    np.testing.assert_allclose(nodes["area"].sum(axis=(2, 3)), nodes["area_of_nodes"], rtol=1e-12)
    np.testing.assert_array_equal(nodes["force"], late["force"][1:3])
    assert "pressure" not in nodes


def test_what_follows_from_blocks_by_hand(chain, folder):
    """All means over windows: tau from the mean at the median, moments, force, pressure, and what the load needs."""
    early, late, expanded, result = chain
    area, force = (windows(np.concatenate([early[name], late[name]])) for name in ("area", "force"))
    shear = float(result["shear_strength"])

    def friction_of(a, n):
        touches = a >= 1e-3 * WINDOW_AREA
        return np.where(touches, shear * a / np.where(touches, n, 1.0), np.nan)

    mu, of_new = friction_of(area, force), friction_of(*(windows(expanded[k][STRIPS:]) for k in ("area", "force")))
    assert result["combined_mean"][1] == pytest.approx(0.3, rel=1e-12)
    for name, moment in (("mean", np.nanmean), ("std", np.nanstd)):
        np.testing.assert_allclose(result[name], [moment(each, axis=(0, 2)) for each in (mu, of_new)], rtol=1e-9)
    np.testing.assert_allclose(result["missing_share"], np.isnan(mu).mean(axis=(0, 2)), atol=1e-12)
    assert 0 < result["missing_share"][0] < 0.5
    np.testing.assert_allclose(result["ratio_of_sums"], shear * area.sum(axis=(0, 2)) / force.sum(axis=(0, 2)))
    np.testing.assert_allclose(result["force_per_window"], force.mean(axis=(0, 2)), rtol=1e-12)
    np.testing.assert_allclose(result["nominal_pressure"], force.mean(axis=(0, 2)) / WINDOW_AREA, rtol=1e-12)
    np.testing.assert_allclose(result["load_windows"], 50.0 / force.mean(axis=(0, 2)), rtol=1e-12)
    for level, number in enumerate(result["load_windows"]):  # between stored pads on a power law
        logs = np.log(result["pad_windows"]), np.log(result["pad_std"][level])
        assert np.log(result["load_std"][level]) == pytest.approx(np.interp(np.log(max(number, 1.0)), *logs))
    # blocks give a window the scatter of its influence; windows share the middle of a strip, blocks do not
    mean = result["ratio_of_sums"]
    influence = np.sqrt(np.mean((shear * area - mean[:, None] * force) ** 2, axis=(0, 2))) / force.mean(axis=(0, 2))
    of_blocks = result["pad_std"][:, 0] * result["std"][0] / result["combined_std"]
    np.testing.assert_allclose(of_blocks[1:], influence[1:], rtol=0.1)
    np.testing.assert_allclose(result["lag"], 2e-5 * np.arange(16), atol=1e-18)
    np.testing.assert_allclose(result["triangle"], np.maximum(1 - result["lag"] / 1e-4, 0.0), atol=1e-12)
    # a Gaussian correlation over all pairs of points of a window, along times across
    ratios = np.array([1.5e-5 / 1e-4, 9e-6 / 2.5e-5])
    pairs = math.sqrt(math.pi) * ratios * erf(1 / ratios) + ratios**2 * np.expm1(-(ratios**-2))
    assert result["pad_means"][0, 0, 0] == pytest.approx(np.prod(pairs), rel=1e-3)
    median = mu[:, 1]
    edges, counts = result["standard_edge"], result["standard_histogram"][1] * np.diff(result["standard_edge"])
    standard = (median - median.mean()) / median.std()
    np.testing.assert_allclose(counts, np.histogram(standard, edges)[0] / median.size, atol=1e-12)
    for name in ("mean", "std"):
        levels = result[f"combined_{name}"]
        np.testing.assert_allclose(result[f"trend_combined_{name}_change"], levels[-1] - levels[0], rtol=1e-9)
    rows = store.table_rows((folder / "chain-summary.csv").read_text())
    for column in ("percentile", "combined_mean", "combined_std", "nominal_pressure_pa"):
        stored = result[column.removesuffix("_pa")]
        assert [float(row[column]) for row in rows] == pytest.approx(stored, rel=1e-5)


def test_the_expansion_is_a_control_that_makes_the_mean_surer(chain):
    """Forty strips by it count for more than the twelve that are solved; its blocks have their area and force."""
    early, late, expanded, result = chain
    solved = {name: np.concatenate([early[name], late[name]]) for name in ("area", "force")}
    for name, blocks in solved.items():
        both = [part.sum(axis=(2, 3))[:, 1] for part in (blocks, expanded[name][:STRIPS])]
        assert np.corrcoef(both)[0, 1] > 0.9
        np.testing.assert_allclose(both[1].mean(), both[0].mean(), rtol=0.1)
    widths = {name: result[f"{name}_high"] - result[f"{name}_low"] for name in ("mean", "combined_mean")}
    gain = (widths["mean"][0, 2] / widths["combined_mean"][2]) ** 2
    assert 1.2 < gain < MANY / STRIPS, gain
    np.testing.assert_array_equal(expanded["leave_one_out"], expanded["leave_one_out"][::-1])  # rows alike after a turn


LINEAR = changed(
    SCENE,
    strip={"penetration_percentiles": [30.0, 50.0], "samples": 8, "training_samples": 3},
    numerics={"contact_area": "nodes"},
    expansion={"target": "trial_pressure", "degree": 1},
)


def test_an_expansion_finds_a_linear_contact_and_far_contacts_press_it_down(run, stored, monkeypatch):
    """A trial pressure that is linear in height, level and row is found exactly, and only if strips, columns, rows and
    levels stay together. 10 columns of 3 strips for 7 terms, as a mirror along the strip forbids slope and twist.

    A far field that lifts all columns equally gives the windows of a plane that is as much higher: halfway between the
    planes both levels see the mean of the two.
    """
    stiffness = 1 / Influence(geometry.strip_grid(scene_of(LINEAR)), MODULUS).diagonal

    def trial(number: int) -> np.ndarray:
        from_border = np.minimum(np.arange(NY), np.arange(NY)[::-1])  # rows alike after half a turn, as of any contact
        rise = np.stack([strip(number, LINEAR) * (1 + from_border), -2 * strip(number, LINEAR) * (1 + from_border)])
        return 1e14 * rise + 1e7 * from_border * np.array([1.0, -1.0])[:, None, None]

    def columns(*numbers: int) -> dict:
        r, dimensions = np.stack([trial(n)[:, COLUMNS] for n in numbers]), ("training_sample", "level", "column", "y")
        return {"pressure": (dimensions, np.maximum(r, 0.0)), "gap": (dimensions, np.maximum(-r, 0.0) / stiffness)}

    batches = [  # named in another order than numbered; the last has no training strip
        stored("two.nc", {"first": 0}, **columns(0, 1)),
        stored("one.nc", {"first": 2}, **columns(2)),
        stored("zero.nc", {"first": 3}, other=(("one",), np.zeros(1))),
    ]
    monkeypatch.setattr(expansion_strip, "column_influence", lambda *_: np.zeros(NX))
    plain = run("expansion_strip", LINEAR, "plain", contact=batches)
    assert np.all(plain["leave_one_out"] < 1e-20)
    for number in range(6):
        pressure = np.maximum(trial(number), 0.0)[:, FIRST : FIRST + 80].reshape(2, 20, 4 * NY)
        for name, nodes in (("area", pressure > 0), ("force", pressure)):
            sums = CELL * nodes.sum(axis=2)
            np.testing.assert_allclose(plain[name][number, :, :, 0], sums, rtol=1e-9, atol=1e-9 * sums.max())
    forces, lift = [], SQ * (ndtri(0.7) - ndtri(0.5)) / 2

    def lifted_by(_, force):
        forces.append(force)
        return np.full(force.shape, lift)

    monkeypatch.setattr(expansion_strip, "displacement", lifted_by)
    lifted = run("expansion_strip", LINEAR, "lifted", contact=batches)
    for name in ("area", "force"):
        np.testing.assert_allclose(lifted[name][:, 0], plain[name][:, 0], rtol=1e-9)
        np.testing.assert_allclose(lifted[name][:, 1], plain[name].mean(axis=1), rtol=1e-9)
    assert abs(np.mean(forces)) < 0.5 * np.mean(np.abs(forces))  # forces less their mean: the plane has that already


@pytest.mark.parametrize(("spacing", "first"), [(1, FIRST), (2, FIRST), (4, FIRST + 1)])
def test_the_lattice_lies_in_the_middle_of_the_columns_that_it_stands_for(spacing, first):
    """Windows begin with a column of the lattice, and none is left. Of a solved strip it holds the columns; others are
    drawn on it alone with the covariance of the surface. Moments of 400 strips err by sqrt(2 / 400) Sq^2 at most."""
    scene = scene_of(changed(SCENE, strip={"expansion_spacing_m": spacing * 5e-6, "samples": 2}))
    lattice, grid = geometry.lattice(scene), geometry.strip_grid(scene)
    columns = lattice.of(np.arange(NX))
    assert lattice.grid.shape == (len(columns), NY)
    assert (lattice.grid.dx, lattice.grid.dy) == (pytest.approx(spacing * 5e-6), 5e-6)
    np.testing.assert_array_equal(columns[lattice.middle], first + spacing * np.arange(80 // spacing))
    draw = expansion_strip.sampler(scene, surface_model(scene), grid, lattice)
    np.testing.assert_array_equal(draw(1), strip(1)[columns])
    fields = np.stack([draw(number)[:12].ravel() for number in range(2, 402)])
    x, y = lattice.grid.dx * np.arange(12), lattice.grid.dy * np.arange(NY)
    lags = [np.subtract.outer(place, place) ** 2 for place in (x, y)]
    exact = SQ**2 * np.exp(-lags[0][:, None, :, None] / 1.5e-5**2 - lags[1][None, :, None, :] / 9e-6**2)
    assert np.max(np.abs(fields.T @ fields / 400 - exact.reshape(60, 60))) < 4.5 * math.sqrt(2 / 400) * SQ**2


def test_contact_scales_with_lengths_and_modulus_and_bears_no_more_than_the_hardness(run, chain):
    """u, B and the cells have one length, so pressures stay; they are proportional to E*, areas are not.

    N <= H A on every block at any load, also by the expansion. Where nothing yields the contact is the elastic one.
    """
    elastic = chain[0]
    keys = ("width_m", "cell_m", "window_m", "window_spacing_m")
    roughness = {"rms_height_m": 4 * SQ, "correlation_length_m": 6e-5, "correlation_length_across_m": 3.6e-5}
    larger = changed(SCENE, roughness=roughness, strip={key: 4 * SCENE["strip"][key] for key in keys})
    # powers of two change no digit; the area of a node near the edge of contact could differ only by a node
    for scene, area, force in ((larger, 16, 16), (changed(SCENE, material={"young_modulus_pa": 1.68e12}), 1, 8)):
        result = run("contact", scene, "scaled", first=0, last=5)
        np.testing.assert_allclose(result["area"], area * elastic["area"], rtol=1e-12)
        np.testing.assert_allclose(result["force"], force * elastic["force"], rtol=1e-8)
    hardness = 0.5 * float(elastic["pressure"].max())
    soft = changed(SCENE, material={"hardness_pa": hardness}, numerics={"contact_area": "nodes"})
    solved = run("contact", soft, "soft", first=0, last=TRAINED)
    expanded = run("expansion_strip", soft, "soft-expanded", contact=[solved.path])
    for result in (solved, expanded):
        assert np.all(result["force"] <= hardness * result["area"] * (1 + 1e-12))
    assert np.all(solved["area_of_nodes"][:5] >= elastic["area_of_nodes"])  # the plane sinks in: summits give way
    assert 0.02 < np.isclose(solved["pressure"], hardness, rtol=1e-15)[:, 2].mean() < 0.9
    mu = [
        np.divide(*(each[name][:TRAINED, 2].sum(axis=1) for name in ("area", "force"))) for each in (solved, expanded)
    ]
    np.testing.assert_allclose(mu[1].mean(), mu[0].mean(), rtol=0.1)
    hard = run("contact", changed(SCENE, material={"hardness_pa": 1e13}), "hard", first=0, last=5)
    np.testing.assert_array_equal(hard["area"], elastic["area"])


NOMINAL, AREA, MEAN = 4e8, 1e-7, 0.25
CELLS = changed(
    CONTACT,
    strip={"samples": 20},
    numerics={"contact_area": "corrected", "contact_tolerance": 1e-5},
    friction={"mean": MEAN},
    load={"force_n": NOMINAL * AREA, "nominal_pressure_pa": NOMINAL},
    oscillator={"windows_in_parallel": 40},
)
BLOCK = 20e-6 * 25e-6


@pytest.fixture(scope="module")
def cells(run):
    """Contact of cells in two batches, and friction of the pad."""
    batches = [run("contact", CELLS, f"cells{first}", first=first, last=first + 10) for first in (0, 10)]
    return batches, run("friction", CELLS, "cells", blocks=[batch.path for batch in batches])


def of_load(batches):
    """Area and force (cells, along, across) under the load of the scene."""
    return (np.concatenate([batch[name][:, 0] for batch in batches]) for name in ("area", "force"))


def test_every_cell_bears_its_pressure_and_is_the_same_alone(run, cells):
    """Six windows along and six across, 8 x 15 um: 30 x 6 blocks of 20 x 25 um. 20 cells of 36 windows for 90 of 8."""
    area, force = of_load(cells[0])
    assert force.shape == (16, 30, 6)
    np.testing.assert_allclose(force.sum(axis=(1, 2)), NOMINAL * 180 * BLOCK, rtol=1e-12)
    assert np.all(area[force == 0.0] == 0.0)
    more = run("contact", changed(CELLS, strip={"samples": 90}), "more", {}, first=0, last=9)
    np.testing.assert_array_equal(more["force"][:, 0], force[:2])
    there = np.concatenate([cells[0][0][name] for name in cells[0][0] if name.startswith("at_")])
    assert set(np.round(there / NOMINAL, 6)) <= {0.1, 0.316228, 3.162278, 10.0}
    at, loaded = cells[0][0]["at_1"], np.concatenate([batch["force_1"] for batch in cells[0]])
    whole = loaded[0, 0].size * BLOCK
    np.testing.assert_allclose(loaded.sum(axis=(2, 3)), np.tile(at * whole, (len(loaded), 1)), rtol=1e-9)
    # a figure solves the first of these cells from what it reads
    own = domain.own_cells(scene_of(CELLS, STAGES["figure_chain"].keys), None)
    (solution,) = own.solutions(own.heights(0))
    np.testing.assert_array_equal(own.blocks(solution.pressure), force[0])


@pytest.mark.parametrize(
    ("light_area", "lengths", "edges"),
    [
        (1.0, (15e-6, 15e-6), (600e-6, 150e-6)),
        (1.0, (15e-6, 1e-6), (600e-6, 50e-6)),
        (1.0, (150e-6, 15e-6), (1200e-6, 150e-6)),
        (4 * 15e-6**2 / (600e-6 * 300e-6), (15e-6, 15e-6), (600e-6, 300e-6)),
        (1e-9, (15e-6, 15e-6), (9600e-6, 4800e-6)),  # twice as many nodes would be more than 2^21
    ],
)
def test_a_cell_follows_from_windows_correlation_and_contacts(light_area, lengths, edges):
    """Six windows of 100 um and two of 25 um, 8 L = 120 um: 600 x 150 um. A light load doubles the shorter edge."""
    grid = domain.mesh_of(scene_of(CELLS), lengths, light_area)
    assert (grid.nx * grid.dx, grid.ny * grid.dy) == pytest.approx(edges)


def test_friction_under_the_load_by_hand(run, cells, folder):
    """All windows of five blocks, around the period too. Their first-order influence has the variance of a pad of one.

    Shear strength gives sum(A) tau / sum(N) the mean of the scene; real area over apparent area is that of all blocks.
    Over loads the mean is that of the scene at its own load; a heavier load leaves fewer windows bare.
    """
    (batches, result), (area, force) = cells, of_load(cells[0])
    tau = MEAN * force.sum() / area.sum()
    assert result["shear_strength"] == pytest.approx(tau, rel=1e-12)
    assert result["real_area"] == pytest.approx(area.sum() / (area.size * BLOCK), rel=1e-12)
    a, n = (
        sliding_window_view(np.concatenate([part, part[:, :4]], axis=1), 5, axis=1).sum(-1) for part in (area, force)
    )
    touches = a >= 1e-3 * WINDOW_AREA
    mu = tau * a[touches] / n[touches]
    assert result["mean"] == pytest.approx(mu.mean(), rel=1e-9)
    assert result["std"] == pytest.approx(mu.std(), rel=1e-9)
    assert result["no_contact"] == pytest.approx(np.mean(n == 0.0), rel=1e-9)
    assert result["missing_share"] == pytest.approx(1.0 - touches.mean(), rel=1e-9)
    assert 0.0 < result["no_contact"] <= result["missing_share"] < 0.1
    within = ((tau * a - MEAN * n) / (5 * force.mean()))[:, :26]  # that do not reach around the period
    assert result["pad_std"][0] == pytest.approx(np.sqrt(np.mean(within**2)), rel=1e-9)
    of_pad = np.interp(np.log(40.0), np.log(WINDOWS), np.log(result["pad_std"]))
    assert np.log(result["load_std"]) == pytest.approx(of_pad, abs=1e-9)
    np.testing.assert_allclose(result["lag"], 20e-6 * np.arange(16), atol=1e-18)  # up to half of the period
    law = covariance_of("gaussian", SQ, 1.5e-5), MODULUS, NOMINAL, pad_edges(40, 1e-4, 2.5e-5, None)
    assert result["load_std_by_law"] == pytest.approx(MEAN * scatter_of_friction(*law), rel=1e-9)
    for name in ("shear_strength", "real_area", "load_std", "std"):
        assert result[f"{name}_low"] < result[name] < result[f"{name}_high"]
    twice = run("friction", changed(CELLS, friction={"mean": 0.5}), "twice", blocks=[batch.path for batch in batches])
    assert twice["load_mean"] == 0.5
    np.testing.assert_allclose(twice["pad_std"], 2 * result["pad_std"], rtol=1e-9)
    at = result["over_loads_nominal_pressure"]
    np.testing.assert_array_equal(at, np.sort(at))
    (own,) = np.flatnonzero(at == NOMINAL)
    assert result["over_loads_mean"][own] == pytest.approx(MEAN, rel=1e-12)
    assert result["over_loads_real_area"][own] == pytest.approx(result["real_area"], rel=1e-12)
    heavy, many = int(np.flatnonzero(at == batches[0]["at_1"][0])[0]), [batch["area_1"][:, 0] for batch in batches]
    real = np.mean(np.concatenate(many)) / BLOCK
    assert result["over_loads_real_area"][heavy] == pytest.approx(real, rel=1e-12)
    assert result["over_loads_mean"][heavy] == pytest.approx(tau * real / at[heavy], rel=1e-12)
    assert np.all(np.diff(result["over_loads_real_area"]) > 0)
    assert np.all(np.diff(result["over_loads_no_contact"]) <= 0)
    assert np.all(np.diff(result["over_loads_variation"]) < 0)
    rows = store.table_rows((folder / "cells-summary.csv").read_text())
    assert [float(row["nominal_pressure_pa"]) for row in rows] == pytest.approx(at, rel=1e-5)


def test_a_soft_surface_touches_on_the_load_over_its_hardness(run, cells, monkeypatch):
    """An index of 30 by hand; nearly all of the real area bears the hardness, and the log says both."""
    monkeypatch.setattr(domain, "FACTORS", ())
    covariance = covariance_of("gaussian", SQ, 1.5e-5)
    hardness = MODULUS * rms_slope(covariance, 5e-6) / 30
    load = {"nominal_pressure_pa": 0.1 * hardness, "force_n": 0.1 * hardness * AREA}
    soft = changed(CELLS, material={"hardness_pa": hardness}, load=load)
    solved = run("contact", soft, "soft-cells", first=0, last=20)
    result = run("friction", soft, "soft-friction", blocks=[solved.path])
    assert result["plasticity_index"] == solved["plasticity_index"] == pytest.approx(30)
    assert 0.9 < result["yielded_share"] < 1
    assert result["real_area"] == pytest.approx(0.1, rel=0.05)
    assert cells[0][0]["plasticity_index"] == 0
    assert not cells[0][0]["yielded"].any()
    assert yielding(30.0, 0.954).endswith("H is 30; 95 % of the real area bears the hardness.")


def test_the_page_judges_friction_of_strips_and_says_the_scatter_of_a_pad(chain, cells, folder):
    """The paper has no load, so that friction under one is not judged."""
    of_strips, of_load = chain[-1], cells[1]
    (_, text) = page.represented({"friction/statistics.nc": of_load.path}, ["friction"], ["figure5"])["figure5"]
    assert text.startswith(f"Friction of the pad scatters by {of_load['load_std'] / MEAN:.2%}; the law of scatter")
    assert text.endswith(f" {of_load['load_std_by_law'] / MEAN:.2%}.")
    for one, is_judged in ((of_strips, True), (of_load, False)):
        claims = page.judged(job_of("page", {"targets": []}, folder / "report.html", friction=one.path))
        assert any(claim["verdict"] != "not tested" for claim in claims) == is_judged


@pytest.mark.nightly
def test_a_pad_of_many_windows_scatters_as_one_that_is_cut_out(run, monkeypatch):
    """Squares of 6 windows along and 24 across, by the powers of the correlation, and cut out of cells of four of them.

    256 of them know their scatter to 4.4 %. That of the model comes from lags along single rows of blocks.
    """
    monkeypatch.setattr(domain, "FACTORS", ())
    monkeypatch.setattr(domain, "WINDOWS", (24, 24))
    monkeypatch.setattr(domain, "FEWEST", 64)
    scene = changed(CELLS, load={"nominal_pressure_pa": 1.5e8})
    large = run("contact", scene, "large", first=0, last=20)
    area, force = of_load([large])
    result = run("friction", scene, "pads", blocks=[large.path])
    mean = area.sum() / force.sum()
    influence = (area - mean * force).reshape(64, 4, 30, 1, 24).sum(axis=(2, 4)) / (force.mean() * 30 * 24)
    scatter = MEAN / mean * np.sqrt(np.mean(influence**2))
    at = np.interp(np.log(6 * 24), np.log(WINDOWS), np.log(result["pad_std"]))
    assert scatter == pytest.approx(np.exp(at), rel=0.1)
