"""Models of surfaces: one interface for Gaussian, translated, measured and fractal ones."""

import math

import numpy as np
import pytest
from scipy.special import ndtri

from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.probability import BetaDistribution, translate
from roughslip.surface.fractal import WeierstrassMandelbrot
from roughslip.surface.measured_covariance import tapered
from roughslip.surface.model import GaussianModel, corrected, endless_lay, measured_model
from roughslip.surface.models import covariance_of

BETA = BetaDistribution.of_moments(2.1, 5.0, 0.0, 2.0)
EXPONENTIAL = covariance_of("exponential", 2.0, 5.0)


def test_heights_follow_the_law_and_the_plane_stands_at_its_quantile():
    """200 000 independent heights: four standard deviations of a share of 0.3 are 0.0041."""
    model = GaussianModel(covariance_of("gaussian", 2.0, 0.01), (0.01, 0.01), BETA)
    heights = model.heights(model.sampler(Grid(500, 400, 1.0, 1.0))(np.random.default_rng(2)))
    for percentile in (1.0, 30.0, 50.0, 90.0):
        plane = model.plane_height(percentile)
        assert plane == pytest.approx(float(BETA.from_gaussian(ndtri(1 - percentile / 100))), abs=1e-12)
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


@pytest.mark.parametrize("correct", [False, True])
def test_a_table_of_correlations_is_that_of_the_field_or_of_the_heights(correct):
    """At the lags of its inner half, as far as the covariance nearest to the table changes it."""
    x, y = 0.5 * np.arange(-24, 25), 0.4 * np.arange(-20, 21)
    wanted = covariance_of("exponential", 1.0, 1.4, 0.9, lay_rad=0.6)(x[:, None], y[None, :])
    model = measured_model(wanted, (0.5, 0.4), 2.0, (1.4, 0.9), BETA, correct_correlation=correct)
    found = model.covariance(x[:, None], y[None, :]) / 4.0
    if correct:
        plain = np.abs(translate(BETA).correlation(wanted) - wanted).max()
        found = translate(BETA).correlation(found)
    inner = np.s_[12:37, 10:31]
    assert np.abs(found - wanted)[inner].max() < 1.5 * model.covariance.largest_change < 0.02
    assert not correct or np.abs(found - wanted)[inner].max() < 0.5 * plain
    assert (model.rms_height_m, model.mirror_symmetric, model.marginal) == (2.0, False, BETA)


def test_an_endless_lay_has_the_extent_of_its_profile():
    """Along an endless lay heights are equal, and across it they have the covariance of the profile."""
    turned = covariance_of("exponential", 2.0, 5.0, 2.0, lay_rad=0.4)
    x, y = np.meshgrid([0.0, 1.0, 3.0], [0.0, 2.0], indexing="ij")
    for axis, across in ((0, turned(0.0, y)), (1, turned(x, 0.0))):
        grooves = endless_lay(turned, axis)
        np.testing.assert_array_equal(grooves(x, y), across)
        assert grooves.reach_m[axis] == 0.0
        assert grooves.reach_m[1 - axis] == turned.reach_m[1 - axis]
        assert grooves.rms_height_m == 2.0


def test_a_smooth_field_cannot_have_every_law():
    """rho_z / w_1 less a multiple of rho_z^2, whose spectrum is the wider one: negative at short waves."""
    with pytest.raises(IllPosedError, match=r"no Gaussian field gives the wanted correlation.*nearest deviates"):
        corrected(covariance_of("gaussian", 2.0, 5.0), translate(BETA), (5.0, 5.0))


def test_a_taper_leaves_the_inner_half_and_ends_near_zero():
    window = tapered(np.ones((81, 41)))
    np.testing.assert_array_equal(window[20:61, 10:31], 1.0)
    assert window[0].max() < 0.01
    np.testing.assert_array_equal(window, window[::-1, ::-1])


def test_a_fractal_surface():
    """Its Sq and the share above a plane over 200 samples of 8 x 10 waves, to four standard errors of their scatter."""
    law = WeierstrassMandelbrot(0.7, 2.0, 40.0, 3.0, azimuths=8)
    sample = law.sampler(Grid(160, 20, 1.0, 1.0))
    fields = np.stack([sample(np.random.default_rng([5, number])) for number in range(200)])
    assert law.heights(fields) is fields
    assert not law.mirror_symmetric
    for values, expected in ((fields**2, 4.0), (fields > law.plane_height(20.0), 0.2)):
        means = np.mean(values, axis=(1, 2))
        assert np.mean(means) == pytest.approx(expected, abs=4 * np.std(means) / math.sqrt(200))
