"""Covariance models, those of measured tables, and the recipe that adds one."""

import itertools
import math

import numpy as np
import pytest
import scipy.fft
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import j0

from roughslip.errors import ParameterError
from roughslip.grid import Grid
from roughslip.surface.covariance import Covariance, plane_height
from roughslip.surface.embedding import embed
from roughslip.surface.measured_covariance import measured_covariance
from roughslip.surface.models import MODELS, covariance_of, self_affine
from roughslip.surface.modes import karhunen_loeve
from roughslip.surface.plausibility import rms_slope

MONOTONE = [kind for kind, model in MODELS.items() if kind != "self_affine"]


def model_of(kind, *arguments, **others):
    """With a shape in the middle of its range, on a logarithm, where the test gives none."""
    shapes = {name: min(math.sqrt(low * min(high, 100.0)), 12.0) for name, (low, high) in MODELS[kind].shapes.items()}
    return covariance_of(kind, *arguments, **(shapes | others))


@pytest.mark.parametrize("kind", MODELS)
def test_one_correlation_length_leaves_one_over_e(kind):
    """Rounding: the scale of a shape comes from a root to 1e-15, its slope there is of order one."""
    for lay in (0.0, 0.7, np.pi / 2, -2.2):
        covariance = model_of(kind, 2.0, 3.0, 0.5, lay_rad=lay)
        np.testing.assert_allclose(covariance(3.0 * np.cos(lay), 3.0 * np.sin(lay)), 4.0 / np.e, rtol=1e-12)
        np.testing.assert_allclose(covariance(-0.5 * np.sin(lay), 0.5 * np.cos(lay)), 4.0 / np.e, rtol=1e-12)
        np.testing.assert_allclose(covariance(np.zeros(1), 0.0), 4.0, rtol=1e-13)
        x, y = covariance.axis_lengths_m
        np.testing.assert_allclose([covariance(np.array(x)), covariance(np.array(0.0), y)], 4.0 / np.e, rtol=1e-9)
    r = np.array([0.5, 2.0])
    np.testing.assert_allclose(covariance.profile(covariance.scale * r), covariance.correlation(r, 0.0), rtol=1e-14)


@pytest.mark.parametrize(
    ("kind", "shapes"),
    [
        ("gaussian", {}),
        ("matern", {"smoothness": 3.5}),
        ("self_affine", {"hurst": 0.3, "bandwidth": 12.0}),
        ("self_affine", {"hurst": 1.0, "bandwidth": 12.0}),
    ],
)
def test_rms_slope_and_curvature_are_moments_of_the_spectrum(kind, shapes):
    """h'^2 = int q^2 S dq / (2 pi)^2, and the curvature likewise of q^4 / 4, here of an anisotropic surface; and the
    limits of short steps."""
    covariance = covariance_of(kind, 2.0, 3.0, 0.5, lay_rad=0.4, **shapes)
    end = shapes.get("bandwidth", np.inf)

    def density(k, power):
        return k ** (1 + power) * float(covariance.transform(np.array(k))) / (2 * np.pi)

    slope, curvature = (
        sum(quad(density, *part, (power,), epsrel=1e-10, limit=200)[0] for part in ((0.0, 1.0), (1.0, end)))
        for power in (2, 4)
    )
    scale = covariance.scale / np.array(covariance.lengths_m)
    assert rms_slope(covariance) == pytest.approx(2.0 * np.sqrt(slope / 2 * np.sum(scale**2)), rel=1e-8)
    directions = 3 / 8 * np.sum(scale**4) + 2 / 8 * np.prod(scale**2)  # means of cos^4, and of 2 cos^2 sin^2
    assert covariance.rms_curvature == pytest.approx(2.0 * np.sqrt(curvature * directions / 4), rel=1e-8)
    assert rms_slope(covariance, 1e-5) == pytest.approx(rms_slope(covariance), rel=1e-4)


def test_rms_slope_is_infinite_where_heights_have_none():
    """Matern at nu = 1 still grows with the logarithm of the step; a model without a curvature of its own is tried at
    two steps, the Gaussian of a user within 1e-6."""
    for kind, shapes in (("exponential", {}), ("matern", {"smoothness": 1.0})):
        assert rms_slope(covariance_of(kind, 2.0, 3.0, **shapes)) == np.inf
        assert covariance_of(kind, 2.0, 3.0, **shapes).rms_curvature == np.inf
    rough = covariance_of("matern", 2.0, 3.0, smoothness=2.0)
    assert rms_slope(rough) < rough.rms_curvature == np.inf
    for kind, curvature in (("gaussian", 2.0), ("exponential", np.inf)):
        tried = Covariance.curvature.fget(MODELS[kind](1.0, 1.0))
        assert tried == pytest.approx(curvature, rel=1e-6)
        tried = Covariance.fourth_derivative.fget(MODELS[kind](1.0, 1.0))
        assert tried == pytest.approx(6.0 * curvature, rel=1e-4)


