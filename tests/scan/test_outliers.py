"""Outliers of a scan: found where they were put, and none on surfaces without."""

import numpy as np
import pytest

from roughslip.grid import Grid
from roughslip.scan import remove_form, scan_statistics
from roughslip.scan.outliers import outliers, warnings, without
from roughslip.scan.topography import topography
from roughslip.surface import covariance_of, gaussian_model

GRID = Grid(128, 128, 1e-6, 1e-6)


def surface(kind, seed):
    """Heights (128, 128) of Sq about 0.2 µm without outliers."""
    rng = np.random.default_rng(seed)
    z = gaussian_model(covariance_of("gaussian" if kind == "gaussian" else "exponential", 2e-7, 6e-6)).sampler(GRID)(
        rng
    )
    if kind == "plateau":
        return np.where(z < 0.0, z, 0.2 * z)
    if kind == "grooved":
        x, y = np.meshgrid(np.arange(128.0), np.arange(128.0), indexing="ij")
        for angle, place in zip(rng.uniform(0.0, np.pi, 6), rng.uniform(20.0, 100.0, 6), strict=True):
            z = z - 2e-6 * np.exp(-((((x - place) * np.cos(angle) + (y - 64.0) * np.sin(angle)) / 2.0) ** 2))
    return z


@pytest.mark.parametrize("kind", ["gaussian", "exponential", "plateau", "grooved"])
def test_no_false_alarm(kind):
    """At most 5 % of surfaces without outliers are flagged."""
    flagged = [outliers(topography(surface(kind, seed), 1e-6, 1e-6, kind)).any() for seed in range(20)]
    assert sum(flagged) <= 1


def test_spikes_are_found_and_left_out():
    """Spikes of 30 Sq at known places: just these are found, and without them Sq is that of the clean surface."""
    clean = surface("gaussian", 4)
    put = np.zeros(clean.shape, dtype=bool)
    put.flat[np.random.default_rng(1).choice(clean.size, 16, replace=False)] = True
    scan = remove_form(topography(clean + 6e-6 * put, 1e-6, 1e-6, "spikes"), "plane")
    found = outliers(scan)
    assert np.array_equal(found, put)
    (line,) = warnings(scan, found, "keep")
    assert line.startswith("16 points")
    assert "roughness.scan.outliers" in line
    rms = float(scan_statistics(without(scan, found, "plane")).rms_height.value)
    expected = float(scan_statistics(remove_form(topography(clean, 1e-6, 1e-6, "clean"), "plane")).rms_height.value)
    assert rms == pytest.approx(expected, rel=0.005)
    kurtosis, skewness = scan_statistics(scan).kurtosis, scan_statistics(scan).skewness
    assert kurtosis.low >= 1.0 + skewness.value**2
