"""The stages of the strip, their numbers against closed forms: windows of a known contact, an expansion that is exact,
friction of known windows."""

import csv
import io
import math
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import ndtri

from roughslip.contact.influence import Influence
from roughslip.scene.types import scene_of
from roughslip.stages import chaos_strip, contact_strip, expansion_strip, friction
from roughslip.stages.from_scene import geometry
from roughslip.stages.from_scene.geometry import training_columns
from roughslip.stages.from_scene.surface_model import surface_model
from tests.stages.scenes import CONTACT, changed

SQ = 2e-7
CONFIGURATION = changed(
    CONTACT,
    roughness={"correlation_length_across_m": 9e-6},
    strip={"samples": 8, "training_samples": 3},
    expansion={"target": "trial_pressure", "degree": 1},
    friction={"mean_at_median": 0.3, "least_contact_fraction": 0.001},
)
NX, NY, FIRST, COUNT, WINDOW, SPACING = 88, 5, 4, 16, 20, 4  # nodes; first column and number of windows; columns
CELL_AREA = 5e-6**2
HOW = {"method": "fft", "nodes": NX * NY, "start": "given"}  # solutions were found
COLUMNS = training_columns(slice(FIRST, FIRST + 80))


def windows_of(columns: np.ndarray) -> np.ndarray:
    """Sums over each window, one after the other."""
    starts = FIRST + SPACING * np.arange(COUNT)
    return np.stack([columns[..., start : start + WINDOW].sum(axis=-1) for start in starts], axis=-1)


def strip(number: int) -> np.ndarray:
    """Heights (nx, ny) of the strip of this number; they are the field, as the surface is Gaussian."""
    sample = surface_model(scene_of(CONFIGURATION)).sampler(geometry.strip_grid(scene_of(CONFIGURATION)))
    return sample(np.random.default_rng([7, geometry.STREAM_STRIP, number]))


def test_windows_and_training_columns_of_a_known_contact(run, monkeypatch):
    """In place of contact a pressure of 10^6 (1 + level) (1 + i + 100 j) Pa, on every other row."""
    pressed = []
    node = 1 + np.arange(NX)[:, None] + 100.0 * np.arange(NY)

    def sweep(influence, heights, planes, tolerance, hardness_pa):
        pressed.append((influence, heights, planes, tolerance, hardness_pa))
        for level in range(len(planes)):
            pressure = 1e6 * (1 + level) * node * (np.arange(NY) % 2 == 0)
            gap = 1e-9 * (1 + level) * node
            yield SimpleNamespace(pressure=pressure, signed_gap=gap, residual=0.1 * level, work=5 + level, **HOW)

    monkeypatch.setattr(contact_strip, "sweep", sweep)
    found = run(contact_strip, CONFIGURATION, first=1, last=5)
    assert found["area"].shape == found["force"].shape == (4, 2, COUNT)
    np.testing.assert_allclose(found["area"], 3 * WINDOW * CELL_AREA)
    columns = (node * [1, 0, 1, 0, 1]).sum(axis=1)
    for level in range(2):
        force = 1e6 * (1 + level) * CELL_AREA * windows_of(columns)
        np.testing.assert_allclose(found["force"][:, level], np.tile(force, (4, 1)))
    assert found["pressure"].shape == (2, 2, len(COLUMNS), NY)  # strips 1 and 2 of the three that train
    np.testing.assert_allclose(found["pressure"][1, 1, :, ::2], 2e6 * node[COLUMNS, ::2])
    np.testing.assert_allclose(found["gap"][0, 1], 2e-9 * node[COLUMNS])
    np.testing.assert_array_equal(found["residual"], np.tile([0.0, 0.1], (4, 1)))
    np.testing.assert_array_equal(found["work"], np.tile([5, 6], (4, 1)))
    assert found.attributes["first"] == 1
    for number, (influence, heights, planes, tolerance, hardness_pa) in enumerate(pressed, start=1):
        np.testing.assert_array_equal(heights, strip(number))
        np.testing.assert_allclose(planes, [SQ * ndtri(0.7), 0.0], atol=1e-22)
        assert tolerance == 1e-10
        assert hardness_pa == math.inf
        assert influence.grid == geometry.strip_grid(scene_of(CONFIGURATION))
    assert pressed[0][0].diagonal == pytest.approx(  # of a square cell under its own load
        4 * 5e-6 * math.log(1 + math.sqrt(2)) / math.pi / (2.1e11 / (1 - 0.3**2))
    )


