"""Local functionals: exact on polynomials inside and at the border, and the variables made of them."""

import numpy as np
import pytest

from roughslip.chaos.functionals import (
    MIRRORED,
    NAMES,
    Stencil,
    local_functionals,
    orthonormal_directions,
    whitening,
)
from roughslip.errors import IllPosedError

STENCIL = Stencil(near=(1, 2), far=(3, 2))
_, SLOPE_X, SLOPE_Y, XX, YY, XY, NEAR, FAR = range(8)


def nodes(nx=11, ny=9):
    return np.meshgrid(np.arange(nx, dtype=float), np.arange(ny, dtype=float), indexing="ij")


def box_means(heights, half_x, half_y):
    nx, ny = heights.shape
    return np.array(
        [
            [
                np.mean(heights[max(i - half_x, 0) : i + half_x + 1, max(j - half_y, 0) : j + half_y + 1])
                for j in range(ny)
            ]
            for i in range(nx)
        ]
    )


def test_quadratics_inside_the_mesh():
    """Central differences are exact, and the mean of x^2 over 2h + 1 nodes exceeds x^2 by h (h + 1) / 3."""
    x, y = nodes()
    heights = 3 + 2 * x - y + 0.5 * x**2 - 0.25 * y**2 + 0.125 * x * y
    found = local_functionals(heights, STENCIL)
    inside = (slice(3, -3), slice(2, -2))
    excess = [0.5 * hx * (hx + 1) / 3 - 0.25 * hy * (hy + 1) / 3 for hx, hy in (STENCIL.near, STENCIL.far)]
    slope_x, slope_y = 2 + x + 0.125 * y, -1 - 0.5 * y + 0.125 * x
    exact = [
        heights,
        slope_x,
        slope_y,
        1 + 0 * x,
        -0.5 + 0 * x,
        0.125 + 0 * x,
        heights + excess[0],
        heights + excess[1],
    ]
    for name, ours, expected in zip(NAMES, found, exact, strict=True):
        np.testing.assert_allclose(ours[inside], expected[inside], atol=1e-12, err_msg=name)  # heights up to 80


def test_border():
    """Slopes are one-sided: exact for planes. Curvatures are exact for quadratics; the mixed one for x y."""
    x, y = nodes()
    plane = local_functionals(3 + 2 * x - y, STENCIL)
    np.testing.assert_allclose(plane[SLOPE_X], 2.0, rtol=1e-14)
    np.testing.assert_allclose(plane[SLOPE_Y], -1.0, rtol=1e-14)
    bent = local_functionals(0.5 * x**2 - 0.25 * y**2 + 0.125 * x * y, STENCIL)
    np.testing.assert_allclose(bent[XX], 1.0, rtol=1e-12)
    np.testing.assert_allclose(bent[YY], -0.5, rtol=1e-12)
    np.testing.assert_allclose(bent[XY], 0.125, rtol=1e-12)


@pytest.mark.parametrize("shape", [(11, 9), (1, 9), (11, 1), (1, 1), (4, 2)])
def test_boxes_are_cut_at_the_border(shape):
    heights = np.random.default_rng(1).standard_normal(shape)
    found = local_functionals(heights, STENCIL)
    np.testing.assert_allclose(found[NEAR], box_means(heights, *STENCIL.near), atol=1e-14)
    np.testing.assert_allclose(found[FAR], box_means(heights, *STENCIL.far), atol=1e-14)


def test_strips_too_narrow_for_a_difference_have_none():
    line = np.random.default_rng(5).standard_normal(12)
    wide = local_functionals(np.repeat(line[:, None], 5, axis=1), STENCIL)
    for heights in (line[:, None], np.repeat(line[:, None], 2, axis=1)):
        found = local_functionals(heights, STENCIL)
        assert not found[[SLOPE_Y, YY, XY]].any()
        np.testing.assert_allclose(found, wide[:, :, : heights.shape[1]], atol=1e-14)
    along = local_functionals(line[None, :], STENCIL)
    assert not along[[SLOPE_X, XX, XY]].any()
    np.testing.assert_array_equal(along[SLOPE_Y, 0], np.gradient(line))


