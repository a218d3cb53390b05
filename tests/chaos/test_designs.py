"""Designs: one sample a stratum, and what that does to the variance of a mean."""

import math

import numpy as np
import pytest
from scipy.special import ndtr, ndtri
from scipy.stats import norm

from roughslip.chaos.designs import MOST_SOBOL_VARIABLES, design, latin_hypercube, monte_carlo, sobol
from roughslip.errors import ParameterError


@pytest.mark.parametrize("samples", [1, 2, 1000])
def test_each_stratum_of_each_variable_holds_one_sample(samples):
    xi = latin_hypercube(np.random.default_rng(1), samples, 6)
    strata = np.floor(samples * ndtr(xi)).astype(int)
    for variable in range(6):
        assert np.array_equal(np.sort(strata[:, variable]), np.arange(samples))


@pytest.mark.parametrize("place", [0.0, 0.5, 1.0 - 2.0**-53])
@pytest.mark.parametrize("samples", [1, 1000, 4096])
def test_extreme_draws_stay_finite_and_in_their_stratum(samples, place):
    """0 and 1 - 2^-53 are the extremes of Generator.random: added to a stratum, the latter rounds into the next."""

    class Extreme:
        def permutation(self, n):
            return np.arange(n)

        def random(self, shape):
            return np.full(shape, place)

    xi = latin_hypercube(Extreme(), samples, 1)[:, 0]
    edges = ndtri(np.arange(samples + 1) / samples)
    assert np.isfinite(xi).all()
    assert np.all((edges[:-1] < xi) & (xi < edges[1:]))


def test_variables_are_paired_at_random():
    """The correlation of two independent permutations has variance 1 / (n - 1): 15 pairs, so 4 standard deviations."""
    xi = latin_hypercube(np.random.default_rng(2), 2000, 6)
    correlation = np.corrcoef(xi.T)[np.triu_indices(6, 1)]
    assert np.max(np.abs(correlation)) < 4 / math.sqrt(1999)


def test_mean_of_an_additive_function_keeps_only_the_variance_within_strata():
    """Var = (variables / n^2) times the sum over the strata of the variance of a normal within (a, b).
    This variance is 1 + n (a phi(a) - b phi(b)) - (n (phi(a) - phi(b)))^2.
    A variance of R nearly normal means errs by sqrt(2 / R)."""
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


# --- Sobol ---


@pytest.mark.parametrize("samples", [1, 2, 64, 1024])
def test_a_power_of_two_of_a_sobol_sequence_has_one_sample_a_stratum(samples):
    xi = sobol(np.random.default_rng(4), samples, 101)
    strata = np.floor(samples * ndtr(xi)).astype(int)
    for variable in range(101):
        assert np.array_equal(np.sort(strata[:, variable]), np.arange(samples))


def test_a_sobol_sequence_can_be_extended():
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


def test_more_variables_or_samples_than_a_sobol_sequence_has_are_refused():
    with pytest.raises(ParameterError, match="take another design"):
        sobol(np.random.default_rng(0), 2, MOST_SOBOL_VARIABLES + 1)
    with pytest.raises(ParameterError, match="samples"):
        sobol(np.random.default_rng(0), 2**30 + 1, 1)


def test_a_design_by_its_name():
    for kind, method in (("latin_hypercube", latin_hypercube), ("sobol", sobol)):
        assert np.array_equal(design(kind, [7, 3], 50, 4), method(np.random.default_rng([7, 3]), 50, 4))
    rows = design("monte_carlo", [7, 3], 50, 4)
    assert np.array_equal(rows[12], monte_carlo([7, 3, 12], 4))
    assert np.array_equal(rows[:20], design("monte_carlo", [7, 3], 20, 4))
    with pytest.raises(ParameterError, match="not known"):
        design("halton", [7, 3], 50, 4)
    for kind in ("monte_carlo", "latin_hypercube", "sobol"):
        with pytest.raises(ParameterError, match=r"number of (samples|variables) must be at least 1"):
            design(kind, [7, 3], 0, 4)
