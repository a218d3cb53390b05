"""Models of surfaces: one interface for Gaussian, translated, measured and fractal ones."""

import math

import numpy as np
import pytest

from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.probability import FamilyDistribution, translate
from roughslip.scan.autocorrelation import autocorrelation
from roughslip.scan.covariance_fit import fitted_covariances
from roughslip.scan.fit_data import lags_to_fit
from roughslip.scan.statistics import fitted_marginal, scan_statistics
from roughslip.scan.topography import topography
from roughslip.surface.corrected_covariance import corrected
from roughslip.surface.covariance import plane_height
from roughslip.surface.embedding import embed
from roughslip.surface.fractal import WeierstrassMandelbrot
from roughslip.surface.measured_covariance import tapered
from roughslip.surface.model import FractalModel, GaussianModel, gaussian_model, measured_model
from roughslip.surface.models import KINDS, covariance_of

BETA = FamilyDistribution("beta", 2.0, (2.1, 5.0))
EXPONENTIAL = covariance_of("exponential", 2.0, 5.0)
SHAPES = {"matern": {"smoothness": 1.5}, "self_affine": {"hurst": 0.7, "bandwidth": 20.0}}


def test_a_plain_gaussian_surface_is_its_embedding():
    """To the last bit: scenes of before samples had models keep their results."""
    grid = Grid(40, 20, 1.0, 1.0)
    model = gaussian_model(EXPONENTIAL, EXPONENTIAL.axis_lengths_m)
    field = model.sampler(grid)(np.random.default_rng(1))
    np.testing.assert_array_equal(field, embed(EXPONENTIAL, grid).sample(np.random.default_rng(1)))
    assert model.heights(field) is field
    levels = np.array([5.0, 50.0, 80.0])
    np.testing.assert_array_equal(model.plane_height(levels), plane_height(levels, 2.0))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("lay", [0.0, 0.7, math.pi / 2, -2.2])
def test_lengths_along_the_axes_are_where_the_correlation_is_1_over_e(kind, lay):
    covariance = covariance_of(kind, 3.0, 4.0, 1.5, lay, **SHAPES.get(kind, {}))
    x, y = covariance.axis_lengths_m
    assert covariance(np.array(x), 0.0) / 9.0 == pytest.approx(math.exp(-1), rel=1e-9)
    assert covariance(np.array(0.0), y) / 9.0 == pytest.approx(math.exp(-1), rel=1e-9)


def test_heights_follow_the_law_and_the_plane_stands_at_its_quantile():
    """200 000 independent heights: four standard deviations of a share of 0.3 are 0.0041."""
    model = GaussianModel(covariance_of("gaussian", 2.0, 0.01), (0.01, 0.01), BETA)
    heights = model.heights(model.sampler(Grid(500, 400, 1.0, 1.0))(np.random.default_rng(2)))
    for percentile in (1.0, 30.0, 50.0, 90.0):
        plane = model.plane_height(percentile)
        assert plane == pytest.approx(float(BETA.quantile(1 - percentile / 100)), abs=1e-12)
        assert np.mean(heights > plane) == pytest.approx(percentile / 100, abs=4.1e-3)
    assert model.plane_height(50.0) < 0  # the median of a right-skewed law lies below its mean


def test_a_corrected_covariance_gives_the_heights_the_one_wanted():
    """Mehler's series of the Gaussian correlation, lag by lag; without the correction it is off by some 0.008."""
    lags = np.linspace(0.0, 20.0, 60)
    translation = translate(BETA)
    behind = corrected(EXPONENTIAL, translation, (5.0, 5.0))
    wanted = EXPONENTIAL(lags) / 4.0
    np.testing.assert_allclose(translation.correlation(behind(lags) / 4.0), wanted, atol=1e-11)
    assert 0.007 < np.abs(translation.correlation(wanted) - wanted).max() < 0.009
    embed(behind, Grid(100, 20, 1.0, 1.0))  # a covariance on meshes too


def test_a_smooth_field_cannot_have_every_law():
    """rho_z / w_1 less a multiple of rho_z^2, whose spectrum is the wider one: negative at short waves."""
    with pytest.raises(IllPosedError, match=r"no Gaussian field gives the wanted correlation.*nearest deviates"):
        corrected(covariance_of("gaussian", 2.0, 5.0), translate(BETA), (5.0, 5.0))


