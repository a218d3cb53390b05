"""Whole scans: from scans to models, twins and back; and two measured surfaces.

A scan transposed, mirrored or in metres is the same surface: all that is read from it goes with it."""

import importlib.util
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

from roughslip.grid import Grid
from roughslip.probability import BetaDistribution, Estimate, empirical_distribution
from roughslip.scan.covariance_fit import fitted_covariances
from roughslip.scan.instrument_file import read_scan
from roughslip.scan.jackknife import sub_areas, wrapped
from roughslip.scan.outliers import outliers
from roughslip.scan.spectrum import HIGHEST
from roughslip.scan.statistics import scan_statistics
from roughslip.scan.topography import Topography, high_pass, remove_form, topography
from roughslip.surface.embedding import embed
from roughslip.surface.model import gaussian_model, measured_model
from roughslip.surface.models import covariance_of

TWINS = 19
NUMBERS = ("rms_height", "skewness", "kurtosis")
LENGTHS = ("length_x", "length_y", "length_along", "length_across", "lay")

# An interval reaches t standard errors, and its width, from a few dozen sub-areas, is itself known to some 15 %. A twin
# of a model that is exactly the scan would lie inside with a probability of 0.95 at the right width and 0.90 at one
# 15 % too narrow.
INSIDE = 0.90
FALSE_ALARM = 1e-3  # of a family of statistics
FAMILY = len(NUMBERS) + len(LENGTHS)
FEWEST = int(binom.ppf(FALSE_ALARM / FAMILY, TWINS, INSIDE))  # 11 of 19
# Of all together: lengths along x and along the lay are nearly one, so that five of the eight count as independent.
FEWEST_OF_ALL = FAMILY / 5 * int(binom.ppf(FALSE_ALARM, 5 * TWINS, INSIDE))  # 120 of 152

GROUND = Path(__file__).resolve().parents[2] / "config/scans/ground.nc"
DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
measured = pytest.mark.skipif(
    not DATA.is_dir() or importlib.util.find_spec("SurfaceTopography") is None,
    reason="needs the measured scans in ../shared/data and the extra `scans`",
)


def test_the_shipped_scan_has_a_lay_along_x_and_negative_skewness():
    """Grains leave grooves along x in a plateau; its Sq and lengths are those of scene `measured`."""
    statistics = scan_statistics(remove_form(read_scan(GROUND), "plane"))
    assert statistics.sub_areas.sufficient
    assert statistics.rms_height.value == pytest.approx(3.337e-7, rel=1e-3)
    assert statistics.skewness.high < 0.0
    assert abs(statistics.autocorrelation.lay.value) < math.radians(3)
    assert statistics.autocorrelation.length_x.value == pytest.approx(14e-6, rel=0.01)
    assert statistics.autocorrelation.length_x.low > 2.0 * statistics.autocorrelation.length_y.high


def ground():
    return read_scan(GROUND).heights[:320, :320], 1e-6


def drawn(covariance, marginal=None):
    model = gaussian_model(covariance, covariance.axis_lengths_m, marginal)
    field = model.sampler(Grid(256, 256, 1e-6, 1e-6))(np.random.default_rng([21, 1]))
    return model.heights(field), 1e-6


SCANS = {
    "ground": (ground, "measured", "empirical"),
    "smooth": (lambda: drawn(covariance_of("matern", 1e-7, 11e-6, 8e-6, 0.3, smoothness=3.0)), "best", "gaussian"),
    "sharp": (
        lambda: drawn(covariance_of("exponential", 1e-7, 7e-6, 5e-6), BetaDistribution.of_moments(5.0, 1.4, 0.0, 1e-7)),
        "best",
        "empirical",
    ),
}


def model_of(scan, statistics, covariance, marginal):
    """As stage scan makes it."""
    rms, own = float(statistics.rms_height.value), statistics.autocorrelation
    law = None if marginal == "gaussian" else empirical_distribution(scan.heights[scan.measured], rms)
    if covariance == "measured":
        lengths = float(own.length_x.value), float(own.length_y.value)
        return measured_model(
            own.correlation.value, (scan.dx, scan.dy), rms, lengths, law, correct_correlation=law is not None
        )
    (best, *_), _ = fitted_covariances(("gaussian", "exponential", "matern"), scan, statistics)
    return gaussian_model(best.covariance, best.covariance.axis_lengths_m, law)


