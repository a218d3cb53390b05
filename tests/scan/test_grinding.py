import math

import numpy as np
import pytest

from roughslip.errors import ParameterError
from roughslip.grid import Grid
from roughslip.scan.grinding import Grinding, ground_surface
from roughslip.scan.statistics import scan_statistics
from roughslip.scan.topography import remove_form, topography


def test_heights_of_a_flat_blank_follow_the_boolean_model():
    """A point lies above -h where no grain's cut is that deep there: grains that do are Poisson, so that

    P(z > -h) = exp(-n <2 pi (d - h)+ sqrt(R r)>) = exp(-2 pi n D exp(-h/D) sqrt(R r0) exp(s^2/8)).
    """
    grid = Grid(200, 200, 0.5e-6, 0.5e-6)
    grinding = Grinding(grains_per_m2=1e10, path_radius_m=5e-5, blank_rms_m=1e-15)
    d, r = grinding.depth_m, grinding.tip_radius_m
    area = 2 * math.pi * d * math.sqrt(5e-5 * r) * math.exp(grinding.tip_spread**2 / 8)
    samples = [ground_surface(grinding, grid, np.random.default_rng([41, i])) for i in range(24)]
    for h in np.array([1e-3, 0.5, 1.0, 2.0]) * d:
        above = np.array([np.mean(z > -h) for z in samples])
        edge = np.array([np.mean(z[:4] > -h) for z in samples])  # grains outside the mesh cut its edge as often
        truth = math.exp(-1e10 * area * math.exp(-h / d))
        # 24 independent surfaces: four standard errors, each from their own scatter
        assert np.mean(above) == pytest.approx(truth, abs=4 * above.std(ddof=1) / math.sqrt(24))
        assert np.mean(edge) == pytest.approx(truth, abs=4 * edge.std(ddof=1) / math.sqrt(24))


def test_a_ground_surface_has_a_lay_along_x_and_negative_skewness():
    grid = Grid(512, 256, 0.5e-6, 0.5e-6)
    z = ground_surface(Grinding(), grid, np.random.default_rng([42, 0]))
    found = scan_statistics(remove_form(topography(z, grid.dx, grid.dy, "ground"), "plane"))
    assert found.sub_areas.sufficient
    assert found.skewness.high < 0.0
    assert found.autocorrelation.strength.low > 0.5
    assert abs(found.autocorrelation.lay.value) < math.radians(3)
    assert found.autocorrelation.length_x.low > 2.0 * found.autocorrelation.length_y.high


def test_same_generator_same_surface():
    grid = Grid(64, 64, 0.5e-6, 0.5e-6)
    first, second = (ground_surface(Grinding(), grid, np.random.default_rng([43])) for _ in range(2))
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_parameters_are_positive(value):
    with pytest.raises(ParameterError, match="tip_radius_m"):
        Grinding(tip_radius_m=value)