def test_without_training_strips_there_are_no_columns(run, monkeypatch):
    fields = {"pressure": np.ones((NX, NY)), "signed_gap": np.zeros((NX, NY)), "residual": 0.0, "work": 1}
    solution = SimpleNamespace(**fields, **HOW)
    monkeypatch.setattr(contact_strip, "sweep", lambda *_, **__: [solution, solution])
    assert "pressure" not in run(contact_strip, CONFIGURATION, first=3, last=4)


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
    assert np.all(fitted["condition_number"] < 100)
    expansion = fitted.path
    found = run(expansion_strip, CONFIGURATION, expansion=expansion, first=1, last=6)
    for row, number in enumerate(range(1, 6)):
        pressure = np.maximum(trial(number), 0.0)
        np.testing.assert_allclose(
            found["area"][row], CELL_AREA * windows_of(np.count_nonzero(pressure, axis=2).astype(float)), rtol=1e-9
        )
        np.testing.assert_allclose(found["force"][row], CELL_AREA * windows_of(pressure.sum(axis=2)), rtol=1e-9)
    assert found.attributes["first"] == 1


STRIPS, MANY, WINDOWS = 12, 40, 60
FRICTION = changed(CONFIGURATION, strip={"penetration_percentiles": [10.0, 50.0, 90.0], "window_spacing_m": 1e-5})


@pytest.fixture(scope="module")
def friction_of_known_windows(run, stored):
    """A / N of the expansion is correlated with that of the solved windows; the levels lie at 3, 2 and 1 in 1e-9 / Pa.

    One window has less than the least contact, 0.001 of 0.1 x 0.025 mm^2, and one a little more.

    Returns result, solved and expanded A / N (strips, levels, windows), the former NaN where the contact is too small,
    and the solved sum(A) / sum(N) by level.
    """
    rng = np.random.default_rng(5)
    noise = np.apply_along_axis(np.convolve, 2, rng.standard_normal((MANY, 3, WINDOWS + 9)), np.ones(10) / 10, "valid")
    levels = np.array([3.0, 2.0, 1.0])[None, :, None]
    expanded = 1e-9 * (levels * 1.5 + 0.2 * noise)
    solved = 1e-9 * (levels + 0.2 * noise[:STRIPS] + 0.02 * rng.standard_normal((STRIPS, 3, WINDOWS)))
    shape = ("sample", "level", "window")
    area = {name: 1e-10 * rng.uniform(1, 2, ratio.shape) for name, ratio in (("s", solved), ("e", expanded))}
    area["s"][:2, 2, 0] = 2.4e-12, 2.6e-12
    contact = []
    for name, first, last in (("z", 0, 5), ("y", 5, STRIPS)):  # named in another order than numbered
        part = slice(first, last)
        fields = {"area": (shape, area["s"][part]), "force": (shape, area["s"][part] / solved[part])}
        residual = (("sample", "level"), np.full((last - first, 3), 1e-11 * (1 + first)))
        contact.append(stored(f"{name}.nc", {"first": first}, residual=residual, **fields))
    expansion = stored("e.nc", {"first": 0}, area=(shape, area["e"]), force=(shape, area["e"] / expanded))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction, "REPLICATES", 40)  # intervals have tests of their own
        found = run(friction, FRICTION, contact=contact, expansion=[expansion])
    total = area["s"].sum(axis=(0, 2)) / (area["s"] / solved).sum(axis=(0, 2))
    solved[0, 2, 0] = np.nan
    return found, solved, expanded, total


