"""From a scene, and from the model of a scan, to meshes, windows, random streams, surfaces and targets."""

import numpy as np
import pytest

from roughslip import store
from roughslip.chaos.pressure import KINDS
from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.probability import FamilyDistribution
from roughslip.scan.statistics import fitted_marginal, scan_statistics
from roughslip.scan.topography import topography
from roughslip.scene.types import scene_of
from roughslip.stages.from_scene import expansion, geometry, surface_model
from roughslip.stages.from_scene.geometry import TRAINING_SPACING, training_columns
from roughslip.stages.result_tables import scan_table
from roughslip.surface.model import gaussian_model
from roughslip.surface.models import covariance_of


def configuration(**strip):
    """The strip of the paper's scene: lengths that are no whole numbers of cells in floating point."""
    return scene_of(
        {
            "square": {"edge_m": 6e-4, "nodes": 10},
            "strip": {
                "length_m": 2.4e-3,
                "margin_m": 3e-4,
                "width_m": 2.5e-5,
                "cell_m": 2.5e-6,
                "window_m": 6e-4,
                "window_spacing_m": 1.5e-5,
            }
            | strip,
        }
    )


def test_meshes_have_the_size_of_the_scene():
    square = geometry.square_grid(configuration())
    assert (square.nx, square.ny, square.nx * square.dx) == (10, 10, pytest.approx(6e-4))
    strip = geometry.strip_grid(configuration())
    assert (strip.nx, strip.ny) == (1200, 10)
    assert (strip.nx * strip.dx, strip.ny * strip.dy) == pytest.approx((3e-3, 2.5e-5))


@pytest.mark.parametrize("margin", [0.0, 3e-4])
def test_windows_fill_the_middle_of_the_strip(margin):
    windows = geometry.windows(configuration(margin_m=margin))
    nx = geometry.strip_grid(configuration(margin_m=margin)).nx
    assert windows.middle == geometry.middle(configuration(margin_m=margin))
    assert windows.middle.start == nx - windows.middle.stop == round(margin / 2.5e-6)
    assert (windows.length, windows.spacing, windows.count) == (240, 6, 121)
    last = windows.middle.start + (windows.count - 1) * windows.spacing + windows.length
    assert last == windows.middle.stop  # four windows are a whole number of spacings here


def test_windows_that_do_not_fill_the_strip_stay_on_it():
    windows = geometry.windows(configuration(length_m=2.41e-3))
    assert windows.count == 121
    assert windows.middle.stop - windows.middle.start == 964


def test_training_columns_lie_on_the_middle_at_equal_distances():
    columns = training_columns(slice(120, 1080))
    assert set(np.diff(columns)) == {TRAINING_SPACING}
    assert columns[0] - 120 < TRAINING_SPACING
    assert 0 < 1080 - columns[-1] <= TRAINING_SPACING
    assert len(columns) == 120
    assert list(training_columns(slice(0, 4))) == []


def test_streams_of_different_stages_never_meet():
    streams = [value for name, value in vars(geometry).items() if name.startswith("STREAM_")]
    assert len(streams) == len(set(streams)) >= 7


@pytest.mark.parametrize(("length", "near", "far"), [(6e-7, 1, 2), (1e-5, 5, 20), (1.42e-5, 7, 28)])
def test_boxes_of_local_means_follow_the_correlation_length(length, near, far):
    stencil = expansion.stencil(covariance_of("gaussian", 1e-8, length), Grid(100, 50, 1e-6, 2e-6))
    assert (stencil.near[0], stencil.far[0]) == (near, far)
    assert stencil.far[1] == max(2, round(far / 2))


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
    variables, attributes = surface_model.stored_model(covariance, law, False, 2e-7)
    path = tmp_path / "scan.nc"
    store.write(path, variables | scan_table.of_scan(scan, found), store.Key({"seed": 1}, "code"), attributes)
    model = surface_model.restored_model(store.read(path))
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


class Surface:
    rms_height_m, lengths_m = 5e-8, (1e-5, 1e-5)


GRID = Grid(8, 8, 1e-6, 1e-6)


def configuration_of_target(target):
    return {
        "expansion": {"target": target},
        "material": {"young_modulus_pa": 2.1e11, "poisson_ratio": 0.3},
    }


@pytest.mark.parametrize("named", [*KINDS, "best"])
def test_the_square_tries_what_is_named_or_all(named):
    found = expansion.targets(scene_of(configuration_of_target(named)), Surface(), GRID)
    assert tuple(target.kind for target in found) == (KINDS if named == "best" else (named,))


@pytest.mark.parametrize(("named", "taken"), [("trial_pressure", "trial_pressure"), ("best", "squared_pressure")])
def test_the_strip_takes_what_is_named_or_what_serves_on_every_mesh(named, taken):
    assert expansion.strip_target(scene_of(configuration_of_target(named)), Surface(), GRID).kind == taken