def test_a_taper_leaves_the_inner_half_and_ends_near_zero():
    window = tapered(np.ones((81, 41)))
    np.testing.assert_array_equal(window[20:61, 10:31], 1.0)
    assert window[0].max() < 0.01
    np.testing.assert_array_equal(window, window[::-1, ::-1])


@pytest.fixture(scope="module")
def scan():
    """A skewed anisotropic scan of 300 x 300 points, 25 and 75 lengths an edge, and its statistics."""
    truth = gaussian_model(covariance_of("exponential", 2.0, 12.0, 4.0), (12.0, 4.0), BETA)
    field = truth.sampler(Grid(300, 300, 1.0, 1.0))(np.random.default_rng(3))
    measured = topography(truth.heights(field), 1.0, 1.0, "a scan")
    return measured, scan_statistics(measured)


def test_the_model_of_a_scan_is_found(scan):
    """Lengths within four of their errors of the truth, which translation changes by less than 1 %."""
    measured, found = scan
    (best, *others), refused = fitted_covariances(KINDS, measured, found)
    assert refused == []
    assert best.covariance.kind in ("exponential", "matern")  # a matern of smoothness 1/2 is exponential
    assert best.criterion <= min(other.criterion for other in others)
    exponential = next(one for one in (best, *others) if one.covariance.kind == "exponential")
    for name, truth in (("correlation_length_m", 12.0), ("correlation_length_across_m", 4.0)):
        assert abs(exponential.parameters[name] - truth) < 4 * exponential.standard_errors[name] + 0.01 * truth
    law = fitted_marginal("weibull", measured, found.rms_height.value)
    assert found.skewness.low < law.skewness < found.skewness.high
    assert fitted_marginal("gaussian", measured, 1.0) is None
    assert fitted_marginal("empirical", measured, 1.7).standard_deviation == pytest.approx(1.7, rel=1e-6)


def test_lags_are_thinned_about_lag_zero(scan):
    _, found = scan
    data = lags_to_fit(found.autocorrelation)
    assert len(data.x) <= 2000
    assert not np.any((data.x == 0) & (data.y == 0))
    i, j = (len(axis) // 2 for axis in (found.autocorrelation.lag_x, found.autocorrelation.lag_y))
    table = found.autocorrelation.correlation.value
    at = table[np.round(data.x).astype(int) + i, np.round(data.y).astype(int) + j]
    np.testing.assert_array_equal(data.correlation, at)


@pytest.mark.parametrize("correct", [False, True])
def test_twins_of_a_measured_autocorrelation_have_it(scan, correct):
    """The mean of four twins within the interval of the scan at lags above 1/e, on either axis."""
    measured, found = scan
    own = found.autocorrelation
    lengths = float(own.length_x.value), float(own.length_y.value)
    law = fitted_marginal("empirical", measured, found.rms_height.value)
    model = measured_model(own.rows[0], (1.0, 1.0), found.rms_height.value, lengths, law, correct_correlation=correct)
    sample = model.sampler(measured.grid)
    twins = [
        autocorrelation(
            topography(model.heights(sample(np.random.default_rng([4, number]))), 1.0, 1.0, "a twin"), found.sub_areas
        )
        for number in range(4)
    ]
    for name in ("length_x", "length_y"):
        interval = getattr(own, name)
        assert interval.low < np.mean([getattr(twin, name).value for twin in twins]) < interval.high


def test_a_fractal_surface():
    """Its Sq over 200 samples, each of 8 x 10 waves: the variance of a sample scatters, four standard errors of it."""
    law = WeierstrassMandelbrot(0.7, 2.0, 40.0, 3.0, azimuths=8)
    model = FractalModel(law)
    sample = model.sampler(Grid(160, 20, 1.0, 1.0))
    fields = np.stack([sample(np.random.default_rng([5, number])) for number in range(200)])
    assert model.heights(fields) is fields
    squares = np.mean(fields**2, axis=(1, 2))
    assert np.mean(squares) == pytest.approx(4.0, abs=4 * np.std(squares) / math.sqrt(200))
    above = np.mean(fields > model.plane_height(20.0), axis=(1, 2))
    assert np.mean(above) == pytest.approx(0.2, abs=4 * np.std(above) / math.sqrt(200))
    assert model.plane_height(50.0) == pytest.approx(0.0, abs=1e-9)
    x, y = model.lengths_m
    assert law(x) == pytest.approx(4.0 / math.e, rel=1e-6)
    assert law(0.0, y) == pytest.approx(4.0 / math.e, rel=1e-6)
