"""Weierstrass-Mandelbrot surfaces and the distribution of sums of cosines with random phases."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import gamma as gamma_function
from scipy.special import j0, jv, ndtr
from scipy.stats import kstest

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.surface.fractal import WeierstrassMandelbrot, fit_hurst, fractal_on, plane_waves, rms_height
from roughslip.surface.random_phases import RandomPhaseMarginal

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


def test_second_order_is_exact():
    """Covariance, structure function and variance of 4000 samples at 12 pairs of nodes: |t| below 4.5, 12 x 7e-6."""
    grid = Grid(8, 7, 5 * UM, 5 * UM)
    z = fields(LAW, grid, 4000, 3)
    pairs = [(0, 0), (1, 0), (0, 1), (1, 1), (3, 2), (7, 6)]
    for i, j in pairs:
        products, squares = z[:, 0, 0] * z[:, i, j], (z[:, 0, 0] - z[:, i, j]) ** 2
        x, y = i * grid.dx, j * grid.dy
        assert abs(products.mean() - LAW(x, y)) < 4.5 * products.std() / math.sqrt(4000)
        assert abs(squares.mean() - LAW.structure_function(x, y)) <= 4.5 * squares.std() / math.sqrt(4000)
    assert LAW(0.0) == pytest.approx((2 * UM) ** 2, rel=1e-13)
    lags = np.linspace(0.0, 80 * UM, 9)
    difference = 2 * (LAW(0.0) - LAW(lags, 0.3 * lags))
    np.testing.assert_allclose(LAW.structure_function(lags, 0.3 * lags), difference, atol=1e-13 * (2 * UM) ** 2)


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


@pytest.mark.parametrize("hurst", [0.4, 0.5, 0.7])
def test_roughness_parameter_fixes_the_structure_function(hurst):
    """For gamma -> 1 and a wide band S = G^(2 - 2H) (2 pi r)^(2H) int (1 - cos u) u^(-2H - 1) du, for any band.

    The band leaves out shares of about (r / L)^(2 - 2H) and (l / r)^(2H), 4e-3 at most; gamma its square in ln gamma.
    """
    integral = math.pi / 2 if hurst == 0.5 else gamma_function(1 - 2 * hurst) * math.cos(math.pi * hurst) / (2 * hurst)
    for decades in (4, 5):
        law = WeierstrassMandelbrot(hurst, 1.0, 10.0**decades, 10.0**-decades, gamma=1.05)
        structure = law.structure_function(1.0) * rms_height(1e-3, law) ** 2  # Sq = 1 replaced by that of G
        exact = 1e-3 ** (2 - 2 * hurst) * (2 * math.pi) ** (2 * hurst) * integral
        assert structure == pytest.approx(exact, rel=1.5e-2)
    assert rms_height(law.roughness_parameter_m, law) == pytest.approx(1.0, rel=1e-12)
    fan = replace(law, azimuths=8)
    assert fan.roughness_parameter_m == pytest.approx(law.roughness_parameter_m, rel=1e-12)


def test_kurtosis_in_closed_form():
    marginal = LAW.marginal()
    assert marginal.rms_height_m == pytest.approx(LAW.rms_height_m, rel=1e-13)
    a = np.repeat(LAW.amplitudes, 6)
    cumulant, variance = -0.375 * np.sum(a**4), 0.5 * np.sum(a**2)
    assert marginal.excess_kurtosis == pytest.approx(cumulant / variance**2, rel=1e-13)
    wide = WeierstrassMandelbrot(0.8, 1.0, 1.0, 1e-9, azimuths=4, gamma=1.3)
    assert wide.marginal().excess_kurtosis == pytest.approx(-1.5 * math.tanh(0.8 * math.log(1.3)) / 4, rel=1e-12)


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
    """E z^(2n) = 4n int_0^b z^(2n - 1) (1 - F) dz, by Gauss-Legendre, against the variance and the kurtosis."""
    marginal = LAW.marginal()
    node, weight = np.polynomial.legendre.leggauss(200)
    z = 0.5 * marginal.bound * (1 + node)
    tail = 0.5 * marginal.bound * weight * (1.0 - marginal.cdf(z))
    second, fourth = (4 * n * np.sum(tail * z ** (2 * n - 1)) for n in (1, 2))
    assert second == pytest.approx(marginal.rms_height_m**2, rel=1e-9)
    assert fourth / second**2 - 3 == pytest.approx(marginal.excess_kurtosis, abs=1e-8)


def test_samples_have_the_distribution():
    """KS at 1e-6 over 6000 independent samples, kurtosis and the share above a plane to 5 standard errors."""
    law = WeierstrassMandelbrot(0.9, UM, 300 * UM, 9 * UM, gamma=2.0)  # six waves of falling size: clearly not Gaussian
    marginal = law.marginal()
    z = fields(law, Grid(8, 1, 4 * UM, UM), 6000, 4)[:, 5, 0]
    assert kstest(z, marginal.cdf).statistic < math.sqrt(-0.5 * math.log(0.5e-6) / 6000)
    fourth = (z / UM) ** 4
    assert marginal.excess_kurtosis < -0.8
    assert fourth.mean() - 3 == pytest.approx(marginal.excess_kurtosis, abs=5 * fourth.std() / math.sqrt(6000))
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


def test_distance_from_gaussian_is_edgeworth_s():
    """Many waves: F - Phi = -excess / 24 (g^3 - 3 g) phi(g), at most 0.5506 |excess| / 24; the next order is 1 / M."""
    marginal = fractal_on(Grid(64, 64, UM, UM), 0.8, UM, 32).marginal()
    assert marginal.gaussian_distance() == pytest.approx(0.5506 * abs(marginal.excess_kurtosis) / 24, rel=0.02)


def test_three_waves_have_no_series():
    with pytest.raises(ConvergenceError, match="more frequencies or azimuths"):
        RandomPhaseMarginal(np.array([1.0, 0.7, 0.5])).cdf(0.1)


@pytest.mark.parametrize(("gamma", "nodes_per_wave"), [(1.5, 2.0), (2.0, 2.0), (1.3, 4.0)])
def test_frequencies_fit_patch_and_mesh(gamma, nodes_per_wave):
    """64 cells and gamma = 2: the wave of two cells would be at the Nyquist frequency itself and is left out."""
    grid = Grid(64, 32, UM, UM)
    law = fractal_on(grid, 0.6, UM, 4, gamma, nodes_per_wave)
    assert law.longest_wavelength_m == pytest.approx(64 * UM)
    shortest = 1 / law.frequencies[-1]
    assert shortest / gamma <= nodes_per_wave * UM * (1 + 1e-9) < shortest
    plane_waves(law, grid)
    with pytest.raises(ParameterError, match="alias"):
        plane_waves(law, Grid(16, 16, 0.51 * shortest, UM))


@pytest.mark.parametrize("hurst", [0.2, 0.5, 0.8])
def test_fractal_dimension_is_recovered(hurst):
    """Structure function of each of 20 surfaces of 256 x 256, both axes, lags up to 8 cells.

    One surface scatters by 0.005 (H = 0.2) to 0.017 (H = 0.8), measured on 40, so the mean of 20 by 0.004 at most:
    0.02 is five of these. The dimension of the surface is 3 - H.
    """
    grid = Grid(256, 256, UM, UM)
    law = fractal_on(grid, hurst, UM, 16)
    lags = np.array([1, 2, 3, 4, 6, 8])
    found = []
    for z in fields(law, grid, 20, 6):
        along = np.array([np.mean((z[n:] - z[:-n]) ** 2) for n in lags])
        across = np.array([np.mean((z[:, n:] - z[:, :-n]) ** 2) for n in lags])
        found.append(3.0 - fit_hurst(lags * UM, 0.0, 0.5 * (along + across), law).hurst)
    assert 0.002 < np.std(found) < 0.025
    assert np.mean(found) == pytest.approx(3.0 - hurst, abs=0.02)


def test_exact_structure_function_gives_the_law_back():
    law = fractal_on(Grid(128, 128, UM, UM), 0.35, 0.7 * UM, 5)
    band = fractal_on(Grid(128, 128, UM, UM), 0.9, 3 * UM, 5)
    x, y = np.array([1.0, 3.0, 7.0, 2.0]) * UM, np.array([0.0, 1.0, 0.0, 5.0]) * UM
    found = fit_hurst(x, y, law.structure_function(x, y), band)
    assert found.hurst == pytest.approx(0.35, abs=1e-5)
    assert found.rms_height_m == pytest.approx(0.7 * UM, rel=1e-4)
    with pytest.raises(IllPosedError, match="not self-affine"):
        fit_hurst(x, 0.0, x**3, band)
    with pytest.raises(ParameterError, match="positive"):
        fit_hurst(x, y, np.array([1.0, 2.0, 0.0, 1.0]), band)
    with pytest.raises(ParameterError, match="rows"):
        fit_hurst(x[:2], y[:2], x[:2], band)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"hurst": 1.0}, "Hurst"),
        ({"hurst": math.nan}, "Hurst"),
        ({"rms_height_m": 0.0}, "rms_height_m"),
        ({"longest_wavelength_m": math.inf}, "longest_wavelength_m"),
        ({"shortest_wavelength_m": 2.0}, "exceeds"),
        ({"gamma": 1.0}, "gamma"),
        ({"azimuths": 0}, "azimuths"),
        ({"gamma": 1.0001, "azimuths": 10}, "more than"),
    ],
)
def test_nonsense_is_refused(change, message):
    valid = {"hurst": 0.5, "rms_height_m": UM, "longest_wavelength_m": 1.0, "shortest_wavelength_m": 1e-6}
    with pytest.raises(ParameterError, match=message):
        WeierstrassMandelbrot(**(valid | change))


def test_meshes_samples_and_amplitudes_are_checked():
    with pytest.raises(ParameterError, match="no wave fits"):
        fractal_on(Grid(2, 2, UM, UM), 0.5, UM, 4)
    with pytest.raises(ParameterError, match="no wave fits"):
        fractal_on(Grid(1, 1, UM, UM), 0.5, UM, 4)
    with pytest.raises(ParameterError, match="two nodes"):
        fractal_on(Grid(64, 64, UM, UM), 0.5, UM, 4, nodes_per_wave=1.0)
    with pytest.raises(ParameterError, match="roughness parameter"):
        rms_height(-1.0, LAW)
    waves = plane_waves(LAW, Grid(8, 8, UM, UM))
    for xi in (np.zeros(3), np.full(LAW.variables, math.nan)):
        with pytest.raises(ParameterError, match="one a wave"):
            waves.heights(xi)
    for amplitudes in (np.array([1.0, 0.0]), np.array([]), np.array([math.inf])):
        with pytest.raises(ParameterError, match="amplitudes"):
            RandomPhaseMarginal(amplitudes)


def test_a_roughness_parameter_that_no_double_holds_is_refused():
    """G / L = (a_0 / L ...)^(1 / (1 - H)): with H = 0.999 the thousandth power."""
    for rms in (1e-12, 1e3):
        with pytest.raises(IllPosedError, match="use the rms height"):
            _ = replace(LAW, hurst=0.999, rms_height_m=rms).roughness_parameter_m
    law = replace(LAW, hurst=0.98)
    assert rms_height(law.roughness_parameter_m, law) == pytest.approx(law.rms_height_m, rel=1e-11)


def test_a_band_too_wide_for_a_search_is_refused():
    """Twenty octaves: 2^23 steps of an eighth of the shortest wave."""
    with pytest.raises(ParameterError, match="lengthen the shortest"):
        replace(LAW, shortest_wavelength_m=100 * UM / 2**20).correlation_length()


def test_half_an_azimuth_is_refused():
    with pytest.raises(ParameterError, match="whole number"):
        replace(LAW, azimuths=2.5)
