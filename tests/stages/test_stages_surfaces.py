"""From a scene, and from what a scan left on disk, to the model of a surface."""

import numpy as np
import pytest

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.probability import FamilyDistribution
from roughslip.scan.model_fit import fitted_marginal
from roughslip.scan.statistics import scan_statistics
from roughslip.scan.topography import topography
from roughslip.scene.types import scene_of
from roughslip.stages.from_scene import scan_model, surface_model
from roughslip.stages.result_tables import scan_table
from roughslip.surface.model import gaussian_model
from roughslip.surface.models import covariance_of

FIELD = {"covariance": "exponential", "rms_height_m": 2e-7, "correlation_length_m": 5e-6}
STRIP = {"strip": {"length_m": 2.4e-3, "margin_m": 3e-4, "width_m": 2.5e-5, "cell_m": 2.5e-6}}


def test_a_field_with_every_key():
    roughness = FIELD | {"covariance": "matern", "smoothness": 1.5, "correlation_length_across_m": 2e-6, "lay_rad": 0.3}
    model = surface_model.surface_model(scene_of({"roughness": roughness}))
    assert model.covariance == covariance_of("matern", 2e-7, 5e-6, 2e-6, 0.3, smoothness=1.5)
    assert model.lengths_m == model.covariance.axis_lengths_m
    assert model.marginal is None


def test_a_law_of_heights():
    law = {"family": "lognormal", "shapes": [0.4], "mirrored": True}
    model = surface_model.surface_model(scene_of({"roughness": FIELD | {"marginal": law}}))
    assert model.marginal == FamilyDistribution("lognormal", 2e-7, (0.4,), True)
    assert model.covariance == covariance_of("exponential", 2e-7, 5e-6)
    corrected = surface_model.surface_model(
        scene_of({"roughness": FIELD | {"marginal": law | {"correct_correlation": True}}})
    )
    lag = np.array(5e-6)
    assert corrected.covariance.wanted(lag) == model.covariance(lag)
    assert corrected.covariance(lag) > model.covariance(lag)
    smooth = FIELD | {"covariance": "gaussian", "marginal": law | {"correct_correlation": True}}
    with pytest.raises(IllPosedError, match="no Gaussian field"):
        surface_model.surface_model(scene_of({"roughness": smooth}))


def test_the_band_of_a_fractal_is_that_of_the_strip_unless_given():
    fractal = {"hurst": 0.8, "azimuths": 8, "gamma": 1.5}
    roughness = {"rms_height_m": 2e-7, "fractal": fractal}
    law = surface_model.surface_model(scene_of({"roughness": roughness, **STRIP})).law
    assert law.longest_wavelength_m == pytest.approx(3e-3)
    assert 1 / law.frequencies[-1] > 5e-6 > 1 / law.frequencies[-1] / 1.5
    fractal |= {"longest_wavelength_m": 6e-5, "shortest_wavelength_m": 8e-6}
    law = surface_model.surface_model(scene_of({"roughness": roughness, **STRIP})).law
    assert (law.longest_wavelength_m, law.shortest_wavelength_m) == (6e-5, 8e-6)


@pytest.mark.parametrize("covariance", [None, covariance_of("matern", 2e-7, 5e-6, 2e-6, 0.1, smoothness=0.8)])
@pytest.mark.parametrize("family", ["gaussian", "weibull", "empirical"])
def test_the_model_of_a_scan_comes_back_from_disk(tmp_path, covariance, family):
    truth = gaussian_model(
        covariance_of("exponential", 2e-7, 5e-6), (5e-6, 5e-6), FamilyDistribution("weibull", 2e-7, (2.0,))
    )
    field = truth.sampler(Grid(160, 160, 1e-6, 1e-6))(np.random.default_rng(1))
    scan = topography(truth.heights(field), 1e-6, 1e-6, "a scan")
    found = scan_statistics(scan)
    law = fitted_marginal(family, scan, 2e-7)
    variables, attributes = scan_model.stored(covariance, law, False, 2e-7)
    path = tmp_path / "scan.nc"
    store.write(path, variables | scan_table.of_scan(scan, found), store.Key({"seed": 1}, "code"), attributes)
    model = scan_model.restored(store.read(path))
    assert model.rms_height_m == pytest.approx(2e-7, rel=1e-12)
    if covariance is None:
        assert model.lengths_m == (found.autocorrelation.length_x.value, found.autocorrelation.length_y.value)
        near = model.covariance(found.autocorrelation.lag_x, 0.0) / 4e-14
        table = found.autocorrelation.correlation.value[:, len(found.autocorrelation.lag_y) // 2]
        inner = np.abs(found.autocorrelation.lag_x) < 5e-6
        np.testing.assert_allclose(near[inner], table[inner], atol=0.05)
    else:
        assert model.covariance == covariance
    score = np.linspace(-3, 3, 7)
    if law is None:
        assert model.marginal is None
    else:
        np.testing.assert_array_equal(model.marginal.from_gaussian(score), law.from_gaussian(score))
    parts = scan_table.sub_areas_of(store.read(path), scan)
    assert parts == found.sub_areas


def test_without_twins_there_is_nothing_to_show():
    with pytest.raises(IllPosedError, match="larger area"):
        scan_table.of_twins([], np.array([0.0, 1.0]))
