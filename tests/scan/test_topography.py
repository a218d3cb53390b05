"""Topographies: what is left after removal of form, holes, and the high-pass against closed forms.

Outliers of a scan: found where they were put, and none on surfaces without."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roughslip.errors import InputError, ParameterError
from roughslip.grid import Grid
from roughslip.scan import read_scan, scan_statistics
from roughslip.scan.outliers import outliers, warnings, without
from roughslip.scan.topography import FEWEST_NODES, Topography, high_pass, remove_form, topography
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of

NX, NY, DX, DY = 48, 36, 0.5e-6, 0.8e-6


def rough(seed=0):
    return np.random.default_rng([31, seed]).standard_normal((NX, NY)) * 1e-7


def with_holes(heights, seed=0, share=0.05):
    holes = np.random.default_rng([32, seed]).random(heights.shape) < share
    return np.where(holes, np.nan, heights)


def quadratic():
    x, y = np.arange(NX)[:, None] * DX, np.arange(NY)[None, :] * DY
    return 3e-6 + 0.02 * x - 0.03 * y + 800.0 * x**2 - 500.0 * x * y + 300.0 * y**2


def terms(form):
    x, y = np.linspace(0, 1, NX)[:, None] + np.zeros(NY), np.linspace(0, 1, NY)[None, :] + np.zeros((NX, 1))
    return [np.ones((NX, NY)), x, y, x * x, x * y, y * y][: {"mean": 1, "plane": 3, "quadratic": 6}[form]]


@pytest.mark.parametrize("form", ["mean", "plane", "quadratic"])
def test_what_is_left_is_orthogonal_to_the_form_over_the_measured_points(form):
    scan = topography(with_holes(rough() + quadratic()), DX, DY, "scan")
    left = remove_form(scan, form)
    for term in terms(form):
        # normal equations solved to rounding: 1e3 points of at most the heights before removal
        assert abs(np.sum((left.heights * term)[scan.measured])) < 1e-11 * np.sum(np.abs(scan.heights))


@pytest.mark.parametrize("form", ["mean", "plane", "quadratic"])
def test_removal_does_not_see_the_form_and_removes_nothing_twice(form):
    shape = sum(
        weight * term for weight, term in zip((2e-5, 9e-6, -4e-6, 2e-6, 1e-6, -3e-6), terms(form), strict=False)
    )
    bare = remove_form(topography(with_holes(rough()), DX, DY, "scan"), form)
    bent = remove_form(topography(with_holes(rough() + shape), DX, DY, "scan"), form)
    np.testing.assert_allclose(bent.heights, bare.heights, atol=1e-11 * np.abs(shape).max())
    np.testing.assert_allclose(remove_form(bent, form).heights, bent.heights, atol=1e-18)


def test_holes_are_filled_by_a_discrete_harmonic_function():
    """x^2 - y^2 has no five-point Laplacian on any rectangular cells: a hole inside the mesh is filled exactly."""
    x, y = np.arange(NX)[:, None] * DX, np.arange(NY)[None, :] * DY
    z = x**2 - y**2 + 1e-6 * x
    holed = z.copy()
    holed[10:16, 8:15] = np.nan
    holed[30, 20] = np.inf
    scan = topography(holed, DX, DY, "scan")
    assert scan.missing.sum() == 43
    np.testing.assert_allclose(scan.heights, z, atol=1e-12 * np.abs(z).max())


def test_a_hole_at_the_edge_has_no_slope_across_it():
    z = np.zeros((NX, 1)) + np.cos(np.arange(NY))[None, :]
    holed = z.copy()
    holed[:4, 10] = np.nan  # one wide, so that its neighbours across y rule it but for the pull of its end
    scan = topography(holed, DX, DY, "scan")
    a, b = DX**-2, DY**-2  # the column solved by hand: reflecting top, z beyond the fourth cell
    matrix = np.diag([a + 2 * b, 2 * a + 2 * b, 2 * a + 2 * b, 2 * a + 2 * b])
    matrix -= a * (np.eye(4, k=1) + np.eye(4, k=-1))
    right = np.full(4, b * (np.cos(9) + np.cos(11)))
    right[3] += a * np.cos(10)
    np.testing.assert_allclose(scan.heights[:4, 10], np.linalg.solve(matrix, right), rtol=1e-12)


@settings(max_examples=15, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**31), share=st.floats(0.001, 0.07))
def test_filling_keeps_measured_heights_and_invents_no_extremes(seed, share):
    z = rough(seed)
    scan = topography(with_holes(z, seed, share), DX, DY, "scan")
    np.testing.assert_array_equal(scan.heights[scan.measured], z[scan.measured])
    assert scan.heights.min() == z[scan.measured].min()
    assert scan.heights.max() == z[scan.measured].max()


def test_an_empty_rim_is_cut_off_and_the_inside_kept():
    z = rough()
    rimmed = np.full((NX + 5, NY + 3), np.nan)
    rimmed[2:-3, 3:] = z
    rimmed[1, 3:12] = 1e-7  # a ragged line, mostly missing, goes too
    scan = topography(rimmed, DX, DY, "scan")
    np.testing.assert_array_equal(scan.heights, z)
    assert not scan.missing.any()
    assert (scan.grid.dx, scan.grid.dy) == (DX, DY)


def test_a_scan_says_what_was_read_cut_and_missing():
    """A bar in a large field: 61 of 512 columns have heights, and of what they hold one point misses."""
    field = np.full((64, 512), np.nan)
    field[:, 225:286] = np.random.default_rng(0).standard_normal((64, 61)) * 1e-7
    field[9, 230] = np.nan
    scan = topography(field, DX, DY, "bar", "array 'z' in nm")
    assert scan.heights.shape == (64, 61)
    assert scan.cut == pytest.approx(1 - 61 / 512)
    assert scan.read == (
        "array 'z' in nm; 64 x 61 of 64 x 512 points used, 88.1% cut off as empty rim, 0.5 x 0.8 µm apart; "
        "1 missing (0.026 %), interpolated"
    )
    assert remove_form(scan, "plane").read == scan.read
    whole = topography(rough(), DX, DY, "scan")
    assert (whole.cut, whole.read) == (0.0, f"heights in m; {NX} x {NY} points, 0.5 x 0.8 µm apart; none missing")


@pytest.mark.parametrize(
    ("heights", "words"),
    [
        (np.full((NX, NY), np.nan), "no point has a height; at most 10%"),
        (rough()[:1], f"1 x {NY} points with heights; a scan needs at least {FEWEST_NODES}"),
        (rough()[:, :20], f"at least {FEWEST_NODES} on each axis"),
        (np.full((NX, NY), 3e-6), "all heights are equal"),
        (rough()[0], "1-dimensional heights; a map of heights has two"),
        (with_holes(rough(), share=0.2), "at most 10% may be missing"),
        (np.zeros((0, NY)), "no point has a height"),
    ],
)
def test_a_bad_scan_ends_in_one_line_that_names_it(heights, words):
    with pytest.raises(InputError) as caught:
        topography(heights, DX, DY, "lapping.x3p")
    assert len(caught.value.lines) == 1
    assert caught.value.lines[0].startswith("lapping.x3p: ")
    assert words in caught.value.lines[0]


def test_steps_forms_and_heights_that_make_no_topography_are_refused():
    with pytest.raises(InputError, match="positive and finite"):
        topography(rough(), 0.0, DY, "scan")
    scan = topography(quadratic(), DX, DY, "scan")
    with pytest.raises(ParameterError, match="mean, plane or quadratic"):
        remove_form(scan, "cubic")
    with pytest.raises(ParameterError, match="nothing is left"):
        remove_form(scan, "quadratic")
    with pytest.raises(ParameterError, match="finite"):
        Topography(with_holes(rough()), DX, DY, np.zeros((NX, NY), dtype=bool))


CELL, CUTOFF = (1.0, 1.5), 30.0
X, Y = np.meshgrid(np.arange(240) * CELL[0], np.arange(150) * CELL[1], indexing="ij")


@pytest.mark.parametrize("angle", [0.0, 0.6, math.pi / 2])
@pytest.mark.parametrize(("wavelength", "kept"), [(1.0, 0.5), (2.0, 1 - 2**-0.25), (0.5, 1 - 2**-4)])
def test_of_a_wave_it_keeps_what_the_standard_says(angle, wavelength, kept):
    """1 - 2^-(cutoff / wavelength)^2 in every direction, one half at the cutoff; away from the rim, to 1e-7."""
    q = 2 * math.pi / (CUTOFF * wavelength)
    wave = np.cos(q * (X * math.cos(angle) + Y * math.sin(angle)) + 0.3)
    filtered = high_pass(topography(wave, *CELL, "a wave"), CUTOFF).heights
    inside = slice(52, -52), slice(35, -35)
    np.testing.assert_allclose(filtered[inside], kept * wave[inside], atol=1e-7)


def test_a_plane_is_taken_off_to_the_rim_and_in_holes():
    plane, wave = 3.0 + 0.02 * X - 0.05 * Y, np.cos(X)
    plane[20:24, 30] = np.nan
    with_plane, alone = (
        high_pass(topography(z, *CELL, "a scan"), CUTOFF).heights for z in (plane + wave, plane * 0 + wave)
    )
    np.testing.assert_allclose(with_plane, alone, atol=1e-11)
    with pytest.raises(ParameterError, match=r"roughness\.scan\.cutoff_m.*no shorter waves"):
        high_pass(topography(plane, *CELL, "a plane"), CUTOFF)


def test_a_cutoff_that_no_wave_of_the_scan_has_is_refused():
    scan = topography(np.cos(X), *CELL, "a wave")
    for cutoff in (7.4, 226.0):
        with pytest.raises(ParameterError, match=r"roughness\.scan\.cutoff_m.*7\.5 m.*225 m"):
            high_pass(scan, cutoff)
    assert high_pass(scan, 225.0).heights.std() > 0.5


POINTS = 128
GROUND = read_scan(Path(__file__).resolve().parents[2] / "config/scans/ground.nc")
GRID = Grid(POINTS, POINTS, 1e-6, 1e-6)
COLUMN, ROW = np.meshgrid(np.arange(float(POINTS)), np.arange(float(POINTS)), indexing="ij")


def field(kind, rng):
    """Sq 0.2 µm, of any correlation length up to a twelfth of the scan."""
    length = 2e-6 * (POINTS / 24.0) ** rng.uniform()
    return embed(covariance_of(kind, 2e-7, length), GRID).sample(rng)


def plateau(rng):
    z = field("exponential", rng)
    return np.where(z < 0.0, z, rng.uniform(0.05, 0.4) * z)


def grooves(rng, depths, width):
    """Straight ones across the scan."""
    z = np.zeros(GRID.shape)
    for depth in depths:
        angle, place = rng.uniform(0.0, np.pi), rng.uniform(0.2, 0.8) * POINTS
        z -= depth * np.exp(-((((COLUMN - place) * np.cos(angle) + (ROW - POINTS / 2) * np.sin(angle)) / width) ** 2))
    return z


def ground(rng):
    """A part of the shipped scan."""
    i, j = rng.integers(0, GROUND.heights.shape[0] - POINTS, 2)
    return GROUND.heights[i : i + POINTS, j : j + POINTS]


def dimples(rng):
    """A laser texture: round dimples, 3 µm deep, on a sixth of the area."""
    period = rng.uniform(14.0, 24.0)
    away = ((COLUMN % period - period / 2) ** 2 + (ROW % period - period / 2) ** 2) / (0.22 * period) ** 2
    return -3e-6 * np.exp(-(away**2))


SURFACES = {
    "gaussian": lambda rng: field("gaussian", rng),
    "plateau": plateau,
    "honed": lambda rng: 0.3 * field("exponential", rng) + grooves(rng, rng.exponential(5e-7, 20), 1.0),
    "turned": lambda rng: 0.3 * field("exponential", rng) + 5e-6 * (ROW / rng.uniform(6.0, 30.0) % 1.0 - 0.5) ** 2,
    "ground": ground,
    "dimples": lambda rng: 0.3 * field("exponential", rng) + dimples(rng),
}


@pytest.mark.parametrize("kind", SURFACES)
def test_no_false_alarm(kind):
    """At most 5 % of surfaces without outliers are flagged; grooves and regular dimples are part of a surface."""
    scans = (SURFACES[kind](np.random.default_rng([7, seed])) for seed in range(20))
    assert sum(outliers(remove_form(topography(z, 1e-6, 1e-6, kind), "plane")).any() for z in scans) <= 1


@pytest.mark.parametrize("radius", [0.0, 1.0, 3.0, 7.0])
@pytest.mark.parametrize("kind", ["gaussian", "honed"])
def test_spots_of_dirt_are_found_whole(kind, radius):
    """From one point to 149 of them, 0.9 % of the scan, 4 µm high or deep: just these, but for a point or two."""
    z = SURFACES[kind](np.random.default_rng(8))
    spots = [np.hypot(COLUMN - i, ROW - j) <= radius for i, j in ((30, 40), (90, 35), (50, 100))]
    dirty = topography(z + 4e-6 * (1.0 * spots[0] - spots[1] + spots[2]), 1e-6, 1e-6, kind)
    assert np.count_nonzero(outliers(remove_form(dirty, "plane")) ^ np.any(spots, axis=0)) <= 2


def test_spikes_are_found_and_left_out():
    """Spikes of 30 Sq at known places: just these are found, and without them Sq is that of the clean surface."""
    clean = SURFACES["gaussian"](np.random.default_rng(4))
    put = np.zeros(clean.shape, dtype=bool)
    put.flat[np.random.default_rng(1).choice(clean.size, 16, replace=False)] = True
    scan = remove_form(topography(clean + 6e-6 * put, 1e-6, 1e-6, "spikes"), "plane")
    marked = outliers(scan)
    assert np.array_equal(marked, put)
    (line,) = warnings(scan, marked, "keep")
    assert line.startswith("16 points")
    i, j = divmod(int(np.argmax(np.where(put, np.abs(scan.heights - np.median(scan.heights)), 0.0))), POINTS)
    assert f"x {i} µm, y {j} µm" in line
    assert "roughness.scan.outliers" in line
    lifted = replace(scan, heights=scan.heights - 9e-6)  # by more than half of a spike: the datum does not matter
    assert list(warnings(lifted, marked, "keep")) == [line]
    rms = float(scan_statistics(without(scan, marked, "plane")).rms_height.value)
    expected = float(scan_statistics(remove_form(topography(clean, 1e-6, 1e-6, "clean"), "plane")).rms_height.value)
    assert rms == pytest.approx(expected, rel=0.005)
    kurtosis, skewness = scan_statistics(scan).kurtosis, scan_statistics(scan).skewness
    assert kurtosis.low >= 1.0 + skewness.value**2