@pytest.fixture(scope="module", params=SCANS)
def described(request):
    """Statistics of a scan and of its twins."""
    make, covariance, marginal = SCANS[request.param]
    heights, spacing = make()
    scan = remove_form(topography(heights, spacing, spacing, request.param), "plane")
    statistics = scan_statistics(scan)
    assert statistics.sub_areas.sufficient
    model = model_of(scan, statistics, covariance, marginal)
    sample, twins = model.sampler(scan.grid), []
    for number in range(TWINS):
        z = model.heights(sample(np.random.default_rng([22, number])))
        twins.append(scan_statistics(topography(z, spacing, spacing, "a twin"), statistics.sub_areas))
    return statistics, twins


def count(interval, values):
    return int(np.sum((interval.low < values) & (values < interval.high)))


@pytest.mark.slow
def test_twins_lie_within_the_intervals_of_the_scan(described):
    of_scan, twins = described
    inside = {name: count(getattr(of_scan, name), [float(getattr(t, name).value) for t in twins]) for name in NUMBERS}
    for name in LENGTHS:
        values = np.array([float(getattr(twin.autocorrelation, name).value) for twin in twins])
        own = getattr(of_scan.autocorrelation, name)
        if name == "lay":  # an angle between undirected lines
            values = own.value + (values - own.value + math.pi / 2) % math.pi - math.pi / 2
        inside[name] = count(own, values)
    assert len(inside) == FAMILY
    assert min(inside.values()) >= FEWEST, inside
    assert sum(inside.values()) >= FEWEST_OF_ALL, inside
    # the mean of the twins scatters by a quarter of one; a fitted model follows the spectrum to a quarter of the
    # highest wavenumber, and one point in ten may lie outside
    table, power = of_scan.autocorrelation.correlation, of_scan.spectrum.power
    below = of_scan.spectrum.wavenumber < HIGHEST * math.pi / 1e-6
    for own, curves, kept in (
        (table, [twin.autocorrelation.correlation.value for twin in twins], table.value > math.exp(-1)),
        (power, [twin.spectrum.power.value for twin in twins], below),
    ):
        mean = np.mean(curves, axis=0)
        assert kept.sum() >= 3
        assert np.mean(((own.low <= mean) & (mean <= own.high))[kept]) >= 0.9


@measured
def test_a_nearly_gaussian_scan_of_focus_variation():
    scan = read_scan(DATA / "al3d-1.al3d")
    statistics = scan_statistics(remove_form(scan, "quadratic"))
    assert statistics.sub_areas.sufficient
    # what another program found, to its digits; its 1/e lengths of 7.0 um lie within our intervals
    assert statistics.rms_height.value == pytest.approx(0.26e-6, abs=0.005e-6)
    assert statistics.skewness.value == pytest.approx(-0.04, abs=0.005)
    assert statistics.kurtosis.value - 3.0 == pytest.approx(0.14, abs=0.005)
    for length in (statistics.autocorrelation.length_x, statistics.autocorrelation.length_y):
        assert length.low < 7.0e-6 < length.high
    assert statistics.skewness.low < 0.0 < statistics.skewness.high
    assert statistics.kurtosis.low < 3.0 < statistics.kurtosis.high


NX, NY, DX, DY = 90, 120, 1.0, 0.7
MICROMETRE = 2.0**-20  # near 1e-6, and exact: waves that fall on the edge of a ring still do


@pytest.fixture(scope="module")
def scan():
    """Skewed heights with a lay, a bow, holes of which some lie at the rim, and two outliers."""
    field = embed(covariance_of("exponential", 1.0, 3.0, 1.5, lay_rad=0.5), Grid(NX, NY, DX, DY))
    z = np.expm1(0.2 * field.sample(np.random.default_rng(5))) + 1e-4 * np.linspace(-30, 60, NX)[:, None] ** 2
    z[20, 30], z[61, 97] = 4.0, -3.0
    z[0, 10:14] = z[40:43, 70:72] = z[85:, 119] = np.nan
    return remove_form(topography(z, DX, DY, "surface"), "mean")


def transposed(scan):
    return Topography(scan.heights.T.copy(), scan.dy, scan.dx, scan.missing.T.copy())


def mirrored(scan):
    return replace(scan, heights=scan.heights[::-1].copy(), missing=scan.missing[::-1].copy())


def in_metres(scan):
    return Topography(MICROMETRE * scan.heights, MICROMETRE * scan.dx, MICROMETRE * scan.dy, scan.missing)


def swap(field):
    return np.swapaxes(field, -1, -2)


def flip(field):
    return np.flip(field, -2)


# how a scan changes, its fields (..., nx, ny), its lay, whether x and y change places, and a metre in its unit
CASES = {
    "transposed": (transposed, swap, lambda lay: math.pi / 2 - lay, True, 1.0),
    "mirrored": (mirrored, flip, lambda lay: -lay, False, 1.0),
    "in metres": (in_metres, np.asarray, lambda lay: lay, False, MICROMETRE),
}


