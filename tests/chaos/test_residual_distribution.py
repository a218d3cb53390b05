"""The law of a target given its prediction: a law that is known is found again, in width and in place."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ndtri
from scipy.stats import norm

from roughslip.chaos.pressure import PressureTarget
from roughslip.chaos.residual_distribution import (
    LEAST_SAMPLES,
    NEIGHBOURS,
    PLACES,
    QUANTILES,
    TABLE_PLACES,
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


def test_the_whole_distribution_keeps_its_width(law):
    """Moments of the target by fresh draws, against those of the samples that the law is of: 4 standard errors of the
    draws, sqrt(2 / n) for a variance, doubled for kurtosis."""
    s, target = problem()
    fresh = np.random.default_rng(5)
    drawn = law.draw(s, fresh.random(SAMPLES))
    assert drawn.mean() == pytest.approx(target.mean(), abs=4 * width(s).mean() / np.sqrt(SAMPLES))
    assert np.var(drawn) == pytest.approx(np.var(target), rel=4 * 2 * np.sqrt(2 / SAMPLES))
    outer = s > 1.2  # where it is widest
    residual, redrawn = (target - mean(s))[outer], (drawn - mean(s))[outer]
    assert np.var(redrawn) == pytest.approx(np.var(residual), rel=4 * 2 * np.sqrt(2 / outer.sum()))


def test_the_share_above_zero_given_the_prediction_is_kept(law):
    """Contact: P(target > 0 | s), where samples are dense known to 4 sqrt(1 / 4 n) of a window's."""
    uniform = (np.arange(2000) + 0.5) / 2000
    for s in (-0.4, -0.2, 0.0, 0.2):
        share = np.mean(law.draw(np.full(2000, s), uniform) > 0)
        true = np.mean(mean(np.array(s)) + width(np.array(s)) * ndtri(uniform) > 0)
        assert share == pytest.approx(true, abs=4 * 0.5 / np.sqrt(NEIGHBOURS * SAMPLES))


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


def test_order_does_not_matter():
    s, target = problem(3000)
    turned = np.random.default_rng(1).permutation(3000)
    at, uniform = np.linspace(-2, 2, 41), np.linspace(0, 0.99, 41)
    plain, other = residual_scatter(s, target), residual_scatter(s[turned], target[turned])
    np.testing.assert_array_equal(other.draw(at, uniform), plain.draw(at, uniform))


def test_what_tells_nothing_is_refused():
    s, target = problem(200)
    with pytest.raises(IllPosedError, match="99 samples in or near contact are too few"):
        residual_scatter(s[: LEAST_SAMPLES - 1], target[: LEAST_SAMPLES - 1])
    with pytest.raises(IllPosedError, match="alike"):
        residual_scatter(np.ones(200), target)
    with pytest.raises(ParameterError, match="for each prediction"):
        residual_scatter(s, target[1:])
    for bad in (np.nan, np.inf):
        with pytest.raises(ParameterError, match="finite"):
            residual_scatter(s, np.where(np.arange(200) == 7, bad, target))
        with pytest.raises(ParameterError, match="finite"):
            residual_scatter(np.where(np.arange(200) == 7, bad, s), target)


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
    """P = Phi(s / sd), E[p] = int p(s + sd z) phi(z) dz, for the trial pressure s Phi + sd phi. Each law comes from 4 %
    of the samples near s, 1300 of a span of 0.2, over which the deviation changes by 5 % at most: four standard errors
    of a share and of a mean, and a hundredth for that and the 200 draws."""
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


def test_every_level_has_tables_of_its_own():
    s, values = samples(4)
    means = conditional_means(s, np.stack([values[0], values[1] + 1.0]), TRIAL)
    assert means.contact.shape == means.pressure.shape == (2, TABLE_PLACES)
    contact, pressure = means.at(np.zeros((2, 3, 5)))
    assert contact.shape == pressure.shape == (2, 3, 5)
    np.testing.assert_allclose(contact[0], 0.5, atol=4 * 0.5 / np.sqrt(1300) + 0.01)
    np.testing.assert_allclose(contact[1], norm.cdf(1 / 0.4), atol=0.03)
    np.testing.assert_allclose(pressure[1], norm.cdf(2.5) + 0.4 * norm.pdf(2.5), atol=0.06)


def test_what_does_not_match_or_is_too_little_is_refused():
    s, values = samples(5)
    with pytest.raises(ParameterError, match="match"):
        conditional_means(s, values[:1], TRIAL)
    with pytest.raises(ParameterError, match="3 levels"):
        conditional_means(s, values, TRIAL).at(np.zeros((3, 4)))
    with pytest.raises(IllPosedError, match="too few"):
        conditional_means(s[:, :50], values[:, :50], TRIAL)