def test_friction_of_known_windows(friction_of_known_windows):
    """The definitions: tau so that the mean is 0.3 at the median; moments over all windows, pairs of one strip."""
    found, solved, expanded, total = friction_of_known_windows
    shear = float(found["shear_strength"])
    assert found["combined_mean"][1] == pytest.approx(0.3, rel=1e-12)
    # the control explains all but the solved windows' own noise, so that all 40 strips determine the mean
    everywhere = expanded.mean(axis=(0, 2)) - np.array([1.5, 1.0, 0.5]) * 1e-9
    own = 2e-11 / math.sqrt(STRIPS * WINDOWS)
    np.testing.assert_allclose(found["combined_mean"] / shear, everywhere, rtol=0, atol=3 * own)
    np.testing.assert_allclose(
        found["mean"], shear * np.stack([np.nanmean(solved, axis=(0, 2)), expanded.mean(axis=(0, 2))])
    )
    np.testing.assert_allclose(
        found["std"], shear * np.stack([np.nanstd(solved, axis=(0, 2)), expanded.std(axis=(0, 2))]), rtol=1e-9
    )
    # 12 solved and 28 new strips: a perfect control would give 40 / 12
    assert np.all((found["combined_mean_gain"] > 2.5) & (found["combined_mean_gain"] < 40 / 12))
    ratios = [found[f"combined_{name}_variance_ratio_high"] for name in ("mean", "std")]
    np.testing.assert_allclose([found[f"combined_{name}_gain_low"] for name in ("mean", "std")], 1 / np.array(ratios))
    np.testing.assert_allclose(found["ratio_of_sums"][0], shear * total)
    assert found["largest_residual"] == pytest.approx(6e-11)
    np.testing.assert_allclose(found["missing_share"], [[0, 0, 1 / (STRIPS * WINDOWS)], [0, 0, 0]])


def test_lags_and_lengths_of_known_windows(friction_of_known_windows):
    """Noise averaged over ten windows: its autocorrelation falls along 1 - k / 10, to 1/e near six of them."""
    found, *_ = friction_of_known_windows
    np.testing.assert_allclose(found["lag"], 1e-5 * np.arange(WINDOWS), atol=1e-18)
    np.testing.assert_allclose(found["triangle"], np.maximum(1 - found["lag"] / 1e-4, 0.0), atol=1e-12)
    curve = found["autocorrelation"]
    assert curve.shape == (2, 3, WINDOWS)
    np.testing.assert_allclose(curve[1, :, :10], np.tile(1 - np.arange(10) / 10, (3, 1)), atol=0.15)
    np.testing.assert_allclose(found["length_one_over_e"][1], 6.3e-5, rtol=0.2)


def test_what_is_drawn_and_tabled_is_at_its_penetration(friction_of_known_windows, folder):
    found, solved, *_ = friction_of_known_windows
    edges, density = found["histogram_edge"], found["histogram"]
    mu = float(found["shear_strength"]) * solved[:, 1]
    assert (edges[0], edges[-1]) == (pytest.approx(mu.min()), pytest.approx(mu.max()))
    counts = [np.count_nonzero((low <= mu) & (mu < high)) for low, high in pairwise(edges)]
    np.testing.assert_allclose(density[:-1], np.array(counts[:-1]) / mu.size / np.diff(edges)[:-1])
    rows = list(csv.DictReader(io.StringIO((folder / "summary.csv").read_text())))
    assert [float(row["percentile"]) for row in rows] == [10.0, 50.0, 90.0]
    for level, row in enumerate(rows):
        assert float(row["combined_mean"]) == pytest.approx(found["combined_mean"][level], rel=1e-5)
        assert float(row["skewness"]) == pytest.approx(found["skewness"][0, level], rel=1e-5)
        assert float(row["combined_std"]) == pytest.approx(found["combined_std"][level], rel=1e-5)
        length = found["length_least_squares_low"][0, level]
        assert float(row["length_least_squares_low_m"]) == pytest.approx(length, rel=1e-5)
        assert int(row["beta_at_bound"]) == found["beta_at_bound"][0, level]


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
    draw = expansion_strip._sampler(scene_of(COARSE), model, grid, lattice)
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
    found = []
    for lift in (0.0, (planes[0] - planes[1]) / 2):
        monkeypatch.setattr(expansion_strip, "displacement", lambda _, force, lift=lift: np.full(force.shape, lift))
        found.append(run(expansion_strip, CONFIGURATION, expansion=expansion, first=0, last=2))
    plain, lifted = found
    for name in ("area", "force"):
        np.testing.assert_allclose(lifted[name][:, 0], plain[name][:, 0], rtol=1e-9)
        np.testing.assert_allclose(lifted[name][:, 1], plain[name].mean(axis=1), rtol=1e-9)