def like(interval, expected, factor=1.0):
    for end in ("value", "low", "high"):
        wanted = factor * getattr(expected, end)
        np.testing.assert_allclose(getattr(interval, end), wanted, rtol=1e-8, atol=1e-9 * abs(np.max(wanted)))


@pytest.mark.parametrize("name", CASES)
def test_statistics_go_with_the_scan(scan, name):
    change, field, lay, swaps, metre = CASES[name]
    parts = replace(sub_areas(scan.grid, 3.0, 2.0), counts=(5, 6))
    grid = change(scan).grid
    turn = (lambda pair: pair[::-1]) if swaps else tuple
    theirs = replace(parts, grid=grid, counts=turn(parts.counts), extent=turn((3.0 * metre, 2.0 * metre)))
    one, other = scan_statistics(scan, parts), scan_statistics(change(scan), theirs)
    like(other.rms_height, one.rms_height, metre)
    for same in ("skewness", "kurtosis"):
        like(getattr(other, same), getattr(one, same))
    np.testing.assert_allclose(other.density.edges, metre * one.density.edges, rtol=1e-9)
    like(other.density.density, one.density.density, 1.0 / metre)
    np.testing.assert_allclose(other.spectrum.wavenumber, one.spectrum.wavenumber / metre, rtol=1e-12)
    like(other.spectrum.power, one.spectrum.power, metre**4)
    a, b = one.autocorrelation, other.autocorrelation
    like(b.correlation, Estimate(*(field(end) for end in (a.correlation.value, a.correlation.low, a.correlation.high))))
    lengths = turn((a.length_x, a.length_y))
    for length, expected in ((b.length_x, lengths[0]), (b.length_y, lengths[1])):
        like(length, expected, metre)
    for which in ("length_along", "length_across"):
        like(getattr(b, which), getattr(a, which), metre)
    assert wrapped(b.lay.value - lay(a.lay.value)) == pytest.approx(0.0, abs=1e-9)
    assert b.lay.high - b.lay.low == pytest.approx(a.lay.high - a.lay.low, rel=1e-9)
    assert a.lay.low < 0.5 < a.lay.high


@pytest.mark.parametrize("name", CASES)
def test_forms_filters_and_outliers_go_with_the_scan(scan, name):
    change, field, _, _, metre = CASES[name]
    other = change(scan)
    np.testing.assert_array_equal(outliers(other), field(outliers(scan)))
    assert outliers(scan)[[20, 61], [30, 97]].all()
    for of in (lambda s, m: remove_form(s, "plane"), lambda s, m: remove_form(s, "quadratic"), high_pass):
        expected = metre * field(of(scan, 30.0).heights)
        np.testing.assert_allclose(of(other, 30.0 * metre).heights, expected, rtol=0, atol=1e-10 * metre)
    holes = field(scan.missing)
    np.testing.assert_allclose(
        topography(np.where(holes, np.nan, other.heights), other.dx, other.dy, "again").heights[holes],
        metre * field(scan.heights)[holes],
        rtol=1e-9,
    )


@pytest.mark.parametrize("name", CASES)
def test_fits_go_with_the_scan(scan, name):
    """Lengths to the accuracy of the search; of rings, which do not depend on the unit, the same misfit."""
    change, _, lay, _, metre = CASES[name]
    kinds = ("gaussian", "exponential", "matern")
    fits = []
    for surface, reach in ((scan, 3.0), (change(scan), 3.0 * metre)):
        parts = replace(sub_areas(surface.grid, reach, reach), counts=(5, 5))
        found, _ = fitted_covariances(kinds, surface, scan_statistics(surface, parts))
        fits.append({fit.covariance.kind: fit for fit in found})
    for kind in kinds:
        one, other = fits[0][kind], fits[1][kind]
        np.testing.assert_allclose(other.covariance.lengths_m, metre * np.array(one.covariance.lengths_m), rtol=1e-4)
        assert wrapped(other.covariance.lay_rad - lay(one.covariance.lay_rad)) == pytest.approx(0.0, abs=1e-4)
        assert (other.misfit, other.criterion) == pytest.approx((one.misfit, one.criterion), rel=1e-6)
        assert other.spectrum_misfit == pytest.approx(one.spectrum_misfit, rel=1e-6)


def test_a_self_affine_fit_goes_on_to_waves_of_two_points(scan):
    """The geometric mean over both axes, as the cells are not square."""
    parts = replace(sub_areas(scan.grid, 3.0, 3.0), counts=(3, 3))
    (fit,), _ = fitted_covariances(["self_affine"], scan, scan_statistics(scan, parts))
    assert math.prod(fit.covariance.cutoff_wavelengths_m) == pytest.approx(4.0 * DX * DY, rel=1e-9)
