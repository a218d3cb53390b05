"""The high-pass against closed forms: what it keeps of waves and planes."""

import math

import numpy as np
import pytest

from roughslip.errors import ParameterError
from roughslip.scan.high_pass import high_pass
from roughslip.scan.topography import topography

NX, NY, DX, DY, CUTOFF = 240, 150, 1.0, 1.5, 30.0
X, Y = np.meshgrid(np.arange(NX) * DX, np.arange(NY) * DY, indexing="ij")


@pytest.mark.parametrize("angle", [0.0, 0.6, math.pi / 2])
@pytest.mark.parametrize(("wavelength", "kept"), [(1.0, 0.5), (2.0, 1 - 2**-0.25), (0.5, 1 - 2**-4)])
def test_of_a_wave_it_keeps_what_the_standard_says(angle, wavelength, kept):
    """1 - 2^-(cutoff / wavelength)^2 in every direction, one half at the cutoff; away from the rim, to 1e-7."""
    q = 2 * math.pi / (CUTOFF * wavelength)
    wave = np.cos(q * (X * math.cos(angle) + Y * math.sin(angle)) + 0.3)
    found = high_pass(topography(wave, DX, DY, "a wave"), CUTOFF).heights
    inside = slice(52, -52), slice(35, -35)
    np.testing.assert_allclose(found[inside], kept * wave[inside], atol=1e-7)


def test_a_plane_is_taken_off_to_the_rim_and_in_holes():
    plane, wave = 3.0 + 0.02 * X - 0.05 * Y, np.cos(X)
    plane[20:24, 30] = np.nan
    with_plane, alone = (
        high_pass(topography(z, DX, DY, "a scan"), CUTOFF).heights for z in (plane + wave, plane * 0 + wave)
    )
    np.testing.assert_allclose(with_plane, alone, atol=1e-11)
    with pytest.raises(ParameterError, match=r"roughness\.scan\.cutoff_m.*no shorter waves"):
        high_pass(topography(plane, DX, DY, "a plane"), CUTOFF)


def test_a_cutoff_that_no_wave_of_the_scan_has_is_refused():
    scan = topography(np.cos(X), DX, DY, "a wave")
    for cutoff in (7.4, 226.0):
        with pytest.raises(ParameterError, match=r"roughness\.scan\.cutoff_m.*7\.5 m.*225 m"):
            high_pass(scan, cutoff)
    assert high_pass(scan, 225.0).heights.std() > 0.5
