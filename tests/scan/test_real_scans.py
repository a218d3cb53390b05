"""Two measured surfaces, which the project does not ship, from file to statistics."""

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest

from roughslip.scan.covariance_fit import fitted_covariances
from roughslip.scan.instrument_file import read_scan
from roughslip.scan.spectrum import rings
from roughslip.scan.statistics import scan_statistics
from roughslip.scan.topography import remove_form
from roughslip.surface.models import KINDS

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"

pytestmark = [
    pytest.mark.skipif(not DATA.is_dir(), reason="needs the measured scans in ../shared/data"),
    pytest.mark.skipif(importlib.util.find_spec("SurfaceTopography") is None, reason="needs the extra `scans`"),
]


def test_a_nearly_gaussian_scan_of_focus_variation():
    scan = read_scan(DATA / "al3d-1.al3d")
    assert scan.grid.shape == (200, 296)
    assert (scan.dx, scan.dy) == pytest.approx((0.438027e-6, 0.438027e-6), rel=1e-6)
    found = scan_statistics(remove_form(scan, "quadratic"))
    assert found.sub_areas.sufficient
    # what another program found, to its digits; its 1/e lengths of 7.0 um lie within our intervals
    assert found.rms_height.value == pytest.approx(0.26e-6, abs=0.005e-6)
    assert found.skewness.value == pytest.approx(-0.04, abs=0.005)
    assert found.kurtosis.value - 3.0 == pytest.approx(0.14, abs=0.005)
    for length in (found.autocorrelation.length_x, found.autocorrelation.length_y):
        assert length.low < 7.0e-6 < length.high
    assert found.skewness.low < 0.0 < found.skewness.high
    assert found.kurtosis.low < 3.0 < found.kurtosis.high


def test_the_best_model_of_that_scan_has_its_spectrum_and_lengths():
    """Lags alone give a Matern model with fifteen times the power at 1.7 rad/um. Instruments cut short waves off,
    and above a quarter of the highest wavenumber no model follows it."""
    scan = remove_form(read_scan(DATA / "al3d-1.al3d"), "quadratic")
    found = scan_statistics(scan)
    (best, *_), refused = fitted_covariances(KINDS, scan, found)
    assert refused == []
    assert max(best.misfit, best.spectrum_misfit) < 1.5
    power, q = found.spectrum.power, found.spectrum.wavenumber
    model = rings(scan.grid, found.sub_areas).expected(best.covariance.spectrum)
    inside = q < 0.25 * math.pi / scan.dx
    inside[0] = False  # takes the mean height along
    assert inside.sum() >= 8
    np.testing.assert_array_less(power.low[inside], model[inside])
    np.testing.assert_array_less(model[inside], power.high[inside])
    for length, axis in zip(best.covariance.axis_lengths_m, ("length_x", "length_y"), strict=True):
        assert getattr(found.autocorrelation, axis).low < length < getattr(found.autocorrelation, axis).high


def test_an_anisotropic_scan_whose_heights_are_phases():
    scan = read_scan(DATA / "matrix-2.txt")
    assert scan.grid.shape == (650, 650)
    assert scan.dx == scan.dy == pytest.approx(0.369862e-6, rel=1e-6)
    found = scan_statistics(remove_form(scan, "quadratic"))
    assert found.rms_height.value == pytest.approx(0.238e-6, abs=0.0005e-6)
    assert found.kurtosis.value - 3.0 == pytest.approx(3.3, abs=0.05)
    assert found.autocorrelation.length_x.value == pytest.approx(8e-6, abs=0.5e-6)
    assert found.autocorrelation.length_y.value == pytest.approx(45e-6, abs=0.5e-6)
    assert abs(abs(found.autocorrelation.lay.value) - math.pi / 2) < math.radians(5)
    assert found.autocorrelation.strength.low > 0.5
    # 45 um on 240 um leave too little for intervals, and the statistics say so
    assert not found.sub_areas.sufficient
