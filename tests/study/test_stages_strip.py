"""The stages of the strip: windows of a known contact, an exact expansion, scales, full yield and light load."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import ndtri

from roughslip.contact.edge import contact_shares
from roughslip.contact.influence import Influence
from roughslip.friction.windows import friction_coefficient, window_sums
from roughslip.scene.types import scene_of
from roughslip.study import chaos_strip, contact, expansion_strip
from roughslip.study.from_scene import Stream, domain, geometry
from roughslip.study.from_scene.geometry import training_columns
from roughslip.study.from_scene.surface_model import surface_model
from tests.study.scenes import CONTACT, changed

SQ = 2e-7
CONFIGURATION = changed(
    CONTACT,
    roughness={"correlation_length_across_m": 9e-6},
    strip={"samples": 8, "training_samples": 3},
    numerics={"contact_area": "nodes"},
    expansion={"target": "trial_pressure", "degree": 1},
)
NX, NY, FIRST, COUNT, WINDOW, SPACING = 100, 5, 10, 16, 20, 4  # nodes; first column and number of windows; columns
CELL_AREA = 5e-6**2
COLUMNS = training_columns(slice(FIRST, FIRST + 80))


def windows_of(columns: np.ndarray) -> np.ndarray:
    """Sums over each window, one after the other."""
    starts = FIRST + SPACING * np.arange(COUNT)
    return np.stack([columns[..., start : start + WINDOW].sum(axis=-1) for start in starts], axis=-1)


def windows(blocks: np.ndarray) -> np.ndarray:
    """Sums over windows of five blocks, of arrays (strips, levels, along, across)."""
    return window_sums(blocks[:, :, :, 0], 5, 1)


def strip(number: int) -> np.ndarray:
    """Heights (nx, ny) of the strip of this number; they are the field, as the surface is Gaussian."""
    sample = surface_model(scene_of(CONFIGURATION)).sampler(geometry.strip_grid(scene_of(CONFIGURATION)))
    return sample(np.random.default_rng([7, Stream.STRIP, number]))


def test_blocks_and_training_columns_of_a_known_contact(run, monkeypatch):
    """In place of contact a pressure of 10^6 (1 + level) (1 + i + 100 j) Pa, on every other row."""
    pressed = []
    node = 1 + np.arange(NX)[:, None] + 100.0 * np.arange(NY)

    def sweep(influence, heights, planes, tolerance, hardness_pa):
        pressed.append((influence, heights, planes, tolerance, hardness_pa))
        for level in range(len(planes)):
            pressure = 1e6 * (1 + level) * node * (np.arange(NY) % 2 == 0)
            gap = 1e-9 * (1 + level) * node
            fields = {"pressure": pressure, "contact": pressure > 0, "signed_gap": gap}
            fields |= {"shares": contact_shares(pressure), "yielded_share": 0.0}
            yield SimpleNamespace(residual=0.1 * level, work=5 + level, method="fft", **fields)

    monkeypatch.setattr(domain, "sweep", lambda *given, **named: list(sweep(*given, **named)))
    result = run(contact, CONFIGURATION, first=1, last=5)
    assert result["area"].shape == result["force"].shape == (4, 2, 20, 1)  # as long as the distance of two windows
    np.testing.assert_allclose(result["area"], 3 * SPACING * CELL_AREA)
    np.testing.assert_allclose(result["area_of_nodes"], 3 * 80 * CELL_AREA)
    shares = 0.915 + 0.806 + 0.915  # rows at the border have one neighbour out of contact, the middle one two
    corrected = run(contact, changed(CONFIGURATION, numerics={"contact_area": "corrected"}), "shares", first=1, last=2)
    np.testing.assert_allclose(corrected["area"], shares * SPACING * CELL_AREA)
    columns = (node * [1, 0, 1, 0, 1]).sum(axis=1)
    for level in range(2):
        force = 1e6 * (1 + level) * CELL_AREA * windows_of(columns)
        np.testing.assert_allclose(windows(result["force"])[:, level], np.tile(force, (4, 1)))
    assert result["pressure"].shape == (2, 2, len(COLUMNS), NY)  # strips 1 and 2 of the three that train
    np.testing.assert_allclose(result["pressure"][1, 1, :, ::2], 2e6 * node[COLUMNS, ::2])
    np.testing.assert_allclose(result["gap"][0, 1], 2e-9 * node[COLUMNS])
    np.testing.assert_array_equal(result["residual"], np.tile([0.0, 0.1], (4, 1)))
    assert run.did["convolutions"] == 11  # of the last strip
    assert result.attributes["first"] == 1
    for number, (influence, heights, planes, tolerance, hardness_pa) in enumerate(pressed[:4], start=1):
        np.testing.assert_array_equal(heights, strip(number))
        np.testing.assert_allclose(planes, [SQ * ndtri(0.7), 0.0], atol=1e-22)
        assert tolerance == 1e-10
        assert hardness_pa == math.inf
        assert influence.grid == geometry.strip_grid(scene_of(CONFIGURATION))
    assert pressed[0][0].diagonal == pytest.approx(  # of a square cell under its own load
        4 * 5e-6 * math.log(1 + math.sqrt(2)) / math.pi / (2.1e11 / (1 - 0.3**2))
    )
    assert "pressure" not in run(contact, CONFIGURATION, first=3, last=4)  # no training strip


@pytest.fixture
def linear(stored):
    """Training columns of a contact whose trial pressure is linear in the height, the level and the row, and the whole
    of it on any strip.

    The expansion finds it exactly, and only if strips, columns, rows and levels stay together.
    """
    stiffness = 1 / Influence(geometry.strip_grid(scene_of(CONFIGURATION)), 2.1e11 / (1 - 0.3**2)).diagonal

    def trial(number: int) -> np.ndarray:
        from_border = np.minimum(np.arange(NY), np.arange(NY)[::-1])  # rows alike after half a turn, as of any contact
        rise = np.stack([strip(number) * (1 + from_border), -2 * strip(number) * (1 + from_border)])
        return 1e14 * rise + 1e7 * from_border * np.array([1.0, -1.0])[:, None, None]

    def columns(*numbers: int) -> dict:
        r = np.stack([trial(number)[:, COLUMNS] for number in numbers])
        dimensions = ("training_sample", "level", "column", "y")
        return {
            "pressure": (dimensions, np.maximum(r, 0.0)),
            "gap": (dimensions, np.maximum(-r, 0.0) / stiffness),
        }

    batches = [  # named in another order than numbered; the last has no training strip
        stored("b.nc", {"first": 0}, **columns(0, 1)),
        stored("a.nc", {"first": 2}, **columns(2)),
        stored("c.nc", {"first": 3}, other=(("one",), np.zeros(1))),
    ]
    return trial, batches


def test_an_expansion_finds_a_linear_contact_and_sums_its_windows(run, linear, monkeypatch):
    """10 columns of 3 strips for 7 terms, as a mirror along the strip forbids slope and twist; on strips not seen as
    well. What a window sums is counted node by node; this contact has no far field."""
    monkeypatch.setattr(expansion_strip, "column_influence", lambda *_: np.zeros(NX))
    trial, batches = linear
    fitted = run(chaos_strip, CONFIGURATION, contact=batches)
    assert fitted["coefficients"].shape == (NY, 7, 2)
    assert fitted["leave_one_out"].shape == (NY, 2)
    assert np.all(fitted["leave_one_out"] < 1e-20)
    expansion = fitted.path
    result = run(expansion_strip, CONFIGURATION, expansion=expansion, first=1, last=6)
    for row, number in enumerate(range(1, 6)):
        pressure = np.maximum(trial(number), 0.0)
        np.testing.assert_allclose(
            windows(result["area"])[row],
            CELL_AREA * windows_of(np.count_nonzero(pressure, axis=2).astype(float)),
            rtol=1e-9,
        )
        np.testing.assert_allclose(
            windows(result["force"])[row], CELL_AREA * windows_of(pressure.sum(axis=2)), rtol=1e-9
        )
    assert result.attributes["first"] == 1


COARSE = changed(CONFIGURATION, strip={"expansion_spacing_m": 1e-5, "samples": 2})


def test_the_lattice_lies_in_the_middle_of_the_columns_that_it_stands_for():
    """Every column where the scene does not say; else windows begin with a column of the lattice, and none is left."""
    every = geometry.lattice(scene_of(CONFIGURATION))
    assert (every.spacing, every.first, every.grid) == (1, 0, geometry.strip_grid(scene_of(CONFIGURATION)))
    assert every.middle == slice(FIRST, FIRST + 80)
    for spacing, first_of_windows in ((2, FIRST), (4, FIRST + 1)):
        coarser = changed(CONFIGURATION, strip={"expansion_spacing_m": spacing * 5e-6})
        lattice = geometry.lattice(scene_of(coarser))
        columns = lattice.of(np.arange(NX))
        assert lattice.grid.shape == (len(columns), NY)
        assert (lattice.grid.dx, lattice.grid.dy) == (pytest.approx(spacing * 5e-6), 5e-6)
        np.testing.assert_array_equal(columns[lattice.middle], first_of_windows + spacing * np.arange(80 // spacing))


@pytest.mark.slow
def test_strips_on_the_lattice_alone_have_the_law_of_its_columns_in_whole_strips():
    """Strip 1 was solved, so the lattice holds columns of its field. The others have the covariance of the surface.

    The moments of 12 x 5 nodes of 4000 strips err by at most sqrt(2 / 4000) Sq^2. Four of these bound 3600 moments.
    """
    grid, lattice = geometry.strip_grid(scene_of(COARSE)), geometry.lattice(scene_of(COARSE))
    model = surface_model(scene_of(COARSE))
    draw = expansion_strip.sampler(scene_of(COARSE), model, grid, lattice)
    np.testing.assert_array_equal(draw(1), strip(1)[lattice.first :: 2])
    fields = np.stack([draw(number)[:12].ravel() for number in range(2, 4002)])
    x, y = lattice.grid.dx * np.arange(12), lattice.grid.dy * np.arange(NY)
    lag_x = np.abs(np.subtract.outer(x, x))[:, None, :, None]
    lag_y = np.abs(np.subtract.outer(y, y))[None, :, None, :]
    exact = SQ**2 * np.exp(-((lag_x / 1.5e-5) ** 2) - (lag_y / 9e-6) ** 2).reshape(60, 60)
    np.testing.assert_allclose(fields.T @ fields / 4000, exact, rtol=0, atol=4.5 * math.sqrt(2 / 4000) * SQ**2)


def test_far_contacts_press_a_strip_down(run, linear, monkeypatch):
    """A far field that lifts every column equally gives the windows of a plane that is as much higher.

    With a linear contact at 30 and 50 per cent, both see the mean of the two halfway between the planes.
    """
    _, batches = linear
    expansion = run(chaos_strip, CONFIGURATION, contact=batches).path
    planes = SQ * ndtri(0.7), 0.0
    areas, forces = [], []
    for lift in (0.0, (planes[0] - planes[1]) / 2):

        def lifted_by(_, force, lift=lift):
            forces.append(force)
            return np.full(force.shape, lift)

        monkeypatch.setattr(expansion_strip, "displacement", lifted_by)
        areas.append(run(expansion_strip, CONFIGURATION, expansion=expansion, first=0, last=2))
    plain, lifted = areas
    for name in ("area", "force"):
        np.testing.assert_allclose(lifted[name][:, 0], plain[name][:, 0], rtol=1e-9)
        np.testing.assert_allclose(lifted[name][:, 1], plain[name].mean(axis=1), rtol=1e-9)
    assert abs(np.mean(forces)) < 0.5 * np.mean(np.abs(forces))  # forces less their mean: the plane has that already


LONG = changed(
    CONTACT,
    strip={
        "window_m": 2e-4,
        "penetration_percentiles": [30.0, 50.0, 80.0],
        "training_samples": 6,
        "samples": 6,
    },
    expansion={"target": "squared_pressure", "degree": 1},
)
MODULUS = 2.1e11 / (1 - 0.3**2)


@pytest.fixture(scope="module")
def strips(run):
    """strips(configuration) are the window sums of six solved strips."""

    def solved(configuration: dict, name: str):
        return run(contact, configuration, name, first=0, last=6)

    return solved


@pytest.fixture(scope="module")
def elastic_strips(strips):
    return strips(LONG, "elastic")


def test_friction_of_a_surface_that_yields_is_at_least_shear_strength_over_hardness(strips, elastic_strips):
    """N <= H A on every window at any load. Where nothing yields the contact is the elastic one."""
    hardness = 0.5 * float(np.max(elastic_strips["force"] / np.maximum(elastic_strips["area"], 1e-30)))
    result = strips(changed(LONG, material={"hardness_pa": hardness}), "yields")
    touched = result["area"] > 0
    mu, _ = friction_coefficient(result["area"][touched], result["force"][touched], 1.0, 1e-30)
    # sums of some nodes, in another order than the product
    assert np.all(mu * hardness >= 1 - 1e-12)
    assert mu.max() * hardness > 1.2
    assert np.all(result["area"] >= elastic_strips["area"])  # the plane sinks in further where summits give way
    hard = strips(changed(LONG, material={"hardness_pa": 1e13}), "hard")
    assert np.array_equal(hard["area"], elastic_strips["area"])
    np.testing.assert_allclose(hard["force"], elastic_strips["force"], rtol=1e-8, atol=1e-8 * hard["force"].max())


def test_friction_does_not_change_when_all_lengths_do_and_falls_as_the_modulus_rises(strips, elastic_strips):
    """u, B and the cells have one length, so pressures stay; they are proportional to E*, areas are not."""
    lengths = ("width_m", "cell_m", "window_m", "window_spacing_m")
    larger = changed(
        LONG,
        roughness={"rms_height_m": 4 * SQ, "correlation_length_m": 4 * 1.5e-5},
        strip={name: 4 * LONG["strip"][name] for name in lengths},
    )
    scaled, stiff = (
        strips(larger, "larger"),
        strips(changed(LONG, material={"young_modulus_pa": 8 * 2.1e11}), "stiff"),
    )
    # powers of two change no digit; the area of a node near the edge of contact could differ only by a node
    np.testing.assert_allclose(scaled["area"], 16 * elastic_strips["area"], rtol=1e-12)
    np.testing.assert_allclose(scaled["force"], 16 * elastic_strips["force"], rtol=1e-8)
    np.testing.assert_allclose(stiff["area"], elastic_strips["area"], rtol=1e-12)
    np.testing.assert_allclose(stiff["force"], 8 * elastic_strips["force"], rtol=1e-8)


def test_expansion_of_a_strip_that_yields_follows_the_solved_windows(run, strips, elastic_strips):
    """The expansion keeps p <= H, so N <= H A in its windows too; its friction lies as near as on elastic strips."""
    hardness = 0.7 * float(np.max(elastic_strips["force"] / np.maximum(elastic_strips["area"], 1e-30)))
    configuration = changed(LONG, material={"hardness_pa": hardness})
    solved = strips(configuration, "training")
    fitted = run(chaos_strip, configuration, contact=[solved.path])
    result = run(expansion_strip, configuration, expansion=fitted.path, first=0, last=6)
    assert np.all(result["force"] <= hardness * result["area"] * (1 + 1e-12))
    capped = np.isclose(solved["pressure"], hardness, rtol=1e-15)
    assert 0.02 < capped[:, 2].mean() < 0.9  # some yield, and not all
    deep = 2
    mu = [np.divide(*(source[name][:, deep].sum(axis=1) for name in ("area", "force"))) for source in (solved, result)]
    np.testing.assert_allclose(mu[1].mean(), mu[0].mean(), rtol=0.1)
