"""Local functionals: exact on polynomials inside and at the border, and the variables made of them.

Designs: one sample a stratum, and what that does to a variance. Empirical distributions: by definition or scipy.

Distributions of the pressure at the centre: refits, intervals of distances, several designs.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.special import ndtr, ndtri
from scipy.stats import norm

from roughslip.chaos.centre_distribution import (
    BLOCK,
    REFIT_BLOCKS,
    REPLICATES,
    SETTLED,
    Expansion,
    Reference,
    apart,
    design_pressures,
    designed_rows,
    draw,
    expanded_rows,
    refits,
    refused_rows,
    sampled_rows,
)
from roughslip.chaos.functionals import (
    MIRRORED,
    NAMES,
    Stencil,
    local_functionals,
    orthonormal_directions,
    whitening,
)
from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.chaos.regression import wild_coefficients
from roughslip.chaos.sampling import (
    MOST_SOBOL_VARIABLES,
    cumulative_given_contact,
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


INDICES = multi_indices(2, 2)


def exact_expansion(method, truth, samples=300, seed=0):
    """Pressures that follow a polynomial `truth` exactly: p = r^+."""
    basis = hermite_basis(np.random.default_rng(seed).standard_normal((samples, 2)), INDICES)
    return Expansion(method, basis, np.maximum(basis @ truth, 0), INDICES)


TRUTH = np.array([-2e7, 4e7, 1e7, 5e6, 0.0, 3e6])


def test_refits_scatter_as_new_samples_would_with_four_samples_a_coefficient():
    """sigma sqrt(x' (X'X)^-1 x) at new points; the mean ratio over 50 points is known to some 4 %.

    Without signs, and without residuals, refits are the fit.
    """
    rng = np.random.default_rng(2)
    basis, new, weights = rng.standard_normal((200, 50)), rng.standard_normal((50, 50)), np.ones(200)
    exact = basis @ np.ones(50)
    values, signs = exact + rng.standard_normal(200), rng.choice([-1.0, 1.0], (200, 400))
    spread = np.std(new @ wild_coefficients(basis, values, weights, signs), axis=1)
    true = np.sqrt(np.einsum("ni,ij,nj->n", new, np.linalg.inv(basis.T @ basis), new))
    assert np.mean(spread / true) == pytest.approx(1.0, abs=0.1)  # plain residuals would give sqrt(1 - 50/200) = 0.87
    np.testing.assert_allclose(wild_coefficients(basis, exact, weights, signs), 1.0, atol=1e-12)
    fitted = np.linalg.lstsq(basis, values, rcond=None)[0]
    np.testing.assert_allclose(wild_coefficients(basis, values, weights, 0 * signs).T, [fitted] * 400, rtol=1e-9)


@pytest.mark.slow
def test_refits_are_of_the_scatter_of_their_samples():
    one = exact_expansion("equation_8", TRUTH)
    noise = 5e6 * np.random.default_rng(3).standard_normal(len(one.pressure))
    noisy = Expansion("equation_8", one.basis, np.where(one.pressure > 0, np.abs(one.pressure + noise), 0.0), INDICES)
    levels = np.array([1e6, 1e7, 5e7])
    curves = refits(noisy, noisy.fit(), levels, [3], [4])
    np.testing.assert_array_equal(curves, refits(noisy, noisy.fit(), levels, [3], [4]))
    assert np.all(np.std(curves, axis=0) > 1e-4)
    contact = noisy.pressure > 0
    count = np.count_nonzero(contact)
    signs = np.random.default_rng([4]).choice([-1.0, 1.0], (count, REPLICATES))  # the first of them by hand
    refit = wild_coefficients(noisy.basis[contact], noisy.pressure[contact], np.ones(count), signs)[:, 0]
    pressures = [draw(noisy, one, REFIT_BLOCKS * BLOCK, [3]) for one in (refit, noisy.fit().coefficients)]
    refit, fit = (cumulative_given_contact(pressure, levels) for pressure in pressures)
    np.testing.assert_allclose(curves[0], refit - fit, atol=1e-4)  # a draw may change sides of a level by rounding


def test_pressures_of_the_exponential_stay_finite_and_too_few_samples_in_contact_are_refused():
    """The cubic exponent of eq. (9) exceeds what a double holds sooner or later."""
    values = exact_expansion("equation_9", TRUTH).at(np.array([[1e4], [-1e4]]) * np.eye(6)[0], np.eye(6)[0])
    assert np.all((values > 0) & np.isfinite(values))
    with pytest.raises(IllPosedError):
        exact_expansion("equation_8", TRUTH - 1e8 * np.eye(6)[0]).fit()
    rows = refused_rows(np.arange(3.0), (0.1, 0.05, 0.2))
    assert rows.pop("contact_probability") == (0.1, 0.05, 0.2)
    assert all(np.isnan(value).all() for row in rows.values() for value in row)


def reference(surfaces=5000, share=0.2, seed=0):
    rng = np.random.default_rng([11, seed])
    pressure = rng.exponential(1.0, surfaces) * (rng.random(surfaces) < share)
    return Reference(pressure, surfaces, np.quantile(pressure[pressure > 0], np.linspace(0.001, 0.999, 200)))


def test_tail_error_is_the_largest_logarithm_of_a_ratio_where_the_reference_knows_the_probability():
    one = reference(surfaces=20_000)
    F = one.cumulative
    assert one.tail_from == SETTLED / one.contacts == SETTLED / np.count_nonzero(one.pressure)
    assert reference(surfaces=1_100_000).tail_from == 0.001
    assert np.isnan(reference(surfaces=1000).tail_error(F, F))  # 200 contacts, of which 200 are all
    assert one.tail_error(2 * F, F) == one.tail_error(F / 2, F) == pytest.approx(np.log10(2))
    low = (one.tail_from <= F) & (F <= 0.1)
    assert one.tail_error(np.where(low, F, 5 * F), F) == 0.0
    assert one.tail_error(0 * F, F) == pytest.approx(np.log10(F[low].max() * BLOCK))  # zero counts as one in a block


def test_the_interval_of_a_sampled_distance_holds_the_true_one():
    """Exponential laws of scale 1 and 1.3, which are max |e^-x - e^-x/1.3| = 0.0966 apart; 95 % of 120 trials, less
    three standard errors of 2 %."""
    x = np.linspace(0, 10, 10_001)
    true = np.max(np.abs(stats.expon.cdf(x) - stats.expon.cdf(x, scale=1.3)))
    rng, held, high = np.random.default_rng(5), 0, []
    for seed in range(120):
        pressure = rng.exponential(1.3, 2000) * (rng.random(2000) < 0.2)
        distance, low, most = sampled_rows(pressure, 2000, reference(seed=seed))["distance_in_contact"]
        assert low <= distance <= most
        held += low <= true <= most
        high.append(most - distance)
    assert held >= 0.89 * 120
    assert np.mean(high) == pytest.approx(0.98 * np.sqrt(1 / 400 + 1 / 1000), rel=0.02)


def test_the_error_in_the_tail_is_as_uncertain_as_the_farther_end_of_its_curve():
    """Of few samples the lower end of the band is farther on a logarithm than the upper one."""
    known = reference(surfaces=20_000)
    pressure = np.random.default_rng(3).exponential(1.0, 3000) * (np.random.default_rng(4).random(3000) < 0.2)
    rows = sampled_rows(pressure, 3000, known)
    curve, low, high = rows["cumulative"]
    far, near = known.tail_error(low, curve), known.tail_error(high, curve)
    value, least, most = rows["tail_error"]
    assert far > near
    assert (most - value, least) == pytest.approx((far, max(value - far, 0.0)), rel=1e-12)


def test_rows_of_an_expansion_hold_their_values_and_have_at_least_the_error_of_the_reference():
    one = reference(surfaces=20_000)
    pressure = np.random.default_rng(6).exponential(1.1, 20_000)
    still = expanded_rows(pressure, np.zeros((20, 200)), (0.2, 0.1, 0.3), one)
    distance, low, high = still["distance_in_contact"]
    assert high - distance == pytest.approx(0.98 / np.sqrt(one.contacts), rel=1e-3)
    tail, _, most = still["tail_error"]
    assert most - tail == pytest.approx(1.96 / np.log(10) / np.sqrt(SETTLED), rel=1e-3)
    moved = 0.02 * np.random.default_rng(7).standard_normal((20, 1)) * np.ones(200)
    wider = expanded_rows(pressure, moved, (0.2, 0.1, 0.3), one)
    assert wider["distance_in_contact"][0] == distance
    assert wider["distance_in_contact"][1] <= low
    far = np.quantile(np.abs(moved[:, 0]), 0.95)
    assert wider["distance_in_contact"][2] == pytest.approx(high + far)
    tail, least, most = expanded_rows(2.0 * pressure, 0 * moved, (0.2, 0.1, 0.3), one)["tail_error"]
    assert tail - least == pytest.approx(most - tail)  # log 2.2 is beyond the error, so that it is not cut
    assert least > 0.0
    assert np.all((wider["cumulative"][1] >= 0) & (wider["cumulative"][2] <= 1))


def test_numbers_of_several_designs_are_their_mean_with_students_interval():
    """Three designs, of the reference's own pressures and of these scaled by 0.7 and 1.3."""
    one = reference(surfaces=200_000)
    own = np.sort(one.pressure[one.pressure > 0])
    scale = 0.3
    rows = designed_rows(np.stack([own, own * (1 - scale), own * (1 + scale)]), (0.2, 0.1, 0.3), one)
    distances = np.array([0.0, *(kolmogorov_distance(own * (1 + sign * scale), own) for sign in (-1, 1))])
    mean, low, high = rows["distance_in_contact"]
    assert mean == pytest.approx(distances.mean(), rel=1e-9)
    student = 4.302653 * distances.std(ddof=1) / math.sqrt(3)  # t(0.975, 2) = 4.302653
    half = math.hypot(student, 0.98 / math.sqrt(one.contacts))
    assert high - mean == pytest.approx(half, rel=1e-4)
    assert low == 0.0
    curve, lowest, highest = rows["cumulative"]
    assert np.all((lowest <= curve) & (curve <= highest))


