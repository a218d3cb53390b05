"""Covariances fitted to lags, and to rings of the spectrum, against the truth that these were made from."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from roughslip.grid import Grid
from roughslip.scan.covariance_fit import (
    Lags,
    RingPowers,
    effective_number,
    fit_covariance,
    fitted_covariances,
    lags_to_fit,
    rings_to_fit,
)
from roughslip.scan.statistics import scan_statistics
from roughslip.scan.topography import topography
from roughslip.surface.embedding import embed
from roughslip.surface.models import KINDS, covariance_of, self_affine

SMOOTHNESS = 2.5
TRUTH = covariance_of("matern", 1.0, 14.0, 10.0, smoothness=SMOOTHNESS)
LAGS = np.arange(-12, 13) * 0.5
X, Y = np.meshgrid(LAGS, LAGS, indexing="ij")
ERROR = 0.01
CUTOFF = 1.0

TRUTHS = {
    "gaussian": covariance_of("gaussian", 2.0, 2.0, 1.0, lay_rad=0.4),
    "exponential": covariance_of("exponential", 2.0, 2.0, 0.7, lay_rad=-1.2),
    "matern": covariance_of("matern", 2.0, 2.0, 1.2, lay_rad=1.5, smoothness=1.4),
    "self_affine": self_affine(2.0, 0.8, 9.0, CUTOFF * math.sqrt(9.0 / 6.0), 6.0, 0.7),
}


def half_plane(x, y, table, error):
    """Lags of independent errors, of one half plane."""
    half = (x > 0) | ((x == 0) & (y > 0))
    return Lags(x[half], y[half], table[half], np.full(half.sum(), error), float(half.sum()))


def fitted(kind, table):
    return fit_covariance(kind, half_plane(X, Y, table, ERROR), 2.0, None, CUTOFF)


def with_noise(covariance, seed):
    """Independent errors of the size said, equal at opposite lags."""
    noise = np.random.default_rng(seed).standard_normal(X.shape)
    return covariance(X, Y) / 4.0 + ERROR * (noise + noise[::-1, ::-1]) / math.sqrt(2.0)


@pytest.mark.parametrize("kind", KINDS)
def test_without_errors_the_parameters_come_back(kind):
    truth = TRUTHS[kind]
    fit = fitted(kind, truth(X, Y) / 4.0)
    # the misfit is that of least squares stopped at 1e-12 of a sum that starts of order one
    assert fit.misfit < 1e-6
    np.testing.assert_allclose(fit.covariance.lengths_m, truth.lengths_m, rtol=1e-6)
    assert fit.covariance.lay_rad == pytest.approx(truth.lay_rad, abs=1e-6)
    assert [getattr(fit.covariance, name) for name in truth.shapes] == pytest.approx(
        [getattr(truth, name) for name in truth.shapes], rel=1e-5
    )
    assert fit.covariance.rms_height_m == 2.0


@pytest.mark.parametrize("kind", KINDS)
def test_the_true_model_is_chosen(kind):
    """And a Matern model that has become exponential or Gaussian does not win by its extra parameter."""
    table = with_noise(TRUTHS[kind], 3)
    fits = sorted((fitted(other, table) for other in KINDS), key=lambda fit: fit.criterion)
    assert fits[0].covariance.kind == kind
    assert fits[0].misfit == pytest.approx(1.0, abs=0.2)  # 312 lags, one of each two opposite: 1 +- 0.04, four of them
    free = {"gaussian": 3, "exponential": 3}.get(kind, 4)
    assert fits[0].criterion == pytest.approx(312 * fits[0].misfit ** 2 + free * math.log(312))


@pytest.fixture(scope="module")
def first():
    """A field of 18 by 26 lengths, resolved by ten points a length, with its statistics."""
    field = embed(TRUTH, Grid(256, 256, 1.0, 1.0)).sample(np.random.default_rng([11, 0]))
    scan = topography(field, 1.0, 1.0, "a scan")
    return scan, scan_statistics(scan)


def test_rings_determine_the_kind_and_the_smoothness(first):
    """Exponential and Gaussian kinds pass through the lags almost as well; rings show the difference from Matern."""
    scan, statistics = first
    (best, *others), _ = fitted_covariances(("gaussian", "exponential", "matern"), scan, statistics)
    assert best.covariance.kind == "matern"
    assert best.covariance.smoothness == pytest.approx(SMOOTHNESS, rel=0.4)
    lags, rings = lags_to_fit(statistics.autocorrelation), rings_to_fit(scan, statistics)
    alone = fit_covariance("matern", lags, float(statistics.rms_height.value), None, CUTOFF)
    assert best.covariance.lengths_m == pytest.approx(alone.covariance.lengths_m, rel=0.1)  # lags keep the lengths
    for fit in (best, *others):
        squares = lags.number * fit.misfit**2 + rings.number * fit.spectrum_misfit**2
        free = 4 if fit is best else 3
        assert fit.criterion == pytest.approx(squares + free * math.log(lags.number + rings.number))
    assert min(fit.spectrum_misfit for fit in others) > 2 * best.spectrum_misfit


@pytest.mark.parametrize("metre", [1.0, 1e-6])
def test_rings_of_a_model_are_its_own(metre):
    """Exact lags and exact rings give the truth back, with the misfit of the tolerance that the search stops at."""
    x, y = np.meshgrid(np.arange(-20.0, 21), np.arange(-20.0, 21), indexing="ij")
    q = np.linspace(0.3, 0.8, 5)
    powers = metre**2 * TRUTH.spectrum(q)
    rings = RingPowers(powers, np.full(5, 0.1), 2.0, lambda model: model.spectrum(q / metre))
    fit = fit_covariance("matern", half_plane(metre * x, metre * y, TRUTH(x, y), 0.01), 1.0, rings, CUTOFF)
    assert fit.covariance.smoothness == pytest.approx(SMOOTHNESS, rel=1e-4)
    assert fit.covariance.lengths_m == pytest.approx(metre * np.array(TRUTH.lengths_m), rel=1e-4)
    assert fit.spectrum_misfit < 1e-3


def test_standard_errors_are_the_jackknife_s(first):
    """Of lags as they are and of the logarithm of rings, widened for what neighbouring sub-areas share."""
    scan, statistics = first
    own = statistics.autocorrelation
    lags, rings = lags_to_fit(own), rings_to_fit(scan, statistics)
    i, j = (np.searchsorted(axis, lag - 0.5) for axis, lag in ((own.lag_x, lags.x), (own.lag_y, lags.y)))
    assert len(lags.x) <= 2000 < own.correlation.value.size / 2
    np.testing.assert_array_equal(lags.correlation, own.correlation.value[i, j])
    assert not np.any((lags.x == 0) & (lags.y == 0))
    kept = np.isin(statistics.spectrum.power.value, rings.power)
    q = statistics.spectrum.wavenumber[kept]
    assert q.min() >= 4.0 / min(statistics.sub_areas.extent)  # the roll-off ends there
    assert q.max() <= 0.25 * math.pi
    for error, parts in (
        (lags.standard_error, own.rows[1:, i, j]),
        (rings.standard_error, np.log(statistics.spectrum.rows[1:, kept])),
    ):
        jackknife = np.sqrt((len(parts) - 1) * np.var(parts, axis=0))
        np.testing.assert_allclose(error, statistics.sub_areas.widening * jackknife, rtol=1e-9)


def test_lags_across_an_endless_lay_stand_in_every_direction():
    """In metres. Grooves along y leave the lags along x, and grooves along x those along y."""
    rows = np.random.default_rng(1).uniform(size=(4, 5, 7))
    spread = SimpleNamespace(low=rows[0] - 0.1, high=rows[0] + 0.1)
    table = SimpleNamespace(lag_x=1e-6 * np.arange(-2, 3), lag_y=2e-6 * np.arange(-3, 4), rows=rows, correlation=spread)
    for endless, lags, expected in ((1, table.lag_x[3:], rows[:, 3:, 3]), (0, table.lag_y[4:], rows[:, 2, 4:])):
        data = lags_to_fit(table, endless)
        np.testing.assert_allclose(np.hypot(data.x, data.y), np.tile(lags, 4), rtol=1e-12)
        np.testing.assert_allclose(np.arctan2(data.y, data.x), np.repeat(np.arange(4) * np.pi / 4, lags.size))
        np.testing.assert_array_equal(data.correlation, np.tile(expected[0], 4))
        line = effective_number(expected[1:], np.full(lags.size, data.standard_error[0]))
        assert data.number == pytest.approx(line, rel=1e-12)


def test_errors_that_all_parts_share_are_one_estimate():
    independent = np.random.default_rng(5).standard_normal((2000, 6))
    assert effective_number(independent, np.ones(6)) == pytest.approx(6.0, rel=0.02)
    assert effective_number(np.outer(independent[:, 0], np.ones(6)), np.ones(6)) == pytest.approx(1.0)
    assert effective_number(np.outer(independent[:, 0], np.ones(6)), np.arange(1.0, 7.0)) == pytest.approx(1.0)


def test_rings_below_the_side_lobes_of_the_window_are_left_out():
    """A Gaussian spectrum of 14 points a length falls by 1e-7 up to a quarter of the highest wavenumber.

    Of two points a length it bends up to there: no ring is left, and the fit is of lags alone.
    """
    for length, nodes in ((14.0, 256), (2.0, 64)):
        sample = embed(covariance_of("gaussian", 1.0, length), Grid(nodes, nodes, 1.0, 1.0)).sample
        scan = topography(sample(np.random.default_rng(13)), 1.0, 1.0, "a scan")
        statistics = scan_statistics(scan)
        power, q = statistics.spectrum.power.value, statistics.spectrum.wavenumber
        band = (q >= 4.0 / min(statistics.sub_areas.extent)) & (q <= 0.25 * math.pi)
        above, rings = band & (power > 1e-5 * power.max()), rings_to_fit(scan, statistics)
        if length == 2.0:
            assert rings is None
            assert fitted_covariances(("gaussian",), scan, statistics)[0][0].spectrum_misfit == 0.0
        else:
            assert rings.power.tolist() == power[above].tolist()
            assert 2 <= rings.power.size < np.count_nonzero(band)
