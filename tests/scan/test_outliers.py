"""Outliers of a scan: found where they were put, and none on surfaces without."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from roughslip.grid import Grid
from roughslip.scan import fitted_marginal, read_scan, remove_form, scan_statistics
from roughslip.scan.outliers import outliers, warnings, without
from roughslip.scan.topography import topography
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
measured = pytest.mark.skipif(
    not DATA.is_dir() or importlib.util.find_spec("SurfaceTopography") is None,
    reason="needs the measured scans in ../shared/data and the extra `scans`",
)

N = 128
GROUND = read_scan(Path(__file__).resolve().parents[2] / "config/scans/ground.nc")
GRID = Grid(N, N, 1e-6, 1e-6)
X, Y = np.meshgrid(np.arange(float(N)), np.arange(float(N)), indexing="ij")


def field(kind, rng, shortest=2.0):
    """Sq 0.2 µm, of any correlation length up to a twelfth of the scan."""
    shapes = {"self_affine": {"hurst": rng.uniform(0.3, 0.95), "bandwidth": rng.uniform(5.0, 60.0)}}.get(kind, {})
    length = 1e-6 * shortest * (N / 12.0 / shortest) ** rng.uniform()
    return embed(covariance_of(kind, 2e-7, length, **shapes), GRID).sample(rng)


def plateau(rng):
    z = field("exponential", rng)
    return np.where(z < 0.0, z, rng.uniform(0.05, 0.4) * z)


def grooves(rng, depths, width):
    """Straight ones across the scan."""
    z = np.zeros(GRID.shape)
    for depth in depths:
        angle, place = rng.uniform(0.0, np.pi), rng.uniform(0.2, 0.8) * N
        z -= depth * np.exp(-((((X - place) * np.cos(angle) + (Y - N / 2) * np.sin(angle)) / width) ** 2))
    return z


def ground(rng):
    """A part of the shipped scan."""
    i, j = rng.integers(0, GROUND.heights.shape[0] - N, 2)
    return GROUND.heights[i : i + N, j : j + N]


def dimples(rng):
    """A laser texture: round dimples, 3 µm deep, on a sixth of the area."""
    period = rng.uniform(14.0, 24.0)
    away = ((X % period - period / 2) ** 2 + (Y % period - period / 2) ** 2) / (0.22 * period) ** 2
    return -3e-6 * np.exp(-(away**2))


def milled(rng):
    """Arcs of a cutter about a centre far away."""
    return 3e-7 * np.abs(np.sin(np.pi * np.hypot(X - N / 2, Y + 3 * N) / rng.uniform(5.0, 20.0)))


SURFACES = {
    "gaussian": lambda rng: field("gaussian", rng),
    "exponential": lambda rng: field("exponential", rng),
    "fractal": lambda rng: field("self_affine", rng, 4.0),
    "plateau": plateau,
    "grooved": lambda rng: field("gaussian", rng) + grooves(rng, [2e-6] * 6, 2.0),
    "honed": lambda rng: 0.3 * field("exponential", rng) + grooves(rng, rng.exponential(5e-7, 20), 1.0),
    "turned": lambda rng: 0.3 * field("exponential", rng) + 5e-6 * (Y / rng.uniform(6.0, 30.0) % 1.0 - 0.5) ** 2,
    "milled": lambda rng: 0.4 * field("gaussian", rng) + milled(rng),
    "ground": ground,
    "dimples": lambda rng: 0.3 * field("exponential", rng) + dimples(rng),
}


@pytest.mark.parametrize("kind", SURFACES)
def test_no_false_alarm(kind):
    """At most 5 % of surfaces without outliers are flagged; grooves and regular dimples are part of a surface."""
    scans = (SURFACES[kind](np.random.default_rng([7, seed])) for seed in range(20))
    assert sum(outliers(remove_form(topography(z, 1e-6, 1e-6, kind), "plane")).any() for z in scans) <= 1


@pytest.mark.parametrize("radius", [0.0, 1.0, 3.0, 7.0])
@pytest.mark.parametrize("kind", ["gaussian", "fractal", "honed"])
def test_spots_of_dirt_are_found_whole(kind, radius):
    """From one point to 149 of them, 0.9 % of the scan, 4 µm high or deep: just these, but for a point or two."""
    z = SURFACES[kind](np.random.default_rng(8))
    spots = [np.hypot(X - i, Y - j) <= radius for i, j in ((30, 40), (90, 35), (50, 100))]
    dirty = topography(z + 4e-6 * (1.0 * spots[0] - spots[1] + spots[2]), 1e-6, 1e-6, kind)
    assert np.count_nonzero(outliers(remove_form(dirty, "plane")) ^ np.any(spots, axis=0)) <= 2


@pytest.mark.slow
@measured
@pytest.mark.parametrize(("file", "form"), [("al3d-1.al3d", "quadratic"), ("matrix-2.txt", "plane")])
def test_measured_surfaces_have_none(file, form):
    assert not outliers(remove_form(read_scan(DATA / file), form)).any()


@pytest.mark.parametrize("share", [0.0, 1e-4, 9e-4, 5e-3])
@pytest.mark.parametrize("height", [6e-6, -3e-5])
def test_the_empirical_model_keeps_the_bulk(share, height):
    """Of outliers that are kept: the middle half of the heights is as wide as that of the scan, within 4 %.

    Tails that begin with them do not make more of them than there are.
    """
    z = SURFACES["gaussian"](np.random.default_rng(4))
    z.flat[np.random.default_rng(1).choice(z.size, round(share * z.size), replace=False)] += height
    scan = remove_form(topography(z, 1e-6, 1e-6, "spikes"), "plane")
    found = fitted_marginal("empirical", scan, float(np.std(scan.heights)))
    ends = found.quantile(np.array([0.25, 0.75]))
    assert found.standard_deviation < 1.05 * np.std(scan.heights)
    assert np.diff(ends) == pytest.approx(np.subtract(*np.percentile(scan.heights, [75, 25])), rel=0.04)


def test_spikes_are_found_and_left_out():
    """Spikes of 30 Sq at known places: just these are found, and without them Sq is that of the clean surface."""
    clean = SURFACES["gaussian"](np.random.default_rng(4))
    put = np.zeros(clean.shape, dtype=bool)
    put.flat[np.random.default_rng(1).choice(clean.size, 16, replace=False)] = True
    scan = remove_form(topography(clean + 6e-6 * put, 1e-6, 1e-6, "spikes"), "plane")
    found = outliers(scan)
    assert np.array_equal(found, put)
    (line,) = warnings(scan, found, "keep")
    assert line.startswith("16 points")
    i, j = divmod(int(np.argmax(np.where(put, np.abs(scan.heights - np.median(scan.heights)), 0.0))), N)
    assert f"x {i} µm, y {j} µm" in line
    assert "roughness.scan.outliers" in line
    lifted = replace(scan, heights=scan.heights - 9e-6)  # by more than half of a spike: the datum does not matter
    assert list(warnings(lifted, found, "keep")) == [line]
    rms = float(scan_statistics(without(scan, found, "plane")).rms_height.value)
    expected = float(scan_statistics(remove_form(topography(clean, 1e-6, 1e-6, "clean"), "plane")).rms_height.value)
    assert rms == pytest.approx(expected, rel=0.005)
    kurtosis, skewness = scan_statistics(scan).kurtosis, scan_statistics(scan).skewness
    assert kurtosis.low >= 1.0 + skewness.value**2