def test_variants_whose_refits_move_together_are_surely_apart():
    """What their common samples do to both cancels."""
    rng = np.random.default_rng(8)
    first, second = rng.exponential(1.0, 5000), rng.exponential(2.0, 5000)
    moved = 0.1 * rng.standard_normal((50, 30))
    distance, low, high = apart(first, second, {"equation_8": moved, "equation_9": moved})
    assert low == distance == high == pytest.approx(0.25, abs=0.02)  # max |e^-x - e^-x/2| = 1/4
    moved[:, 0] *= 0.1  # the distance changes by the most that a refit changes at any level
    _, low, high = apart(first, second, {"equation_8": moved, "equation_9": -moved})
    far = np.quantile(2 * np.abs(moved).max(axis=1), 0.95)
    assert (low, high) == pytest.approx((max(distance - far, 0.0), min(distance + far, 1.0)))
    _, low, high = apart(first, second, {"equation_8": moved / 50, "equation_9": -moved / 50})
    assert (distance - low, high - distance) == pytest.approx((far / 50, far / 50))


def test_pressures_of_several_designs_are_of_the_same_draws():
    designs = [
        exact_expansion("equation_8", TRUTH * np.array([1, scale, 1, 1, 1, 1]), seed=seed)
        for scale, seed in ((1, 0), (2, 1))
    ]
    fits = [design.fit() for design in designs]
    pressures = design_pressures(designs, fits, [4])
    for row, design, fit in zip(pressures, designs, fits, strict=True):
        np.testing.assert_allclose(row, draw(design, fit.coefficients, REFIT_BLOCKS * BLOCK, [4]), rtol=1e-9)
