import numpy as np
import pytest

from roughslip.errors import ParameterError
from roughslip.surface.covariance import Covariance, plane_height


@pytest.mark.parametrize("kind", ["gaussian", "exponential"])
def test_one_correlation_length_leaves_one_over_e(kind):
    covariance = Covariance(kind, 2.0, 3.0)
    assert covariance(np.array(0.0)) == 4.0
    np.testing.assert_allclose(covariance(np.array(3.0)), 4.0 / np.e, rtol=1e-15)
    np.testing.assert_allclose(covariance(np.array(3.0) * 0.6, 3.0 * 0.8), 4.0 / np.e, rtol=1e-15)  # isotropic


def test_plane_stands_where_the_share_of_heights_lies_above():
    assert plane_height(50.0, 1e-6) == 0.0
    np.testing.assert_allclose(plane_height(15.865525393145708, 2.0), 2.0, rtol=1e-14)  # one sigma
    assert np.all(np.diff(plane_height(np.array([5.0, 50.0, 95.0]), 1.0)) < 0)  # deeper is lower


@pytest.mark.parametrize("arguments", [("matern", 1.0, 1.0), ("gaussian", 0.0, 1.0), ("gaussian", 1.0, np.nan)])
def test_nonsense_is_refused(arguments):
    with pytest.raises(ParameterError):
        Covariance(*arguments)


@pytest.mark.parametrize("percentile", [0.0, 100.0, -1.0, np.nan])
def test_percentiles_outside_the_open_range_are_refused(percentile):
    with pytest.raises(ParameterError):
        plane_height(percentile, 1.0)
