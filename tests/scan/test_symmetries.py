"""A scan transposed, mirrored or in metres is the same surface: all that is read from it goes with it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from roughslip.grid import Grid
from roughslip.probability import Estimate
from roughslip.scan.covariance_fit import fitted_covariances
from roughslip.scan.jackknife import sub_areas, wrapped
from roughslip.scan.outliers import outliers
from roughslip.scan.statistics import scan_statistics
from roughslip.scan.topography import Topography, high_pass, remove_form, topography
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of

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


def like(found, expected, factor=1.0):
    for end in ("value", "low", "high"):
        wanted = factor * getattr(expected, end)
        np.testing.assert_allclose(getattr(found, end), wanted, rtol=1e-8, atol=1e-9 * abs(np.max(wanted)))


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
    for found, expected in ((b.length_x, lengths[0]), (b.length_y, lengths[1])):
        like(found, expected, metre)
    for which in ("length_along", "length_across"):
        like(getattr(b, which), getattr(a, which), metre)
    like(b.strength, a.strength)
    assert wrapped(b.lay.value - lay(a.lay.value)) == pytest.approx(0.0, abs=1e-9)
    assert b.lay.high - b.lay.low == pytest.approx(a.lay.high - a.lay.low, rel=1e-9)
    assert a.lay.low < 0.5 < a.lay.high
    assert (other.fractal is None) == (one.fractal is None)


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
    for surface in (scan, change(scan)):
        reach = 1.0 if surface is scan else metre
        parts = replace(sub_areas(surface.grid, 3.0 * reach, 3.0 * reach), counts=(5, 5))
        fits.append(
            {fit.covariance.kind: fit for fit in fitted_covariances(kinds, surface, scan_statistics(surface, parts))[0]}
        )
    for kind in kinds:
        one, other = fits[0][kind], fits[1][kind]
        for key, value in one.parameters.items():
            scale = metre if key.endswith("_m") else 1.0
            found = other.parameters[key]
            if key == "lay_rad":
                assert wrapped(found - lay(value)) == pytest.approx(0.0, abs=1e-4)
            else:
                assert found == pytest.approx(scale * value, rel=1e-4)
            assert other.standard_errors[key] == pytest.approx(scale * one.standard_errors[key], rel=1e-2)
        assert (other.misfit, other.criterion) == pytest.approx((one.misfit, one.criterion), rel=1e-6)
        assert other.spectrum_misfit == pytest.approx(one.spectrum_misfit, rel=1e-6)


def test_a_self_affine_fit_goes_on_to_waves_of_two_points(scan):
    """The geometric mean over both axes, as the cells are not square."""
    parts = replace(sub_areas(scan.grid, 3.0, 3.0), counts=(3, 3))
    (fit,), _ = fitted_covariances(["self_affine"], scan, scan_statistics(scan, parts))
    assert math.prod(fit.covariance.cutoff_wavelengths_m) == pytest.approx(4.0 * DX * DY, rel=1e-9)
