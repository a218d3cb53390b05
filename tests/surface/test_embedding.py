"""Exact samples by circulant embedding; Weierstrass-Mandelbrot surfaces and sums of cosines with random phases."""

import math

import numpy as np
import pytest
import scipy.fft
from scipy.special import j0, jv, ndtr

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.surface.embedding import circulant_lags, embed, embed_cell
from roughslip.surface.fractal import WeierstrassMandelbrot, cdf, height_series
from roughslip.surface.measured_covariance import measured_covariance
from roughslip.surface.models import covariance_of, self_affine


def measured(lag=0.5):
    """Rotated and with a negative lobe, as the table of a ground surface; not symmetric in x."""
    x, y = np.arange(-20, 21)[:, None] * lag, np.arange(-20, 21)[None, :] * lag
    table = covariance_of("gaussian", 1.0, 3.0, 1.0, lay_rad=0.5)(x, y) * np.cos(0.8 * (x + y))
    return measured_covariance(table, lag, lag, 2.0)


MODELS = {
    "rotated": covariance_of("exponential", 2.0, 3.0, 0.7, lay_rad=0.5),
    "long": covariance_of("gaussian", 2.0, 25.0),
    "measured": measured(),
}


@pytest.mark.parametrize("name", MODELS)
def test_embeddings_are_exact_or_say_by_how_much_they_are_not(name):
    """Filtered white noise has covariance irfft(root^2), here at every lag of the mesh, y of both signs.

    Clipped eigenvalues change no lag by more than their share of the variance."""
    covariance = MODELS[name]
    for grid in (Grid(24, 15, 1.0, 0.7), Grid(9, 40, 0.5, 0.5)):
        embedding, (nx, ny) = embed(covariance, grid), grid.shape
        lags = scipy.fft.irfft2(embedding.root**2, s=embedding.torus)[:nx, np.arange(1 - ny, ny)]
        asked = covariance((np.arange(nx) * grid.dx)[:, None], (np.arange(1 - ny, ny) * grid.dy)[None, :])
        assert np.abs(lags - asked).max() < covariance.rms_height_m**2 * (embedding.clipped_variance + 1e-13)
        assert embedding.clipped_variance < 1e-8


def test_self_affine_keeps_its_power_law():
    """The eigenvalues are the spectrum over the cell, up to the one factor that restores the variance."""
    grid = Grid(64, 64, 1.0, 1.0)
    covariance = self_affine(1.0, 0.8, 16.0, 2.0)
    embedding = embed(covariance, grid)
    q = 2 * np.pi * scipy.fft.rfftfreq(embedding.torus[1])
    ratio = embedding.root[0, :-1] ** 2 / covariance.spectrum(q[:-1])  # the last lies on the cut-off
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-12)
    assert ratio[0] == pytest.approx(1.0, abs=1e-2)  # the sum over the torus is not quite the integral


def test_a_cell_has_the_covariance_up_to_half_a_period():
    """Of eight correlation lengths a Gaussian one ends at half of them, and the variance is exact. Waves are periodic.

    At one length the nearest image has a kink, which costs more than a hundredth of the variance. A self-affine surface
    is given its spectrum.
    """
    grid = Grid(64, 48, 1e-6, 1e-6)
    smooth = covariance_of("gaussian", 2e-7, 6e-6)
    cell = embed_cell(smooth, grid)
    lags = scipy.fft.irfft2(cell.root**2, grid.shape)
    assert cell.torus == grid.shape
    np.testing.assert_allclose(lags, circulant_lags(smooth, grid, grid.shape), atol=1e-7 * 4e-14)
    affine = embed_cell(self_affine(2e-7, 0.8, 2e-5, 4e-6), grid)
    assert scipy.fft.irfft2(affine.root**2, grid.shape)[0, 0] == pytest.approx(4e-14, rel=1e-12)
    with pytest.raises(IllPosedError, match="its edges are short against the correlation"):
        embed_cell(covariance_of("gaussian", 2e-7, 6e-5), grid)


UM = 1e-6
LAW = WeierstrassMandelbrot(0.7, 2 * UM, 100 * UM, 12 * UM, azimuths=6)


def test_heights_are_the_sum_of_the_waves():
    """The product of matrices against the sum of cosines as written; 36 terms of rounding."""
    grid = Grid(23, 17, 5 * UM, 4 * UM)
    xi = np.random.default_rng(1).standard_normal(LAW.variables)
    x, y = np.meshgrid(grid.x(), grid.y(), indexing="ij")
    plain = np.zeros(grid.shape)
    for j, (f, a) in enumerate(zip(LAW.frequencies, LAW.amplitudes, strict=True)):
        for m in range(LAW.azimuths):
            alpha, phase = math.pi * m / LAW.azimuths, 2 * math.pi * ndtr(xi[j * LAW.azimuths + m])
            plain += a * np.cos(2 * math.pi * f * (x * math.cos(alpha) + y * math.sin(alpha)) + phase)
    drawn = LAW.sampler(grid)(np.random.default_rng(1))
    np.testing.assert_allclose(drawn, plain, atol=1e-14 * LAW.variables * UM)
    with pytest.raises(ParameterError, match="alias"):
        LAW.sampler(Grid(16, 16, 0.51 / LAW.frequencies[-1], UM))