def test_matern_holds_its_closed_cases():
    r = np.linspace(0.0, 6.0, 61)
    np.testing.assert_allclose(covariance_of("matern", 1.0, 1.0, smoothness=0.5)(r), np.exp(-r), rtol=1e-13)
    u = 2.146193220620582 * r  # the root of (1 + u) exp(-u) = 1/e
    np.testing.assert_allclose(
        covariance_of("matern", 1.0, 1.0, smoothness=1.5)(r), (1 + u) * np.exp(-u), rtol=1e-12, atol=1e-15
    )
    # towards the Gaussian the difference is of order 1/nu; at nu = 20 it is below 0.01, as the module says
    difference = np.abs(covariance_of("matern", 1.0, 1.0, smoothness=20.0)(r) - np.exp(-(r**2)))
    assert 1e-3 < difference.max() < 1e-2


@pytest.mark.parametrize("hurst", [0.05, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("bandwidth", [2.0, 60.0])
def test_self_affine_is_the_transform_of_its_spectrum(hurst, bandwidth):
    """C(r) = 1/(2 pi) int q S(q) J0(q r) dq by Gauss-Legendre on panels of at most 60 rad with 64 nodes: rounding is
    left. The lags reach all three branches of the integral: series, Chebyshev interpolation, asymptotics."""
    rolloff = 2 * np.pi  # so that q_r = 1
    covariance = self_affine(1.5, hurst, rolloff, rolloff / bandwidth)
    nodes, weights = np.polynomial.legendre.leggauss(64)
    edges = np.unique(np.concatenate(([0.0, 1.0], np.geomspace(1.0, bandwidth, 150))))
    q = (edges[:-1, None] + np.diff(edges)[:, None] * (nodes + 1) / 2).ravel()
    w = (np.diff(edges)[:, None] / 2 * weights).ravel()
    r = np.array([0.0, 1e-5, 0.3, 2.0, 3.99, 4.01, 10.0, 39.9, 40.1, 60.0])
    density = covariance.spectrum(np.minimum(q, bandwidth * (1 - 1e-14)))
    direct = np.sum(w * q * density * j0(q * r[:, None]), axis=1) / (2 * np.pi)
    np.testing.assert_allclose(covariance(r), direct, atol=1e-12 * 1.5**2)
    assert covariance.rolloff_wavelengths_m == pytest.approx((rolloff, rolloff), rel=1e-13)
    assert covariance.cutoff_wavelengths_m == pytest.approx((rolloff / bandwidth,) * 2, rel=1e-13)


@pytest.mark.parametrize("kind", ["gaussian", "exponential", "matern"])
def test_isotropic_spectra_are_hankel_transforms(kind):
    """S(q) = 2 pi int r C(r) J0(q r) dr; the quadrature is asked for 1e-10 and the tail beyond 40 lengths is e^-40."""
    covariance = model_of(kind, 2.0, 1.5)
    for q in (0.0, 0.7, 3.0):
        transform, error = quad(lambda r, q=q: r * float(covariance(r)) * j0(q * r), 0, 60, epsabs=1e-10, limit=400)
        assert error < 1e-7
        assert covariance.spectrum(q) == pytest.approx(2 * np.pi * transform, abs=1e-7)


@pytest.mark.parametrize("kind", MODELS)
def test_separable_and_mirror_symmetric_are_what_the_values_say(kind):
    x = np.linspace(-3.0, 3.0, 7)
    for across, lay in itertools.product((None, 0.5), (0.0, 0.4, np.pi / 2, -np.pi)):
        covariance = model_of(kind, 1.0, 2.0, across, lay_rad=lay)
        lags = covariance(x[:, None], x[None, :])
        second = np.linalg.svd(lags)[1][1]  # a product of two functions has rank one
        assert covariance.separable == (second < 1e-12), (across, lay)
        assert covariance.mirror_symmetric == bool(np.abs(lags - lags[::-1]).max() < 1e-12), (across, lay)
        np.testing.assert_allclose(lags, lags[::-1, ::-1], atol=1e-15)


@pytest.mark.parametrize("kind", MONOTONE)
def test_beyond_the_reach_nothing_is_left(kind):
    covariance = model_of(kind, 1.0, 3.0, 0.4, lay_rad=0.6)
    reach_x, reach_y = covariance.reach_m
    along = np.linspace(-1.5, 1.5, 3001)
    for edge in (covariance(np.array(reach_x), along * reach_y), covariance(along * reach_x, reach_y)):
        assert 2.3e-16 < edge.max() < 1.1e-15  # exp(-36) or 1e-15: the box is no larger than it need be


def test_plane_stands_where_the_share_of_heights_lies_above():
    assert plane_height(50.0, 1e-6) == 0.0
    np.testing.assert_allclose(plane_height(15.865525393145708, 2.0), 2.0, rtol=1e-14)  # one sigma
    assert np.all(np.diff(plane_height(np.array([5.0, 50.0, 95.0]), 1.0)) < 0)  # deeper is lower


def table(covariance, kx=24, ky=18, step_x=0.5, step_y=0.4):
    x, y = np.arange(-kx, kx + 1) * step_x, np.arange(-ky, ky + 1) * step_y
    return covariance(x[:, None], y[None, :]) / covariance.rms_height_m**2


def noisy(seed, size=0.02):
    """A table with errors at all lags, equal at opposite ones and none in the middle: far from any covariance."""
    given_table = table(covariance_of("exponential", 1.0, 1.5, 1.0, lay_rad=0.5))
    errors = size * np.random.default_rng(seed).standard_normal(given_table.shape)
    errors = (errors + errors[::-1, ::-1]) / 2
    errors[24, 18] = 0.0
    return given_table + errors


def test_between_lags_splines_follow_a_smooth_covariance():
    """Cubic splines: 0.0026 h^4 times the fourth derivative, 12/l^4 for the Gaussian, once an axis."""
    covariance = covariance_of("gaussian", 1.0, 2.0)
    measured = measured_covariance(table(covariance), 0.5, 0.4, 1.0)
    x = np.linspace(-5.0, 5.0, 37)
    bound = 0.0027 * 12 / 2.0**4 * (0.5**4 + 0.4**4)
    difference = np.abs(measured(x[:, None], x[None, :]) - covariance(x[:, None], x[None, :])).max()
    assert 0.2 * bound < difference < bound
    assert measured.rms_slope == pytest.approx(covariance.rms_slope, rel=0.03)  # h^2 / 12 of the fourth derivative
    step = 1e-4
    around = measured(step * np.array([0.0, 1.0, 0.0]), step * np.array([0.0, 0.0, 1.0]))
    exact = np.sqrt((4 * around[0] - 2 * around[1] - 2 * around[2]) / step**2)
    assert measured.rms_slope == pytest.approx(exact, rel=1e-5)
    for name, sizes in (("lag along x", (0.0, 1.0, 1.0)), ("lag along y", (1.0, 0.0, 1.0)), ("rms", (1.0, 1.0, 0.0))):
        with pytest.raises(ParameterError, match=name):
            measured_covariance(table(covariance), *sizes)


@settings(max_examples=10, derandomize=True, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), size=st.floats(0.0, 0.03))
def test_what_noise_spoilt_is_positive_at_every_wave_vector(seed, size):
    """Also between the wave vectors of the torus that the method used: the spectrum is a square."""
    measured = measured_covariance(noisy(seed, size), 0.5, 0.4, 1.0)
    padded = np.zeros((211, 160))
    padded[:97, :73] = measured.correlation
    spectrum = scipy.fft.fft2(np.roll(padded, (-48, -36), axis=(0, 1))).real
    assert spectrum.min() > -1e-13 * spectrum.max()
    given_table = noisy(seed, size)
    assert measured.largest_change == np.abs(measured.correlation[24:73, 18:55] - given_table).max()
    assert measured.correlation[48, 36] == 1.0
    assert measured.reach_m == ((48 + 26) * 0.5, (36 + 26) * 0.4)
    assert float(measured(np.array(measured.reach_m[0]))) == pytest.approx(0.0, abs=1e-13)


def test_the_covariance_of_scattered_points_is_positive():
    """The continuation between lags is a covariance too: any points, not those of a mesh."""
    measured = measured_covariance(noisy(3), 0.5, 0.4, 1.0)
    x, y = np.random.default_rng(5).uniform(0.0, 6.0, (2, 200))
    matrix = measured(x[:, None] - x[None, :], y[:, None] - y[None, :])
    assert np.linalg.eigvalsh(matrix).min() > -1e-12
    assert measured.largest_change > 0.01  # the noise was worth the test
    # a table that ends while correlations are large: the continuation must die out beyond its end
    short = measured_covariance(table(covariance_of("exponential", 1.0, 2.0), 3, 3, 1.0, 1.0), 1.0, 1.0, 1.0)
    assert abs(short.correlation[0, 6]) > 1e-3
    assert np.abs(short(np.linspace(0.95, 1.0, 50) * short.reach_m[0])).max() < 1e-13


OWN_MODEL = """
import numpy as np
from roughslip.surface import Covariance

class Autoregressive(Covariance):
    def profile(self, u):
        return (1 + u) * np.exp(-u)
"""


def test_a_model_in_a_file_of_ones_own_is_sampled_and_expanded_as_one_of_the_project(tmp_path):
    """The correlation of Matern's model with a smoothness of 3/2, whose scale and reach the base finds."""
    path = tmp_path / "my_models.py"
    path.write_text(OWN_MODEL)
    own, matern = (
        covariance_of(f"{path}:Autoregressive", 2.0, 3.0, 1.5),
        model_of("matern", 2.0, 3.0, 1.5, smoothness=1.5),
    )
    grid = Grid(20, 12, 1.0, 1.0)
    x = np.linspace(-9.0, 9.0, 7)
    np.testing.assert_allclose(own(x[:, None], x), matern(x[:, None], x), rtol=1e-9)
    fields = [embed(one, grid).sample(np.random.default_rng(1)) for one in (own, matern)]
    np.testing.assert_allclose(*fields, atol=1e-8)
    np.testing.assert_allclose(*(karhunen_loeve(one, grid, 5).eigenvalues for one in (own, matern)), rtol=1e-9)
    assert own.kind == f"{path}:Autoregressive"
