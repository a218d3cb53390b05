"""Local functionals, exact on polynomials inside and at the border; the variables made of them; their designs."""

import numpy as np
import pytest
from scipy.special import ndtr

from roughslip.chaos.variables import (
    MIRRORED,
    Stencil,
    latin_hypercube,
    local_functionals,
    orthonormal_directions,
    sobol_places,
    whitening,
)

STENCIL = Stencil(near=(1, 2), far=(3, 2))
_, SLOPE_X, SLOPE_Y, XX, YY, XY, NEAR, FAR = range(8)


def box_means(heights, half_x, half_y):
    means = np.empty(heights.shape)
    for i, j in np.ndindex(*heights.shape):
        means[i, j] = heights[max(i - half_x, 0) : i + half_x + 1, max(j - half_y, 0) : j + half_y + 1].mean()
    return means


def test_differences_are_those_of_numpy_and_curvatures_exact_for_quadratics_up_to_the_border():
    heights = np.random.default_rng(2).standard_normal((11, 9))
    functionals = local_functionals(heights, STENCIL)
    for name, exact in ((SLOPE_X, np.gradient(heights, axis=0)), (SLOPE_Y, np.gradient(heights, axis=1))):
        np.testing.assert_allclose(functionals[name], exact, atol=1e-15)
    np.testing.assert_allclose(functionals[XY], np.gradient(functionals[SLOPE_X], axis=1), atol=1e-15)
    x, y = np.meshgrid(np.arange(11.0), np.arange(9.0), indexing="ij")
    bent = local_functionals(0.5 * x**2 - 0.25 * y**2 + 0.125 * x * y, STENCIL)
    for name, exact in ((XX, 1.0), (YY, -0.5), (XY, 0.125)):
        np.testing.assert_allclose(bent[name], exact, rtol=1e-12)


@pytest.mark.parametrize("shape", [(11, 9), (1, 9), (11, 1), (1, 1), (4, 2)])
def test_boxes_are_cut_at_the_border(shape):
    heights = np.random.default_rng(1).standard_normal(shape)
    functionals = local_functionals(heights, STENCIL)
    np.testing.assert_allclose(functionals[NEAR], box_means(heights, *STENCIL.near), atol=1e-14)
    np.testing.assert_allclose(functionals[FAR], box_means(heights, *STENCIL.far), atol=1e-14)


def test_strips_too_narrow_for_a_difference_have_none():
    line = np.random.default_rng(5).standard_normal(12)
    wide = local_functionals(np.repeat(line[:, None], 5, axis=1), STENCIL)
    for heights in (line[:, None], np.repeat(line[:, None], 2, axis=1)):
        functionals = local_functionals(heights, STENCIL)
        assert not functionals[[SLOPE_Y, YY, XY]].any()
        np.testing.assert_allclose(functionals, wide[:, :, : heights.shape[1]], atol=1e-14)


@pytest.mark.parametrize("apart", [1.0, 1e-5])
def test_directions_are_orthonormal_and_keep_the_order_of_the_candidates(apart):
    """Also of nearly dependent candidates: one sweep of Gram-Schmidt would leave 1e-16 / 1e-5."""
    candidates = np.random.default_rng(6).standard_normal((4, 30)) * 1e-8  # metres
    candidates[1] = candidates[0] + apart * candidates[1]
    directions = orthonormal_directions(candidates)
    np.testing.assert_allclose(directions @ directions.T, np.eye(4), atol=1e-15 * 30)
    coordinates = candidates @ directions.T / 1e-8
    np.testing.assert_allclose(coordinates, np.tril(coordinates), atol=1e-15 * 30 / apart)
    assert np.all(np.diag(coordinates) > 0)


def correlated_samples():
    rng = np.random.default_rng(9)
    return rng.standard_normal((200, 4)) @ rng.standard_normal((4, 4)) * np.array([1e-7, 1e-9, 1e-8, 3.0])


@pytest.mark.parametrize("odd", [np.zeros((4, 0)), np.array([[0], [1], [0], [1]])])
def test_whitened_functionals_have_unit_covariance(odd):
    """With a symmetry that changes columns 1 and 3 as if each sample came with its image: mixed moments cancel."""
    samples = correlated_samples()
    whiten = whitening(samples, odd)
    both = np.concatenate([samples, *(samples * sign for sign in (-1.0) ** odd.T)])
    xi = both @ whiten.T
    np.testing.assert_allclose(xi.T @ xi / len(xi), np.eye(4), atol=1e-12)  # 200 eps times the condition, below 100
    assert np.array_equal(whiten, np.tril(whiten))
    np.testing.assert_array_equal(whiten[np.any(odd[:, None] != odd, axis=2)], 0.0)


@pytest.mark.parametrize(("axis", "symmetry"), [(0, 0), (1, 1)])
def test_functionals_of_mirrored_surfaces_have_the_stated_signs(axis, symmetry):
    heights = np.random.default_rng(12).standard_normal((9, 8))
    stencil = Stencil((1, 1), (2, 3))
    mirrored = np.flip(local_functionals(np.flip(heights, axis), stencil), 1 + axis)
    signs = (-1.0) ** MIRRORED[:, symmetry]
    np.testing.assert_allclose(mirrored, local_functionals(heights, stencil) * signs[:, None, None], rtol=0, atol=1e-14)


@pytest.mark.parametrize("samples", [1, 2, 1024])
def test_each_stratum_of_each_variable_holds_one_sample(samples):
    """Shorter Sobol sequences are the beginning of longer ones."""
    generator = np.random.default_rng(1)
    for places in (ndtr(latin_hypercube(generator, samples, 101)), sobol_places(generator, samples, 16)):
        strata = np.floor(samples * places).astype(int)
        np.testing.assert_array_equal(np.sort(strata, axis=0), np.tile(np.arange(samples)[:, None], places.shape[1]))
    first, longer = (sobol_places(np.random.default_rng(7), count, 2) for count in (samples, 2048))
    np.testing.assert_array_equal(first, longer[:samples])