def test_profile_is_the_paper_s_sum():
    """One azimuth: amplitudes gamma^((D - 2) j) with D = 2 - H, no change along y."""
    law = WeierstrassMandelbrot(0.6, UM, 100 * UM, 7 * UM, gamma=1.4)
    fractal_dimension = 1.4
    j = np.arange(law.variables)
    np.testing.assert_allclose(law.amplitudes / law.amplitudes[0], 1.4 ** ((fractal_dimension - 2) * j), rtol=1e-13)
    np.testing.assert_allclose(law.frequencies, 1.4**j / (100 * UM), rtol=1e-13)
    assert law.frequencies[-1] <= 1 / (7 * UM) < 1.4 * law.frequencies[-1]
    field = law.sampler(Grid(30, 4, 3 * UM, 3 * UM))(np.random.default_rng(2))
    assert np.ptp(field, axis=1).max() == 0.0


def test_azimuths_make_it_isotropic():
    """Jacobi-Anger: the mean of cos(k r cos(alpha_m - beta)) is J0 + 2 sum_l (-1)^(l M) J_2lM cos(2 l M beta)."""
    single = WeierstrassMandelbrot(0.5, 1.0, 1.0, 1.0, azimuths=6)
    r = np.linspace(0.0, 3.0, 50)
    for beta in (0.0, 0.2, math.pi / 12):
        k = 2 * math.pi * r
        series = j0(k) + sum(2 * jv(12 * n, k) * np.cos(12 * n * beta) for n in range(1, 6))
        np.testing.assert_allclose(single(r * math.cos(beta), r * math.sin(beta)), series, atol=1e-13)
    near = r[r < 6 / math.pi]  # M / pi wavelengths
    assert np.max(np.abs(single(near) - j0(2 * math.pi * near))) < 2 * jv(12, 12.0) < 0.4


def test_one_over_e_length():
    wave = WeierstrassMandelbrot(0.5, UM, 10 * UM, 10 * UM)
    assert wave.correlation_length() == pytest.approx(10 * UM * math.acos(1 / math.e) / (2 * math.pi), rel=1e-10)
    for azimuth in (0.0, 0.7):
        length = LAW.correlation_length(azimuth)
        r = np.linspace(0.0, length, 500)
        correlation = LAW(r * math.cos(azimuth), r * math.sin(azimuth)) / LAW(0.0)
        assert correlation[-1] == pytest.approx(1 / math.e, rel=1e-9)
        assert np.all(correlation[:-1] > 1 / math.e)


def test_distribution_against_quadrature():
    """P(z < h) by the arcsine law of one cosine averaged over the angles of three others.

    96^3 midpoints: the kinks where |h - rest| = a leave some 1e-5.
    """
    a = np.array([1.0, 0.8, 0.5, 0.4])
    series = height_series(a, 1)
    cosine = np.cos((np.arange(96) + 0.5) * math.pi / 96)
    rest = a[1] * cosine[:, None, None] + a[2] * cosine[None, :, None] + a[3] * cosine[None, None, :]
    for height in (-2.0, -0.7, 0.0, 0.4, 1.3):
        exact = np.mean(1.0 - np.arccos(np.clip(height - rest, -1.0, 1.0)) / math.pi)
        assert cdf(height, series) == pytest.approx(exact, abs=2e-5)
    assert (cdf(-3.0, series), cdf(3.0, series)) == (0.0, 1.0)


def test_planes_stand_at_quantiles():
    """Of heights whose distribution is found to 1e-12, and symmetric."""
    share = np.array([1e-8, 0.01, 0.5, 0.8, 1 - 1e-6])
    series, planes = height_series(LAW.amplitudes, LAW.azimuths), LAW.plane_height(100 * share)
    np.testing.assert_allclose([cdf(plane, series) for plane in planes], 1 - share, rtol=0, atol=3e-12)
    assert planes[2] == pytest.approx(0.0, abs=1e-11 * UM)


def test_the_error_of_the_series_is_bounded_by_the_waves_that_have_decayed():
    """2 / (pi n) times the product of sqrt(2 / (pi a s)) over n = 3 of four waves; J0 of the fourth is still 1."""
    a = np.array([1.0, 0.7, 0.5, 1e-8])
    with pytest.raises(ConvergenceError) as refused:
        height_series(a, 1)
    s = math.pi * 2**20 / a.sum()
    assert refused.value.residual == pytest.approx(2 / (3 * math.pi) * np.sqrt(2 / (math.pi * a[:3] * s)).prod())
