"""Weierstrass-Mandelbrot surfaces and the distribution of sums of cosines with random phases."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import j0, jv, ndtr
from scipy.stats import kstest

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.surface.fractal import RandomPhaseMarginal, WeierstrassMandelbrot, fractal_on, plane_waves

UM = 1e-6
LAW = WeierstrassMandelbrot(0.7, 2 * UM, 100 * UM, 12 * UM, azimuths=6)


def fields(law, grid, samples, seed):
    waves = plane_waves(law, grid)
    draws = (np.random.default_rng([seed, i]).standard_normal(law.variables) for i in range(samples))
    return np.array([waves.heights(xi) for xi in draws])


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
    np.testing.assert_allclose(plane_waves(LAW, grid).heights(xi), plain, atol=1e-14 * LAW.variables * UM)


def test_profile_is_the_paper_s_sum():
    """One azimuth: amplitudes gamma^((D - 2) j) with D = 2 - H, no change along y."""
    law = WeierstrassMandelbrot(0.6, UM, 100 * UM, 7 * UM, gamma=1.4)
    fractal_dimension = 1.4
    j = np.arange(law.variables)
    np.testing.assert_allclose(law.amplitudes / law.amplitudes[0], 1.4 ** ((fractal_dimension - 2) * j), rtol=1e-13)
    np.testing.assert_allclose(law.frequencies, 1.4**j / (100 * UM), rtol=1e-13)
    assert law.frequencies[-1] <= 1 / (7 * UM) < 1.4 * law.frequencies[-1]
    field = fields(law, Grid(30, 4, 3 * UM, 3 * UM), 1, 2)[0]
    assert np.ptp(field, axis=1).max() == 0.0


def test_the_covariance_is_that_of_the_waves():
    """Products of 4000 samples at 6 pairs of nodes: |t| below 4.5, which 6 x 7e-6 exceed."""
    grid = Grid(8, 7, 5 * UM, 5 * UM)
    z = fields(LAW, grid, 4000, 3)
    for i, j in [(0, 0), (1, 0), (0, 1), (1, 1), (3, 2), (7, 6)]:
        products = z[:, 0, 0] * z[:, i, j]
        assert abs(products.mean() - LAW(i * grid.dx, j * grid.dy)) < 4.5 * products.std() / math.sqrt(4000)
    assert LAW(0.0) == pytest.approx((2 * UM) ** 2, rel=1e-13)


@pytest.mark.parametrize("hurst", [0.4, 0.5, 0.7])
def test_the_structure_function_grows_by_the_hurst_exponent(hurst):
    """S(r) = 2 (C(0) - C(r)) ~ r^(2H) for gamma near 1, so that the fractal dimension is 3 - H.

    The band leaves out shares of about (r / L)^(2 - 2H) and (l / r)^(2H), 4e-3 at most; gamma its square in ln gamma.
    """
    law = WeierstrassMandelbrot(hurst, 1.0, 1e4, 1e-4, azimuths=4, gamma=1.05)
    once, twice = (law(0.0) - law(r, r) for r in (0.5, 1.0))
    assert twice / once == pytest.approx(2 ** (2 * hurst), rel=1.5e-2)


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
    with pytest.raises(IllPosedError, match="another azimuth"):
        wave.correlation_length(math.pi / 2)


def test_distribution_against_quadrature():
    """P(z < h) by the arcsine law of one cosine averaged over the angles of three others.

    96^3 midpoints: the kinks where |h - rest| = a leave some 1e-5.
    """
    a = np.array([1.0, 0.8, 0.5, 0.4])
    marginal = RandomPhaseMarginal(a)
    cosine = np.cos((np.arange(96) + 0.5) * math.pi / 96)
    rest = a[1] * cosine[:, None, None] + a[2] * cosine[None, :, None] + a[3] * cosine[None, None, :]
    for height in (-2.0, -0.7, 0.0, 0.4, 1.3):
        exact = np.mean(1.0 - np.arccos(np.clip(height - rest, -1.0, 1.0)) / math.pi)
        assert marginal.cdf(height) == pytest.approx(exact, abs=2e-5)
    np.testing.assert_array_equal(marginal.cdf(np.array([-3.0, 3.0])), [0.0, 1.0])


def test_distribution_has_the_moments():
    """E z^(2n) = 4n int_0^b z^(2n - 1) (1 - F) dz, by Gauss-Legendre; the fourth cumulant of a cosine is -3/8 a^4."""
    marginal = LAW.marginal()
    node, weight = np.polynomial.legendre.leggauss(200)
    z = 0.5 * marginal.bound * (1 + node)
    tail = 0.5 * marginal.bound * weight * (1.0 - marginal.cdf(z))
    second, fourth = (4 * n * np.sum(tail * z ** (2 * n - 1)) for n in (1, 2))
    cumulant = -0.375 * 6 * np.sum(LAW.amplitudes**4)
    assert second == pytest.approx(LAW.rms_height_m**2, rel=1e-9)
    assert fourth / second**2 - 3 == pytest.approx(cumulant / second**2, abs=1e-8)


def test_samples_have_the_distribution():
    """KS at 1e-6 over 6000 independent samples, and the share above a plane to 5 standard errors."""
    law = WeierstrassMandelbrot(0.9, UM, 300 * UM, 9 * UM, gamma=2.0)  # six waves of falling size: clearly not Gaussian
    marginal = law.marginal()
    z = fields(law, Grid(8, 1, 4 * UM, UM), 6000, 4)[:, 5, 0]
    heights = np.linspace(-marginal.bound, marginal.bound, 2001)  # chords leave 2e-7
    distance = kstest(z, lambda z: np.interp(z, heights, marginal.cdf(heights))).statistic
    assert distance < math.sqrt(-0.5 * math.log(0.5e-6) / 6000)
    plane = marginal.quantile(1 - 20 / 100)
    assert np.mean(z > plane) == pytest.approx(0.2, abs=5 * math.sqrt(0.16 / 6000))


def test_quantile_inverts():
    marginal = LAW.marginal()
    p = np.array([1e-8, 0.01, 0.5, 0.8, 1 - 1e-6])
    np.testing.assert_allclose(marginal.cdf(marginal.quantile(p)), p, rtol=0, atol=3e-12)
    assert marginal.quantile(0.5) == pytest.approx(0.0, abs=1e-11 * UM)
    assert marginal.quantile(0.99) == pytest.approx(-marginal.quantile(0.01), rel=1e-8)
    for wrong in (0.0, 1.0, 1e-10, math.nan):
        with pytest.raises(ParameterError):
            marginal.quantile(wrong)


@pytest.mark.parametrize("gamma", [1.3, 1.5, 2.0])
def test_frequencies_fit_patch_and_mesh(gamma):
    """64 cells and gamma = 2: the wave of two cells would be at the Nyquist frequency itself and is left out."""
    law = fractal_on(Grid(64, 32, UM, UM), 0.6, UM, 4, gamma)
    assert law.longest_wavelength_m == pytest.approx(64 * UM)
    shortest = 1 / law.frequencies[-1]
    assert shortest / gamma <= 2 * UM * (1 + 1e-9) < shortest
    with pytest.raises(ParameterError, match="alias"):
        plane_waves(law, Grid(16, 16, 0.51 * shortest, UM))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"hurst": 1.0}, "Hurst"),
        ({"shortest_wavelength_m": 2.0}, "exceeds"),
        ({"gamma": 1.0001, "azimuths": 10}, "more than"),
        ({"azimuths": 2.5}, "whole number"),
    ],
)
def test_laws_out_of_range_are_refused(change, message):
    with pytest.raises(ParameterError, match=message):
        replace(LAW, **change)


def test_the_error_of_the_series_is_bounded_by_the_waves_that_have_decayed():
    """2 / (pi n) times the product of sqrt(2 / (pi a s)) over n = 3 of four waves; J0 of the fourth is still 1."""
    a = np.array([1.0, 0.7, 0.5, 1e-8])
    with pytest.raises(ConvergenceError) as refused:
        RandomPhaseMarginal(a).cdf(0.1)
    s = math.pi * 2**20 / a.sum()
    assert refused.value.residual == pytest.approx(2 / (3 * math.pi) * np.sqrt(2 / (math.pi * a[:3] * s)).prod())


def test_too_few_waves_and_too_wide_bands_are_refused():
    for grid in (Grid(2, 2, UM, UM), Grid(1, 1, UM, UM)):
        with pytest.raises(ParameterError, match="no wave fits"):
            fractal_on(grid, 0.5, UM, 4)
    with pytest.raises(ConvergenceError, match="more frequencies or azimuths"):
        RandomPhaseMarginal(np.array([1.0, 0.7, 0.5])).cdf(0.1)
    with pytest.raises(ParameterError, match="lengthen the shortest"):  # 2^23 steps of an eighth of the shortest wave
        replace(LAW, shortest_wavelength_m=100 * UM / 2**20).correlation_length()
