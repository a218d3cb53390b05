"""The law of a target given its prediction: a law that is known is found again, in width and in place."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ndtri
from scipy.stats import norm

from roughslip.chaos.pressure import PressureTarget
from roughslip.chaos.residual_distribution import (
    NEIGHBOURS,
    PLACES,
    QUANTILES,
    conditional_means,
    residual_scatter,
)
from roughslip.errors import IllPosedError, ParameterError

SAMPLES = 40_000


def mean(s):
    return np.where(s > 0, s**2, 0.0) + s


def width(s):
    return 0.2 + 0.3 * np.maximum(s, 0.0)


def problem(samples=SAMPLES, seed=0):
    generator = np.random.default_rng([1991, seed])
    s = generator.standard_normal(samples)
    return s, mean(s) + width(s) * generator.standard_normal(samples)


@pytest.fixture(scope="module")
def law():
    return residual_scatter(*problem())


@pytest.mark.parametrize("probability", [0.1, 0.5, 0.9])
def test_quantiles_are_those_of_the_law_where_scatter_grows_with_the_prediction(law, probability):
    """A quantile of the window's samples has the error sqrt(q (1 - q) / n) / f, at most 1.8 width / sqrt(n), four of
    which are 0.18 width. The window smears the mean by its own slope, which is fitted, not by its position."""
    s = np.array([-1.5, -0.5, 0.0, 0.5, 1.0, 1.5])
    found = law.draw(s, np.full(6, probability))
    tolerance = 4 * 1.8 * width(s) / np.sqrt(NEIGHBOURS * SAMPLES)
    assert np.all(np.abs(found - mean(s) - width(s) * ndtri(probability)) < tolerance)


def test_the_centre_goes_on_straight(law):
    ends = np.array([law.low, law.high])
    beyond = law.centre(ends + np.array([-1.0, 1.0])) - law.centre(ends)
    further = law.centre(ends + np.array([-3.0, 3.0])) - law.centre(ends)
    np.testing.assert_allclose(further, 3 * beyond, rtol=1e-12)
    slopes = law.mean.derivative()(ends) * np.array([-1.0, 1.0])
    np.testing.assert_allclose(beyond, slopes, rtol=1e-12)


def test_a_draw_is_continuous_and_rises_with_its_uniform_number(law):
    uniform = np.linspace(0, 1, 4001)[:-1]
    assert np.all(np.diff(law.draw(np.full(4000, 0.3), uniform)) >= 0)
    # Across a place the law has no jump: it moves over 1e-9 by at most a slope of some 1e3.
    s = law.places[PLACES // 2] + np.array([-1e-9, 1e-9])
    for u in (0.0, 0.013, 0.5, 0.999):
        below, above = law.draw(s, np.full(2, u))
        assert above == pytest.approx(below, abs=1e-5)
    assert law.quantiles.shape == (PLACES, QUANTILES)


def test_a_cubic_without_scatter_is_given_back():
    s = np.random.default_rng(3).standard_normal(500)
    law = residual_scatter(s, 1 + s - 0.2 * s**3)
    at = np.linspace(-1.5, 1.5, 7)
    np.testing.assert_allclose(law.draw(at, np.full(7, 0.7)), 1 + at - 0.2 * at**3, atol=1e-12)


@pytest.mark.parametrize("factor", [1e-9, 1e9, 1e18])
def test_units_do_not_matter(factor):
    s, target = problem(3000)
    plain, scaled = residual_scatter(s, target), residual_scatter(factor * s, factor * target)
    at, uniform = np.linspace(-2, 2, 41), np.linspace(0, 0.99, 41)
    np.testing.assert_allclose(
        scaled.draw(factor * at, uniform), factor * plain.draw(at, uniform), rtol=0, atol=1e-10 * factor
    )


TRIAL = PressureTarget("trial_pressure", 1.0)
SQUARED = PressureTarget("squared_pressure", 1.0, 0.6)
PLACES_SEEN = np.linspace(-1.0, 2.0, 13)


def deviation(s):
    """Of the target around its prediction; it grows with the prediction."""
    return 0.2 + 0.1 * (s + 2.0)


def samples(seed, scale=1.0):
    rng = np.random.default_rng(seed)
    s = rng.uniform(-2.0, 3.0, (2, SAMPLES))
    return s, s + scale * deviation(s) * rng.standard_normal(s.shape)


@pytest.mark.parametrize("target", [TRIAL, SQUARED], ids=lambda target: target.kind)
def test_tables_are_the_expectations_of_a_normal_scatter_that_grows(target):
    """P = Phi(s / sd), E[p] = int p(s + sd z) phi(z) dz, for the trial pressure s Phi + sd phi. Each
    distribution comes from 4 % of the samples near s: 1300 over a span of 0.2, where the deviation changes by 5 %.
    Allowed are four standard errors of a share and of a mean, and 0.01 for that change and the 200 draws."""
    means = conditional_means(*samples(1), target)
    contact, pressure = means.at(np.tile(PLACES_SEEN, (2, 1)))
    for k, s in enumerate(PLACES_SEEN):
        sd, share = deviation(s), norm.cdf(s / deviation(s))
        expected = quad(lambda z: float(target.pressure(np.array(s + sd * z))) * norm.pdf(z), -s / sd, 8)[0]  # noqa: B023
        if target is TRIAL:
            assert expected == pytest.approx(s * share + sd * norm.pdf(s / sd), rel=1e-6)
        np.testing.assert_allclose(contact[:, k], share, atol=4 * np.sqrt(share * (1 - share) / 1300) + 0.01)
        np.testing.assert_allclose(pressure[:, k], expected, atol=4 * sd / np.sqrt(1300) + 0.01)


def test_without_scatter_they_are_those_of_the_prediction():
    """And so for a scatter that the places of the tables do not resolve."""
    for scale in (0.0, 0.004):
        means = conditional_means(*samples(2, scale), SQUARED)
        contact, pressure = means.at(np.tile(PLACES_SEEN, (2, 1)))
        assert np.array_equal(contact, np.tile(PLACES_SEEN > 0, (2, 1)))
        assert np.array_equal(pressure, np.tile(SQUARED.pressure(PLACES_SEEN), (2, 1)))
    resolved = conditional_means(*samples(2, 0.2), SQUARED)
    assert 0.2 < resolved.at(np.full((2, 1), 0.02))[0][0, 0] < 0.9


def test_beyond_the_samples_there_is_no_contact_or_that_of_the_largest_target():
    """A polynomial runs off beyond its samples; the largest target here is 3 and some deviations of 0.21."""
    s, values = samples(3, 0.3)
    contact, pressure = conditional_means(s, values, TRIAL).at(np.tile([-50.0, 3.0, 50.0], (2, 1)))
    np.testing.assert_array_equal(contact, [[0.0, 1.0, 1.0]] * 2)
    assert np.all(pressure[:, 0] == 0.0)
    # the last law has 1600 residuals on one side of it: predictions over a span of 0.2
    np.testing.assert_allclose(pressure[:, 1:], 3.0, atol=0.05)
    near = conditional_means(s + 2.05, values + 2.05, TRIAL)  # contact at the least prediction too
    assert near.contact[0, 0] > 0.1
    assert np.all(near.at(np.full((2, 1), -50.0))[0] == 0.0)


S, VALUES = problem(200)
LEVELS = np.stack([S, S]), np.stack([VALUES, VALUES])


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: residual_scatter(S[:99], VALUES[:99]), IllPosedError, "99 samples in or near contact are too few"),
        (lambda: residual_scatter(np.ones(200), VALUES), IllPosedError, "alike"),
        (lambda: residual_scatter(S, VALUES[1:]), ParameterError, "for each prediction"),
        (lambda: residual_scatter(S, np.where(S[7] == S, np.nan, VALUES)), ParameterError, "finite"),
        (lambda: residual_scatter(np.where(S[7] == S, np.inf, S), VALUES), ParameterError, "finite"),
        (lambda: conditional_means(LEVELS[0], LEVELS[1][:1], TRIAL), ParameterError, "match"),
        (lambda: conditional_means(*LEVELS, TRIAL).at(np.zeros((3, 4))), ParameterError, "3 levels"),
        (lambda: conditional_means(S[None, :50], VALUES[None, :50], TRIAL), IllPosedError, "too few"),
    ],
)
def test_unsuitable_samples_are_refused(call, error, message):
    with pytest.raises(error, match=message):
        call()
