"""Topographies: what is left after removal of form, holes, and the high-pass against closed forms.

Outliers of a scan: found where they were put, and none on surfaces without."""

import math
from pathlib import Path

import numpy as np
import pytest

from roughslip.errors import InputError, ParameterError
from roughslip.grid import Grid
from roughslip.scan import read_scan, scan_statistics
from roughslip.scan.topography import (
    FEWEST_NODES,
    Topography,
    high_pass,
    outliers_of,
    remove_form,
    topography,
    without_outliers,
)
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of

NX, NY, DX, DY = 48, 36, 0.5e-6, 0.8e-6


def rough():
    return np.random.default_rng([31, 0]).standard_normal((NX, NY)) * 1e-7


def with_holes(heights, share=0.05):
    holes = np.random.default_rng([32, 0]).random(heights.shape) < share
    return np.where(holes, np.nan, heights)


@pytest.mark.parametrize(("form", "number"), [("mean", 1), ("plane", 3), ("quadratic", 6)])
def test_what_is_left_is_orthogonal_to_the_form_over_the_measured_points(form, number):
    """Removal does not see the form, removes nothing twice, and a form alone is refused."""
    x, y = np.linspace(0, 1, NX)[:, None] + np.zeros(NY), np.linspace(0, 1, NY)[None, :] + np.zeros((NX, 1))
    terms = [np.ones((NX, NY)), x, y, x * x, x * y, y * y][:number]
    shape = sum(weight * term for weight, term in zip((2e-5, 9e-6, -4e-6, 2e-6, 1e-6, -3e-6), terms, strict=False))
    left, bare = (
        remove_form(topography(with_holes(z), DX, DY, "scan"), form).heights for z in (rough() + shape, rough())
    )
    measured = np.isfinite(with_holes(rough()))
    for term in terms:
        # normal equations solved to rounding: 1e3 points of at most the heights before removal
        assert abs(np.sum((left * term)[measured])) < 1e-11 * np.sum(np.abs(shape))
    np.testing.assert_allclose(left, bare, atol=1e-11 * np.abs(shape).max())
    again = remove_form(Topography(left, DX, DY, ~measured), form).heights
    np.testing.assert_allclose(again, left, atol=1e-18)
    if number > 1:
        with pytest.raises(ParameterError, match="nothing is left"):
            remove_form(topography(shape, DX, DY, "scan"), form)


def test_holes_are_filled_by_a_discrete_harmonic_function():
    """x^2 - y^2 has no five-point Laplacian on any rectangular cells: a hole inside the mesh is filled exactly."""
    x, y = np.arange(NX)[:, None] * DX, np.arange(NY)[None, :] * DY
    z = x**2 - y**2 + 1e-6 * x
    holed = z.copy()
    holed[10:16, 8:15] = np.nan
    holed[30, 20] = np.inf
    scan = topography(holed, DX, DY, "scan")
    assert scan.missing.sum() == 43
    np.testing.assert_array_equal(scan.heights[scan.measured], z[scan.measured])
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


def test_a_scan_says_what_was_read_cut_and_missing():
    """A bar in a large field: 61 of 512 columns have heights, and of what they hold one point misses.

    A ragged line of the rim, mostly missing, goes too.
    """
    field, bar = np.full((66, 512), np.nan), np.random.default_rng(0).standard_normal((64, 61)) * 1e-7
    field[1:65, 225:286], field[9, 230], field[0, 225:240] = bar, np.nan, 1e-7
    scan = topography(field, DX, DY, "bar", "array 'z' in nm")
    np.testing.assert_array_equal(scan.heights[scan.measured], bar[scan.measured])
    assert scan.cut == pytest.approx(1 - 61 * 64 / 512 / 66)
    assert scan.read.startswith("array 'z' in nm; 64 x 61 of 66 x 512 points used, 88.4% cut off as empty rim, 0.5 x")
    assert topography(rough(), DX, DY, "scan").cut == 0.0


