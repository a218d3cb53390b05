"""Local functionals: exact on polynomials inside and at the border, and the variables made of them.

Designs: one sample a stratum, and what that does to a variance. Empirical distributions: by definition or scipy."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.special import ndtr, ndtri
from scipy.stats import norm

from roughslip.chaos.functionals import (
    MIRRORED,
    NAMES,
    Stencil,
    local_functionals,
    orthonormal_directions,
    whitening,
)
from roughslip.chaos.sampling import (
    MOST_SOBOL_VARIABLES,
    cumulative_given_contact,
    distance_beyond_chance,
    kolmogorov_distance,
    latin_hypercube,
    quantile_levels,
    sobol,
)
from roughslip.errors import IllPosedError, ParameterError
from roughslip.probability.estimate import NORMAL_95, wilson_interval

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
    functionals = local_functionals(heights, STENCIL)
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
    for name, ours, expected in zip(NAMES, functionals, exact, strict=True):
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
    mirrored = np.flip(local_functionals(np.flip(heights, axis), stencil), 1 + axis)
    signs = (-1.0) ** MIRRORED[:, symmetry]
    np.testing.assert_allclose(mirrored, local_functionals(heights, stencil) * signs[:, None, None], rtol=0, atol=1e-14)


@pytest.mark.parametrize("draw", [latin_hypercube, sobol])
@pytest.mark.parametrize("samples", [1, 2, 1024])
def test_each_stratum_of_each_variable_holds_one_sample(draw, samples):
    xi = draw(np.random.default_rng(1), samples, 101)
    strata = np.floor(samples * ndtr(xi)).astype(int)
    np.testing.assert_array_equal(np.sort(strata, axis=0), np.tile(np.arange(samples)[:, None], 101))


@pytest.mark.parametrize("place", [0.0, 0.5, 1.0 - 2.0**-53])
@pytest.mark.parametrize("samples", [1, 1000, 4096])
def test_extreme_draws_stay_finite_and_in_their_stratum(samples, place):
    """0 and 1 - 2^-53 are the extremes of Generator.random: added to a stratum, the latter rounds into the next."""

    class Extreme(np.random.Generator):
        def permutation(self, n):
            return np.arange(n)

        def random(self, shape):
            return np.full(shape, place)

    xi = latin_hypercube(Extreme(np.random.PCG64()), samples, 1)[:, 0]
    edges = ndtri(np.arange(samples + 1) / samples)
    assert np.isfinite(xi).all()
    assert np.all((edges[:-1] < xi) & (xi < edges[1:]))


def test_mean_of_an_additive_function_keeps_only_the_variance_within_strata():
    """Var = (variables / n^2) times the sum over the strata of the variance of a normal within (a, b).
    This variance is 1 + n (a phi(a) - b phi(b)) - (n (phi(a) - phi(b)))^2.
    A variance of R nearly normal means errs by sqrt(2 / R). Variables not paired at random add to it."""
    n, variables, designs = 20, 3, 2000
    edges = ndtri(np.arange(n + 1) / n)
    density = norm.pdf(edges)
    moment = np.pad(edges[1:-1] * density[1:-1], 1)  # x phi(x) vanishes at infinity
    within = 1 - n * np.diff(moment) - (n * np.diff(density)) ** 2
    exact = variables * within.sum() / n**2
    rng = np.random.default_rng(3)
    means = [latin_hypercube(rng, n, variables).sum(axis=1).mean() for _ in range(designs)]
    assert np.var(means) == pytest.approx(exact, rel=4 * math.sqrt(2 / designs))
    assert exact < 0.06 * variables / n  # independent samples have variables / n


def test_sobol_designs_of_any_length_begin_with_the_same_samples():
    longest = sobol(np.random.default_rng(5), 1024, 7)
    for samples in (1, 64, 512, 700):  # past a power of two as well
        assert np.array_equal(sobol(np.random.default_rng(5), samples, 7), longest[:samples])
    assert not np.array_equal(sobol(np.random.default_rng(6), 64, 7), longest[:64])


def test_two_variables_of_a_sobol_sequence_fill_every_box_of_its_net():
    """The first two dimensions are a (0, 2)-sequence: 2^8 points, one in each of the boxes 2^-k by 2^-(8 - k)."""
    places = ndtr(sobol(np.random.default_rng(7), 256, 2))
    for k in range(9):
        boxes = np.floor(places * [2**k, 2 ** (8 - k)]).astype(int) @ [2 ** (8 - k), 1]
        assert np.array_equal(np.sort(boxes), np.arange(256))


def test_rows_taken_in_turn_are_no_strata():
    """Every 20th row: 205 of 4096 samples; means of the first variable within 4 standard errors. In the order of the
    sequence such rows lie in one quarter of it, with a mean of at least 0.3."""
    xi = sobol(np.random.default_rng(8), 4096, 3)
    means = [xi[group::20].mean(axis=0) for group in range(20)]
    assert np.max(np.abs(means)) < 4 / math.sqrt(204)


def test_places_at_the_ends_stay_finite(monkeypatch):
    """The finest cells at 0 and 1."""
    from scipy.stats import qmc

    ends = np.array([[0.0], [1.0 - 2.0**-30]])
    monkeypatch.setattr(qmc.Sobol, "random_base2", lambda self, m: ends)
    xi = sobol(np.random.default_rng(9), 2, 1)[:, 0]
    assert np.allclose(xi, [ndtri(2.0**-31), -ndtri(2.0**-31)])


@pytest.mark.parametrize(("samples", "variables"), [(2, MOST_SOBOL_VARIABLES + 1), (2**30 + 1, 1)])
def test_more_than_a_sobol_sequence_has_is_refused(samples, variables):
    with pytest.raises(ParameterError, match="a Sobol sequence has at most"):
        sobol(np.random.default_rng(0), samples, variables)


@settings(derandomize=True, max_examples=50, deadline=None)
@given(st.floats(1e-3, 1e6), st.floats(0, 1))
def test_wilson_ends_are_where_the_score_test_rejects(trials, share):
    """(share - p)^2 = z^2 p (1 - p) / n at both ends, also for the fractions that weights give."""
    for end in wilson_interval(share * trials, trials):
        assert 0 <= end <= 1
        assert (share - end) ** 2 == pytest.approx(NORMAL_95**2 * end * (1 - end) / trials, rel=1e-6, abs=1e-13)
    np.testing.assert_array_equal(wilson_interval(0.0, 0.0), [0.0, 1.0])  # without trials nothing is known


def test_cumulative_counts_positive_pressures_at_most_each_level():
    pressure = np.array([[0.0, 3.0, 1.0], [0.0, 3.0, np.inf]])
    levels = np.array([0.0, 0.5, 1.0, 2.9, 3.0, 1e300])
    assert np.array_equal(cumulative_given_contact(pressure, levels), [0, 0, 0.25, 0.25, 0.75, 0.75])


def test_levels_are_quantiles_dense_in_both_tails():
    """On 1 ... n the linear quantile at q is 1 + (n - 1) q."""
    n, count, lowest = 1001, 20, 1e-3
    pressure = np.concatenate([np.zeros(500), np.arange(1.0, n + 1)])
    levels = quantile_levels(np.random.default_rng(1).permutation(pressure), lowest, count)
    probability = (levels - 1) / (n - 1)
    assert len(levels) == 2 * count - 1
    assert probability[[0, count - 1, -1]] == pytest.approx([lowest, 0.5, 1 - lowest], rel=1e-12)
    np.testing.assert_allclose(probability + probability[::-1], 1.0, rtol=1e-12)
    np.testing.assert_allclose(np.diff(np.log(probability[:count])), math.log(0.5 / lowest) / (count - 1), rtol=1e-9)


@pytest.mark.parametrize("digits", [16, 1, 0])
@pytest.mark.parametrize("sizes", [(200, 31), (1, 1)])
def test_kolmogorov_distance_with_and_without_ties(sizes, digits):
    rng = np.random.default_rng(2)
    first, second = rng.standard_normal(sizes[0]), 0.3 + 1.5 * rng.standard_normal(sizes[1])
    first, second = np.maximum(first, 0.0).round(digits), np.maximum(second, 0.0).round(digits)
    ours = kolmogorov_distance(first, second)
    assert ours == pytest.approx(stats.ks_2samp(first, second).statistic, abs=1e-15)
    assert kolmogorov_distance(second, first) == ours
    assert kolmogorov_distance(first, np.repeat(first, 3)) == pytest.approx(0.0, abs=1e-15)


def test_samples_without_contact_are_refused():
    for call in (quantile_levels, lambda p: cumulative_given_contact(p, np.ones(1))):
        with pytest.raises(IllPosedError, match="no sample is in contact"):
            call(np.zeros(3))


def test_pairs_that_differ_by_chance_alone_have_hardly_a_distance():
    """A shift d of a normal variable moves its distribution by 2 Phi(d / 2) - 1. Noise of 0.1 moves it by 0.002, and
    the largest difference of 4000 pairs is some 2 sqrt(q / n) = 0.009, q = 0.08 of them crossing a value by chance."""
    rng = np.random.default_rng(3)
    first = rng.standard_normal((20, 4000))
    noise = 0.1 * rng.standard_normal(first.shape)
    beyond = [distance_beyond_chance(*pair, rng) for pair in zip(first, first + noise, strict=True)]
    plain = [kolmogorov_distance(*pair) for pair in zip(first, first + noise, strict=True)]
    assert np.mean(plain) > 0.007
    assert np.mean(beyond) < 0.5 * np.mean(plain)
    shifted = zip(first, first + 0.1 + noise, strict=True)
    moved = [distance_beyond_chance(*pair, rng) for pair in shifted]
    assert (
        2 * ndtr(0.05) - 1.004 < np.mean(moved) < 2 * ndtr(0.05) - 0.991
    )  # the largest of many is high, by 0.009 at most
