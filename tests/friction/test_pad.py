"""Friction of pads of many windows: variances in closed form, with and without long waves."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import erf

from roughslip.errors import IllPosedError
from roughslip.friction.pad import (
    POWERS,
    WINDOWS,
    Blocks,
    Surface,
    adjacent_variance,
    between_pads,
    influence_covariance,
    mean_powers,
    mehler_parts,
    pad_edges,
    pad_means,
    pad_scatter,
    pads,
)
from roughslip.friction.windows import strip_weights

SHORT, LONG, SHARE = 10e-6, 400e-6, 0.02  # lengths [m] of two Gaussian correlations, and the variance of the long one
BLOCK, WIDTH, WINDOW = 15e-6, 25e-6, 120e-6
BLOCKS, STRIPS, FINE = 96, 300, 3


def gaussian(x, y, length):
    return np.exp(-(x**2 + y**2) / length**2)


def both(x, y):
    return (1.0 - SHARE) * gaussian(x, y, SHORT) + SHARE * gaussian(x, y, LONG)


def blocks_of(area, force):
    """Of strips, (S, X) each."""
    return Blocks(area[..., None], force[..., None], BLOCK, WIDTH, WINDOW, periodic=False)


def of_edge(edge, length):
    """Mean of exp(-d^2 / l^2) over pairs of points of an interval of t = edge / l."""
    t = edge / length
    return (math.sqrt(math.pi) * t * erf(t) + math.expm1(-(t**2))) / t**2


def of_rectangle(length, width, share=SHARE):
    """Variance of the mean height of a rectangle."""
    parts = ((1.0 - share, SHORT), (share, LONG))
    return sum(one * of_edge(length, scale) * of_edge(width, scale) for one, scale in parts)


def test_means_over_pairs_of_points_in_closed_form():
    """Powers of a Gaussian are Gaussians of l / sqrt(m); two intervals of which one follows the other share theirs."""
    surface = Surface(lambda x, y: gaussian(x, y, SHORT), (SHORT, SHORT))
    for length, width in ((BLOCK, WIDTH), (6e-4, 25e-6), (3e-2, 5e-3)):
        exact = [of_edge(length, SHORT / m**0.5) * of_edge(width, SHORT / m**0.5) for m in POWERS]
        np.testing.assert_allclose(mean_powers(surface, length, width), exact, rtol=1e-4)
    # of an interval of twice the length, a half of the pairs are of two different halves
    whole, half, other = (
        mean_powers(surface, *edges) for edges in ((30e-6, 2e-5), (15e-6, 2e-5), (15e-6, 2e-5, 15e-6))
    )
    np.testing.assert_allclose(whole, (half + other) / 2.0, rtol=1e-5)


@pytest.mark.parametrize("lag", [0.0, 0.4, 1.7])
def test_the_cusp_of_an_exponential_lies_between_panels(lag):
    """Pairs of a tenth and of 30 lengths, one interval a part of its edge behind the other: adaptive quadrature."""
    surface = Surface(lambda x, y: np.exp(-np.abs(x)) + 0.0 * y, (1.0, 1.0))
    for edge in (0.1, 30.0):
        ends = edge * (lag - 1.0), edge * (lag + 1.0)
        kinks = [x for x in (0.0, lag * edge) if ends[0] < x < ends[1]]
        for mean_power, power in zip(mean_powers(surface, edge, 1.0, lag * edge), POWERS, strict=True):

            def density(x, edge=edge, power=power):
                return math.exp(-power * abs(x)) * (1.0 - abs(x / edge - lag)) / edge

            exact = quad(density, *ends, points=kinks, limit=200, epsabs=1e-14)[0]
            assert mean_power == pytest.approx(exact, rel=1e-6)


def test_covariance_of_the_influence_is_that_over_all_pairs_of_blocks():
    rng = np.random.default_rng(1)
    area, force = rng.uniform(1, 2, (6, 9)), rng.uniform(1, 3, (6, 9))
    weights = strip_weights(6, 40, rng)
    blocks = blocks_of(area, force)
    covariance = influence_covariance(blocks, weights)
    counts = weights[3]
    mu = (counts @ area).sum() / (counts @ force).sum()
    influence = (area - mu * force) / ((counts @ force).sum() / (6 * 9))
    for lag in range(9):
        pairs = np.array([sum(one[i] * one[i + lag] for i in range(9 - lag)) for one in influence])
        assert covariance[3, lag] == pytest.approx(counts @ pairs / (6 * (9 - lag)))
    window = [influence[:, at : at + 8].mean(axis=1) ** 2 for at in (0, 1)]  # of eight blocks
    assert adjacent_variance(blocks, weights)[3] == pytest.approx(counts @ sum(window) / (6 * 2))


def test_independent_blocks_scatter_by_the_root_of_windows():
    """Without any correlation the pad of n windows has 1 / n of the variance, exactly."""
    covariance = np.tile(np.eye(1, BLOCKS), (3, 1))
    none = Surface(lambda x, y: 0.0 * (x + y), (SHORT, SHORT))
    parts = mehler_parts(covariance, none, BLOCK, WIDTH)
    pad = pad_scatter(parts, np.full(3, BLOCK / WINDOW), none, BLOCK, WIDTH, WINDOW)
    np.testing.assert_allclose(pad, np.tile(BLOCK / WINDOW / WINDOWS, (3, 1)), rtol=1e-12)
    nothing = mehler_parts(0.0 * covariance, none, BLOCK, WIDTH)
    np.testing.assert_array_equal(nothing, np.tile(np.append(np.zeros(len(POWERS)), 1.0), (3, 1)))
    assert np.all(pad_scatter(parts, np.array([1.0, 2.0, 0.0]), none, BLOCK, WIDTH, WINDOW)[2] > 0.0)  # of equal cells
    with pytest.raises(IllPosedError, match="no block carries force"):
        influence_covariance(blocks_of(np.ones((3, 4)), np.zeros((3, 4))), np.ones((41, 3), dtype=int))
    np.testing.assert_allclose(
        between_pads(pad, np.array([1.0, 50.0, 1e7])), BLOCK / WINDOW / np.array([1.0, 50.0, 1e7])
    )


def drawn_blocks():
    """Mean heights (STRIPS, BLOCKS) of blocks of the surface with both lengths, exact on points FINE a block edge.

    Along, the correlation of the points' means across is a table; its Cholesky factor draws the strips.
    """
    points = BLOCKS * FINE
    along = BLOCK / FINE * np.arange(points)
    across = WIDTH / 5 * np.arange(5)
    table = both(along[:, None], (across[:, None] - across).ravel()[None, :]).mean(axis=1)
    lags = np.abs(np.arange(points)[:, None] - np.arange(points))
    factor = np.linalg.cholesky(table[lags] + 1e-12 * np.eye(points))
    heights = np.random.default_rng(3).standard_normal((STRIPS, points)) @ factor.T
    return heights.reshape(STRIPS, BLOCKS, FINE).mean(axis=2)


def test_long_waves_keep_the_scatter_of_many_windows():
    """Area linear in the height under equal forces: the pad's variance is that of the mean height of a rectangle.

    Two per cent of long waves leave a pad of 256 windows 20.4 times the variance of independent ones. The strips hold
    twelve windows, or 3.6 long waves, so that 300 of them know the long part to a tenth.
    """
    heights = drawn_blocks()
    weights = strip_weights(STRIPS, 60, np.random.default_rng(4))
    blocks, surface = blocks_of(1e3 + heights, np.ones_like(heights)), Surface(both, (SHORT, SHORT))
    _, pad = pads(blocks, surface, weights)
    for level, windows in enumerate(WINDOWS[:6]):
        area = windows * WINDOW * WIDTH
        length = max(math.sqrt(area), WINDOW)
        exact = of_rectangle(length, area / length)
        low, high = np.quantile(pad[1:, level], (0.0, 1.0))
        assert low < exact < high
        assert pad[0, level] == pytest.approx(exact, rel=0.15)
    for length in (WINDOW / 3, 2e-3):  # pads of a given length, shorter than a window and longer than the long waves
        _, of_length = pads(blocks, surface, weights, length)
        exact = of_rectangle(length, WINDOWS[5] * WINDOW * WIDTH / length)
        assert of_length[0, 5] == pytest.approx(exact, rel=0.15)
    excess = pad[0, 4] * WINDOWS[4] / pad[0, 0]
    assert excess == pytest.approx(20.4, rel=0.15)
    assert adjacent_variance(blocks, weights)[0] == pytest.approx(of_rectangle(WINDOW, WIDTH), rel=0.15)


def test_autocorrelation_of_a_pad_in_closed_form():
    """Without correlation the triangle of its length. Else (D+ - 2 D0 + D-) / 2 of the second antiderivative D.

    Of rho = exp(-x^2 / l^2) along, D(x) / x^2 is `of_edge` of x, and the mean across does not depend on the lag.
    """
    length, width = pad_edges(64.0, WINDOW, WIDTH)
    assert length * width == pytest.approx(64 * WINDOW * WIDTH)
    assert (length, width) == (pytest.approx(438.2e-6, rel=1e-3), pytest.approx(438.2e-6, rel=1e-3))
    assert pad_edges(4.0, WINDOW, WIDTH) == pytest.approx((WINDOW, 4 * WIDTH))  # as long as a window
    lags, scale = length * np.array([0.0, 0.3, 0.9, 1.2]), 150e-6
    means = pad_means(Surface(lambda x, y: gaussian(x, y, scale), (scale, scale)), BLOCK, WIDTH, (length, width), lags)
    np.testing.assert_allclose(means[:, -1], BLOCK * WIDTH / (length * width) * np.maximum(1 - lags / length, 0))

    def antiderivative(x):
        return x**2 * of_edge(abs(x), scale) if x else 0.0

    sums = [antiderivative(lag + length) - 2 * antiderivative(lag) + antiderivative(lag - length) for lag in lags]
    np.testing.assert_allclose(means[:, 0], np.array(sums) / 2 / length**2 * of_edge(width, scale), rtol=1e-4)
