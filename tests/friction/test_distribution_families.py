"""Candidate laws of the friction coefficient: each finds itself, and the others are told apart by their distance."""

import numpy as np
import pytest
from scipy import stats

from roughslip.errors import IllPosedError
from roughslip.friction.distribution_families import FAMILIES, SKEWNESS, _gamma, _lognormal, fit_candidates
from roughslip.friction.marginal import PROBABILITIES
from roughslip.friction.resampling import strip_weights

STRIPS, WINDOWS = 200, 50


@pytest.mark.parametrize("skewness", [0.05, 0.5, 1.0, 2.0])
def test_quantiles_are_those_of_the_law_of_that_skewness(skewness):
    k = 4 / skewness**2
    np.testing.assert_allclose(_gamma(np.array([[skewness]]))[0], stats.gamma(k).ppf(PROBABILITIES), rtol=1e-9)
    s = (
        stats.norm.ppf(PROBABILITIES)
        @ np.log(_lognormal(np.array([[skewness]]))[0])
        / np.sum(stats.norm.ppf(PROBABILITIES) ** 2)
    )
    assert stats.lognorm(s).stats("s") == pytest.approx(skewness, rel=1e-9)


def drawn(law) -> dict:
    mu = law.rvs((STRIPS, WINDOWS), random_state=np.random.default_rng(6))
    weights = strip_weights(STRIPS, 60, np.random.default_rng(7))
    return fit_candidates(mu, np.ones(mu.shape, dtype=bool), weights)


@pytest.mark.parametrize(
    ("family", "law", "skewness"),
    [
        ("normal", stats.norm(0.3, 0.02), 0.0),
        ("gamma", stats.gamma(4.0, 0.2, 0.01), 1.0),
        ("lognormal", stats.lognorm(0.3, 0.1, 0.05), (np.exp(0.09) + 2) * np.sqrt(np.exp(0.09) - 1)),
    ],
)
def test_a_family_finds_its_own_law(family, law, skewness):
    """10 000 windows: the distance is what sampling leaves, some 1 / sqrt(n); skewness is known to some 0.06."""
    found = drawn(law)
    assert found[family].distance.value < 3 / np.sqrt(STRIPS * WINDOWS)
    assert found[family].distance.low == 0.0
    assert float(found[family].skewness.value) == pytest.approx(skewness, abs=0.12)
    assert found[family].distance.value <= min(found[other].distance.value for other in FAMILIES) + 0.004
    if skewness:
        assert found["normal"].distance.low > 0.05


def test_left_skewed_laws_are_mirror_images():
    right = drawn(stats.gamma(4.0))
    mu = -stats.gamma(4.0).rvs((STRIPS, WINDOWS), random_state=np.random.default_rng(6)) + 20.0
    weights = strip_weights(STRIPS, 60, np.random.default_rng(7))
    left = fit_candidates(mu, np.ones(mu.shape, dtype=bool), weights)
    assert float(left["gamma"].skewness.value) == pytest.approx(-float(right["gamma"].skewness.value), abs=0.011)
    assert float(left["gamma"].distance.value) == pytest.approx(float(right["gamma"].distance.value), rel=0.05)


def test_the_normal_law_is_the_member_without_skewness():
    middle = len(SKEWNESS) // 2
    assert SKEWNESS[middle] == pytest.approx(0.0, abs=1e-12)


def test_no_scatter_has_no_law():
    weights = strip_weights(5, 60, np.random.default_rng(7))
    with pytest.raises(IllPosedError, match="no scatter"):
        fit_candidates(np.full((5, 4), 0.3), np.ones((5, 4), dtype=bool), weights)
