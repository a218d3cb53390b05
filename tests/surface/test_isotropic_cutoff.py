"""A roll-off with a lay beside a cut-off that is the same in all directions, against quadrature of its spectrum."""

import itertools

import numpy as np
import pytest

from roughslip.errors import ParameterError
from roughslip.surface.models import SelfAffine, self_affine
from roughslip.surface.plausibility import rms_curvature, rms_slope

LENGTHS = {"rolloff_wavelength_m": 40.0, "rolloff_wavelength_across_m": 10.0, "cutoff_wavelength_m": 2.0}
NODES, WEIGHTS = np.polynomial.legendre.leggauss(120)


def spectral_mean(covariance, weight):
    """int weight S dq / (2 pi)^2 by rings: 400 directions, and between roll-offs, cut-off and zero 120 Gauss nodes."""
    theta = 2 * np.pi * np.arange(400) / 400
    along, across = (2 * np.pi / length for length in covariance.rolloff_wavelengths_m)
    rolloff = 1 / np.hypot(np.cos(theta) / along, np.sin(theta) / across)
    ends = np.zeros_like(rolloff), rolloff, np.full_like(rolloff, np.pi * (1 - 1e-15))
    total = 0.0
    for low, high in itertools.pairwise(ends):
        q = low[:, None] + (high - low)[:, None] / 2 * (NODES + 1)
        turned = theta[:, None] + covariance.lay_rad
        qx, qy = q * np.cos(turned), q * np.sin(turned)
        values = q * weight(qx, qy) * covariance.spectrum(qx, qy)
        total += np.sum(values @ WEIGHTS * (high - low) / 2)
    return total / 400 / (2 * np.pi)


@pytest.mark.parametrize("hurst", [0.3, 0.8, 1.0])
def test_covariance_slope_and_curvature_are_integrals_of_the_spectrum(hurst):
    """H = 1 has a logarithm in the series. Both methods are exact to rounding; slopes between nodes tend to it."""
    covariance = self_affine(1.5, hurst, **LENGTHS, lay_rad=0.4, isotropic_cutoff=True)
    for x, y in ((0.0, 0.0), (3.0, -1.0), (-8.0, 20.0), (30.0, 5.0)):
        expected = spectral_mean(covariance, lambda qx, qy, x=x, y=y: np.cos(qx * x + qy * y))
        assert covariance(np.array(x), y) == pytest.approx(expected, abs=1e-11 * 1.5**2)
    slope = np.sqrt(spectral_mean(covariance, lambda qx, qy: qx**2 + qy**2))
    assert rms_slope(covariance) == pytest.approx(slope, rel=1e-12)
    assert rms_slope(covariance, 1e-4) == pytest.approx(slope, rel=1e-4)
    curvature = np.sqrt(spectral_mean(covariance, lambda qx, qy: (qx**2 + qy**2) ** 2 / 4))
    assert rms_curvature(covariance) == pytest.approx(curvature, rel=1e-12)


def test_the_shortest_wave_is_the_same_in_all_directions():
    """With a cut-off of the lay it is four times as short across it, and the surface four times as rough there."""
    isotropic = self_affine(1.0, 0.8, **LENGTHS, isotropic_cutoff=True)
    with_lay = self_affine(1.0, 0.8, **LENGTHS)
    inside, beyond, zero = np.array([0.999 * np.pi]), np.array([1.001 * np.pi]), np.zeros(1)
    for qx, qy in ((inside, zero), (zero, inside), (inside / 2**0.5, inside / 2**0.5)):
        assert isotropic.spectrum(qx, qy) > 0
    for qx, qy in ((beyond, zero), (zero, beyond), (beyond / 2**0.5, beyond / 2**0.5)):
        assert isotropic.spectrum(qx, qy) == 0
    assert with_lay.spectrum(zero, 3.9 * np.pi) > 0
    assert rms_slope(isotropic) < 0.75 * rms_slope(with_lay)
    assert isotropic.cutoff_wavelengths_m == (2.0, 2.0)


def test_equal_rolloffs_are_the_model_of_one_length():
    same = self_affine(1.5, 0.8, 40.0, 2.0, isotropic_cutoff=True)
    assert same == self_affine(1.5, 0.8, 40.0, 2.0)
    nearly = self_affine(1.5, 0.8, 40.0, 2.0, 40.0 * (1 + 1e-9), isotropic_cutoff=True)
    assert not isinstance(nearly, SelfAffine)
    x = np.linspace(0.0, 300.0, 200)
    np.testing.assert_allclose(nearly(x, x / 3), same(x, x / 3), atol=1e-8)
    assert nearly.axis_lengths_m == pytest.approx(same.axis_lengths_m, rel=1e-8)


def test_lengths_along_the_axes_turn_with_the_lay():
    """Their ratio is below that of the roll-offs, 4, since the shortest waves have no lay."""
    for lay, order in ((0.0, 1), (np.pi / 2, -1)):
        covariance = self_affine(1.0, 0.8, **LENGTHS, lay_rad=lay, isotropic_cutoff=True)
        x, y = covariance.axis_lengths_m
        np.testing.assert_allclose([covariance(np.array(x)), covariance(np.array(0.0), y)], 1 / np.e, rtol=1e-11)
        assert 1 < (x / y) ** order < 4
        assert covariance.mirror_symmetric


def test_a_cutoff_longer_than_a_rolloff_is_refused():
    with pytest.raises(ParameterError, match="bandwidth"):
        self_affine(1.0, 0.8, 40.0, 12.0, 10.0, isotropic_cutoff=True)