@pytest.mark.parametrize(
    ("heights", "words"),
    [
        (rough()[:1], f"1 x {NY} points with heights; a scan needs at least {FEWEST_NODES}"),
        (np.full((NX, NY), 3e-6), "all heights are equal"),
        (with_holes(rough(), 0.2), "at most 10% may be missing"),
    ],
)
def test_a_bad_scan_ends_in_one_line_that_names_it(heights, words):
    with pytest.raises(InputError) as caught:
        topography(heights, DX, DY, "lapping.x3p")
    (line,) = caught.value.lines
    assert line.startswith("lapping.x3p: ")
    assert words in line


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
    with pytest.raises(ParameterError, match=r"cutoff_m.*no shorter waves"):
        high_pass(topography(plane, *CELL, "a plane"), CUTOFF)
    with pytest.raises(ParameterError, match=r"allowed are 7\.5 m, five cells of the scan, to 225 m, its shorter edge"):
        high_pass(topography(wave, *CELL, "a wave"), 7.0)  # five of the cells along x, whose edge is 240 m


POINTS = 128
GROUND = read_scan(Path(__file__).resolve().parents[2] / "config/scans/ground.nc")
GRID = Grid(POINTS, POINTS, 1e-6, 1e-6)
COLUMN, ROW = np.meshgrid(np.arange(float(POINTS)), np.arange(float(POINTS)), indexing="ij")


def field(kind, rng):
    """Sq 0.2 µm, of any correlation length up to a twelfth of the scan."""
    length = 2e-6 * (POINTS / 24.0) ** rng.uniform()
    return embed(covariance_of(kind, 2e-7, length), GRID).sample(rng)


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
    "honed": lambda rng: 0.3 * field("exponential", rng) + grooves(rng, rng.exponential(5e-7, 20), 1.0),
    "turned": lambda rng: 0.3 * field("exponential", rng) + 5e-6 * (ROW / rng.uniform(6.0, 30.0) % 1.0 - 0.5) ** 2,
    "ground": ground,
    "dimples": lambda rng: 0.3 * field("exponential", rng) + dimples(rng),
}


@pytest.mark.parametrize("kind", SURFACES)
def test_no_false_alarm(kind):
    """At most 5 % of surfaces without outliers are flagged; grooves and regular dimples are part of a surface."""
    scans = (SURFACES[kind](np.random.default_rng([7, seed])) for seed in range(20))
    assert sum(outliers_of(remove_form(topography(z, 1e-6, 1e-6, kind), "plane")).any() for z in scans) <= 1


@pytest.mark.parametrize("radius", [0.0, 1.0, 3.0, 7.0])
@pytest.mark.parametrize("kind", ["gaussian", "honed"])
def test_spots_of_dirt_are_found_whole(kind, radius):
    """From one point to 149 of them, 0.9 % of the scan, 4 µm high or deep: just these, but for a point or two."""
    z = SURFACES[kind](np.random.default_rng(8))
    spots = [np.hypot(COLUMN - i, ROW - j) <= radius for i, j in ((30, 40), (90, 35), (50, 100))]
    dirty = topography(z + 4e-6 * (1.0 * spots[0] - spots[1] + spots[2]), 1e-6, 1e-6, kind)
    assert np.count_nonzero(outliers_of(remove_form(dirty, "plane")) ^ np.any(spots, axis=0)) <= 2


def test_spikes_are_found_and_left_out():
    """Spikes of 30 Sq at known places: just these are found, and without them Sq is that of the clean surface."""
    clean = SURFACES["gaussian"](np.random.default_rng(4))
    put = np.zeros(clean.shape, dtype=bool)
    put.flat[np.random.default_rng(1).choice(clean.size, 16, replace=False)] = True
    scan = remove_form(topography(clean + 6e-6 * put, 1e-6, 1e-6, "spikes"), "plane")
    marked = outliers_of(scan)
    assert np.array_equal(marked, put)
    rms = float(scan_statistics(without_outliers(scan, marked, "plane")).rms_height.value)
    expected = float(scan_statistics(remove_form(topography(clean, 1e-6, 1e-6, "clean"), "plane")).rms_height.value)
    assert rms == pytest.approx(expected, rel=0.005)
    kurtosis, skewness = scan_statistics(scan).kurtosis, scan_statistics(scan).skewness
    assert kurtosis.low >= 1.0 + skewness.value**2