@pytest.mark.parametrize("apart", [1.0, 1e-5])
def test_directions_are_orthonormal_and_keep_the_order_of_the_candidates(apart):
    """Also of nearly dependent candidates: one sweep of Gram-Schmidt would leave 1e-16 / 1e-5."""
    candidates = np.random.default_rng(6).standard_normal((5, 30)) * 1e-8  # metres
    candidates[1] = candidates[0] + apart * candidates[4]
    directions = orthonormal_directions(candidates, 4)
    np.testing.assert_allclose(directions @ directions.T, np.eye(4), atol=1e-15 * 30)
    coordinates = candidates[:4] @ directions.T / 1e-8
    np.testing.assert_allclose(coordinates, np.tril(coordinates), atol=1e-15 * 30 / apart)
    assert np.all(np.diag(coordinates) > 0)


def test_dependent_candidates_are_passed_over():
    first, second, third = np.random.default_rng(8).standard_normal((3, 10))
    candidates = np.array([0 * first, first, -3 * first, second, first + second, third])
    expected = orthonormal_directions(np.array([first, second, third]), 3)
    np.testing.assert_allclose(orthonormal_directions(candidates, 3), expected, atol=1e-14)
    with pytest.raises(IllPosedError, match="only 3 of the 4"):
        orthonormal_directions(candidates, 4)


def correlated_samples():
    rng = np.random.default_rng(9)
    return rng.standard_normal((200, 4)) @ rng.standard_normal((4, 4)) * np.array([1e-7, 1e-9, 1e-8, 3.0])


def test_whitened_functionals_have_unit_covariance():
    samples = correlated_samples()
    whiten = whitening(samples, np.zeros((samples.shape[1], 0)))
    xi = samples @ whiten.T
    np.testing.assert_allclose(xi.T @ xi / len(xi), np.eye(4), atol=1e-12)  # 200 eps times the condition, below 100
    assert np.array_equal(whiten, np.tril(whiten))
    assert whiten[0, 0] == pytest.approx(1 / np.sqrt(np.mean(samples[:, 0] ** 2)), rel=1e-14)


def repeat_a_column(samples, difference):
    samples[:, 2] = 7 * samples[:, 1] * (1 + difference * np.arange(len(samples)))
    return samples


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: s * [1, 1, 0, 1], "slope y vanishes on all 200 samples"),
        (lambda s: repeat_a_column(s, 0.0), "depend on each other"),
        (lambda s: repeat_a_column(s, 1e-10), "depend on each other"),
        (lambda s: s[:3], "depend on each other"),
    ],
)
def test_dependent_functionals_cannot_be_whitened(change, message):
    with pytest.raises(IllPosedError, match=message):
        whitening(change(correlated_samples()), np.zeros((4, 0)))


def test_what_a_symmetry_keeps_apart_is_not_mixed_by_whitening():
    """Columns 1 and 3 change sign: as if every sample were there with its image, whose mixed moments cancel."""
    samples, odd = correlated_samples(), np.array([[0], [1], [0], [1]])
    whiten = whitening(samples, odd)
    both = np.concatenate([samples, samples * (-1.0) ** odd.T])
    xi = both @ whiten.T
    np.testing.assert_allclose(xi.T @ xi / len(xi), np.eye(4), atol=1e-12)
    np.testing.assert_array_equal(whiten[odd != odd.T], 0.0)


@pytest.mark.parametrize(("axis", "symmetry"), [(0, 0), (1, 1)])
def test_functionals_of_mirrored_surfaces_have_the_stated_signs(axis, symmetry):
    heights = np.random.default_rng(12).standard_normal((9, 8))
    stencil = Stencil((1, 1), (2, 3))
    found = np.flip(local_functionals(np.flip(heights, axis), stencil), 1 + axis)
    signs = (-1.0) ** MIRRORED[:, symmetry]
    np.testing.assert_allclose(found, local_functionals(heights, stencil) * signs[:, None, None], rtol=0, atol=1e-14)
