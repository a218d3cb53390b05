"""Designs: one sample a stratum, and what that does to the variance of a mean."""

import math

import numpy as np
import pytest
from scipy.special import ndtr, ndtri
from scipy.stats import norm

from roughslip.chaos.designs import latin_hypercube, monte_carlo
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
    """Var = (variables / n^2) sum of the variances of a normal cut to each stratum (a, b), which are
    1 + n (a phi(a) - b phi(b)) - (n (phi(a) - phi(b)))^2. A variance of R nearly normal means errs by sqrt(2 / R)."""
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


def test_a_monte_carlo_sample_depends_on_its_number_alone():
    alone = monte_carlo([7, 1, 12], 100)
    rows = [monte_carlo([7, 1, number], 100) for number in range(14)]
    assert np.array_equal(alone, rows[12])
    assert len(np.unique(rows)) == 1400


@pytest.mark.parametrize(("samples", "variables"), [(0, 3), (3, 0)])
def test_empty_designs_are_refused(samples, variables):
    with pytest.raises(ParameterError, match="samples and variables"):
        latin_hypercube(np.random.default_rng(0), samples, variables)
