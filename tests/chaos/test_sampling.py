"""Designs: one sample a stratum, and what that does to a variance. Empirical distributions: by definition or scipy."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.special import ndtr, ndtri
from scipy.stats import norm

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
